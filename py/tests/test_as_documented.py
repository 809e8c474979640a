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
