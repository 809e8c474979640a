"""What a newcomer tried because a page says it: each was otherwise once."""

from __future__ import annotations

import furuta
import numpy as np
import pytest

NAME = "shahzad2022-srv02"
RIG = furuta.Rig.load(NAME)


@pytest.fixture
def path(tmp_path):
    RIG.save(tmp_path / "rig.toml")
    return tmp_path / "rig.toml"


def test_a_name_or_a_path_is_a_rig_in_a_bode_plot(path):
    pytest.importorskip("matplotlib")
    lines = [furuta.plot.bode(given).axes[0].lines[0].get_ydata() for given in (RIG, NAME, path)]
    assert np.array_equal(lines[0], lines[1]) and np.array_equal(lines[0], lines[2])


def test_a_recording_is_not_saved_under_an_ending_that_cannot_be_read(tmp_path):
    t = 0.002 * np.arange(500)
    recording = furuta.Recording(t=t, u=np.sin(9 * t), theta=0.1 * np.sin(9 * t), alpha=np.pi + 0 * t)
    with pytest.raises(furuta.RecordingError, match="a recording is saved as CSV; give a path that ends in .csv"):
        recording.save(tmp_path / "run.MCAP")
    assert not list(tmp_path.iterdir())
    recording.save(tmp_path / "run.csv")
    assert furuta.Recording(tmp_path / "run.csv") == recording


def swing():
    t = 0.002 * np.arange(500)
    return furuta.Recording(t=t, u=np.sin(9 * t), theta=0.1 * np.sin(9 * t), alpha=np.pi + 0 * t)


def test_a_path_is_a_recording_in_a_plot(tmp_path):
    pytest.importorskip("matplotlib")
    swing().save(tmp_path / "run.csv")
    for given in (tmp_path / "run.csv", str(tmp_path / "run.csv")):
        drawn = furuta.plot.trajectory(given).axes[0].lines[0].get_ydata()
        assert np.array_equal(drawn, swing().theta)
    with pytest.raises(TypeError, match="before_after draws a Diagnosis or a Calibration; a Recording was given"):
        furuta.plot.before_after(swing())


def test_an_unknown_column_says_which_there_are():
    run = furuta.Trajectory.simulate(RIG, [0, np.pi, 0, 0], np.zeros(5), 0.002)
    with pytest.raises(KeyError, match="voltage: a recording has the columns t, u, theta, alpha"):
        swing()["voltage"]
    with pytest.raises(KeyError, match="voltage: this trajectory has the columns t, u, theta, alpha"):
        run["voltage"]
    assert "voltage" not in swing() and swing().get("voltage") is None
