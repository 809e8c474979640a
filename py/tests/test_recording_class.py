"""Recordings from DataFrames, arrays, dicts and files, and trajectories with a time and names."""

from __future__ import annotations

import copy
import pickle

import furuta
import numpy as np
import pytest

RIG = furuta.Rig.load("qube-servo-2")
DT = 0.002


def columns(n=3000):
    t = DT * np.arange(n)
    u = 3 * np.sin(2 * t * (1 + t))
    x = furuta.simulate(RIG, [0, np.pi, 0, 0], u[:-1], DT)
    theta, alpha = furuta.measure(RIG, x).T
    return {"t": t, "u": u, "theta": theta, "alpha": alpha}


def test_every_way_gives_the_same_recording(tmp_path):
    pandas = pytest.importorskip("pandas")
    data = columns()
    frame = pandas.DataFrame(data)
    recording = furuta.Recording(data)
    recording.save(tmp_path / "run.csv")
    fields = np.array(list(zip(*data.values())), dtype=[(name, float) for name in data])
    ways = {
        "DataFrame": frame,
        "index": frame.set_index("t"),
        "array": np.column_stack(list(data.values())),
        "fields": fields,
        "file": str(tmp_path / "run.csv"),
        "path": tmp_path / "run.csv",
        "recording": recording,
        "other order": dict(reversed(data.items())),
    }
    for way, given in ways.items():
        assert furuta.Recording(given) == recording, way
    assert furuta.Recording(**data) == recording
    assert recording.to_pandas().equals(frame)
    assert np.array_equal(recording.to_array(), ways["array"])
    expected = furuta.validate(data, RIG).to_dict()["channels"]
    for way, given in ways.items():
        # A file is called by its path.
        found = furuta.validate(given, RIG).to_dict()["channels"]
        assert [{**c, "run": ""} for c in found] == [{**c, "run": ""} for c in expected], way


def test_several_at_once_and_names():
    pandas = pytest.importorskip("pandas")
    data = columns()
    named = furuta.Recording(data, name="bench 2")
    other = pandas.DataFrame({**data, "theta": data["theta"] + 0.1})
    found = furuta.validate([named, other], RIG)
    assert [c["run"] for c in found.channels if c["channel"] == "theta"] == ["bench 2", "recording-1"]
    response = furuta.frf(named, band=(0.5, 5))
    assert np.array_equal(response.response, furuta.frf(data, band=(0.5, 5)).response)


def test_a_frames_other_columns(tmp_path):
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(columns()).assign(current=0.25, mode="excite")
    recording = furuta.Recording(frame)
    assert set(recording) == {"t", "u", "theta", "alpha", "current", "mode"}
    assert np.array_equal(recording["current"], frame["current"]) and recording["mode"] == ["excite"] * 3000
    recording.save(tmp_path / "run.csv")
    assert furuta.Recording(tmp_path / "run.csv") == recording


def test_columns_of_text():
    marks = ["plain", "a, b", "# c", 'an "e"'] * 75
    for given in (marks, np.array(marks), np.array(marks, dtype=object)):
        assert furuta.Recording(columns(300), mark=given)["mark"] == marks
    given = [None, float("nan"), *marks[2:]]
    assert furuta.Recording(columns(300) | {"mark": given})["mark"][:3] == ["", "", "# c"]


@pytest.mark.parametrize("zone", [None, "UTC"])
def test_times_are_seconds(zone):
    pandas = pytest.importorskip("pandas")
    data = columns(300)
    moments = pandas.Series(pandas.Timestamp("2026-11-26", tz=zone) + pandas.to_timedelta(data["t"], unit="s"))
    spans = np.round(data["t"] * 1e6).astype("timedelta64[us]")
    for t in (moments, spans):
        frame = pandas.DataFrame(data | {"t": t})
        for given in (frame, frame.set_index("t"), data | {"t": t}):
            assert np.allclose(furuta.Recording(given).t, data["t"], rtol=0, atol=1e-9)


def test_a_sample_period_from_time_stamps_of_few_digits():
    data = columns()
    data["t"] = (500 + data["t"]).astype(np.float32)
    assert furuta.Recording(data).dt == pytest.approx(DT, rel=1e-4)


def test_what_a_recording_says_of_itself():
    recording = furuta.Recording(columns(), name="swing")
    assert (recording.samples, recording.dt) == (3000, pytest.approx(DT)) and recording.duration == pytest.approx(5.998)
    assert repr(recording) == "<furuta.Recording 'swing': 3000 samples, 5.998 s at 500 Hz; t, u, theta, alpha>"
    for again in (copy.copy(recording), copy.deepcopy(recording), pickle.loads(pickle.dumps(recording))):
        assert again == recording and again.name == "swing"
    other = columns()
    other["u"] = other["u"] + 1e-9
    assert furuta.Recording(other) != recording
    told = recording.to_dict()
    told["u"][:] = 0
    assert recording.u.any()


@pytest.mark.parametrize(
    "make, error, says",
    [
        (
            lambda: furuta.Recording({"t": [0, 1], "u": [0, 0], "theta": [0, 0]}),
            furuta.RecordingError,
            "no column `alpha`; found t, u, theta",
        ),
        (lambda: furuta.Recording(columns() | {"u": np.zeros(7)}), furuta.RecordingError, "has .* values, column"),
        (
            lambda: furuta.Recording(columns() | {"u": ["a"] * 3000}),
            furuta.RecordingError,
            "column `u` must be an array of numbers",
        ),
        (lambda: furuta.Recording(), furuta.RecordingError, "there are no columns; required are t, u, theta, alpha"),
        (
            lambda: furuta.Recording(columns() | {"both": np.zeros((3000, 2))}),
            furuta.RecordingError,
            r"column `both` has shape \(3000, 2\)",
        ),
        (lambda: furuta.Recording(columns() | {"mode": ["a"] * 7}), furuta.RecordingError, "`mode` has 7 values"),
        (lambda: furuta.Recording(columns() | {"what": [{}] * 3000}), furuta.RecordingError, "column `what` must be"),
        (
            lambda: furuta.Recording(columns() | {"u": np.ma.masked_greater(columns()["u"], 2)}),
            furuta.RecordingError,
            "column `u` is an array with masked entries",
        ),
        (lambda: furuta.Recording(np.zeros((10, 3))), ValueError, r"has shape \(10, 3\); it must be \(n, 4\)"),
        (lambda: furuta.Recording(columns(), name=3), TypeError, "name = 3 must be a str or None"),
        (lambda: furuta.Recording("run.csv", name=["a"]), TypeError, r"name = \['a'\] must be a str or None"),
        (lambda: furuta.Recording("no/such/file.csv"), furuta.RecordingError, "no/such/file.csv"),
        (lambda: furuta.Recording("run.csv", u=[1]), furuta.RecordingError, "a file has its columns"),
        (
            lambda: furuta.diagnose(3, RIG),
            TypeError,
            "a recording is a path, a furuta.Recording, a pandas DataFrame or a dict .* got int",
        ),
        (lambda: furuta.diagnose([3], RIG), TypeError, "got int"),
    ],
)
def test_what_is_no_recording(make, error, says):
    with pytest.raises(error, match=says):
        make()


def test_saving_replaces_nothing_unasked(tmp_path):
    recording = furuta.Recording(columns())
    recording.save(tmp_path / "run.csv")
    with pytest.raises(FileExistsError):
        recording.save(tmp_path / "run.csv")
    recording.save(tmp_path / "run.csv", force=True)


def test_a_trajectory_has_time_and_names():
    pandas = pytest.importorskip("pandas")
    u = furuta.signal("multisine", 2, DT, amplitude=2)
    run = furuta.Trajectory.simulate(RIG, [0, np.pi, 0, 0], u, DT)
    x, y = furuta.simulate(RIG, [0, np.pi, 0, 0], u, DT, encoders=True)
    assert np.array_equal(run.x, x) and np.array_equal(run.y, y) and np.array_equal(run.u[:-1], u)
    assert np.allclose(run.t, DT * np.arange(1001), rtol=0, atol=1e-12)
    for i, name in enumerate(("theta", "alpha", "theta_dot", "alpha_dot")):
        assert np.array_equal(run[name], x[:, i]) and np.array_equal(getattr(run, name), x[:, i])
    assert isinstance(run.to_pandas(), pandas.DataFrame) and list(run.to_pandas()) == list(run.columns())
    assert run.name == "qube-servo-2" and run.rig == RIG and run.modes is None
    recording = run.to_recording()
    assert np.array_equal(recording.theta, y[:, 0]) and recording.name == "qube-servo-2"
    found = furuta.validate(recording, RIG)
    assert all(c["fit_percent"] > 99 for c in found.channels)
    assert pickle.loads(pickle.dumps(run)) == run == copy.deepcopy(run)


def test_a_run_without_a_command_is_empty():
    run = furuta.Trajectory.simulate(RIG, [0, np.pi, 0, 0], [], DT)
    assert run.x.shape == (1, 4) and "1 samples, 0 s" in repr(run)
    with pytest.raises(ValueError, match="the run of 'qube-servo-2' is empty: no sample follows the first"):
        _ = run.dt
    assert furuta.Trajectory.simulate(RIG, [0, np.pi, 0, 0], [0.1], DT).dt == DT


def test_a_trajectory_under_control():
    standard = furuta.Controller.from_toml("", "shahzad2022-srv02", DT)
    run = furuta.Trajectory.simulate("shahzad2022-srv02", [0, np.pi, 0, 0], np.zeros(2500), DT, controller=standard)
    x, u, modes = furuta.simulate("shahzad2022-srv02", [0, np.pi, 0, 0], np.zeros(2500), DT, controller=standard)
    assert np.array_equal(run.x, x) and np.array_equal(run.u[:-1], u) and run.modes == modes


def test_what_is_saved_is_read_again(tmp_path):
    known = {name: values + 0.0 for name, values in columns(300).items()}
    speed = np.where(known["t"] < 0.1, np.nan, 1 / 3)
    speeds = ["" if s != s else repr(s) for s in speed.tolist()]
    rows = zip(*(map(repr, values.tolist()) for values in known.values()), speeds)
    marks = ["plain", "a, b", "# c", 'an "e"'] * 75
    quoted = ["plain", '"a, b"', "# c", '"an ""e"""'] * 75
    text = "".join(",".join([*row, mark]) + "\n" for row, mark in zip(rows, quoted))
    (tmp_path / "as written.csv").write_text("t,u,theta,alpha,theta_dot,mark\n" + text)
    recording = furuta.Recording(tmp_path / "as written.csv")
    assert recording["mark"] == marks and np.array_equal(recording["theta_dot"], speed, equal_nan=True)
    recording.save(tmp_path / "saved.csv")
    assert (tmp_path / "saved.csv").read_text() == (tmp_path / "as written.csv").read_text()
    assert furuta.Recording(tmp_path / "saved.csv") == recording


def test_a_recording_is_checked_once(tmp_path):
    """What was noticed as it was made is what every function says; what is written to it since is checked."""
    data = columns()
    gap = np.delete(np.arange(3000), slice(1500, 1510))
    furuta.Recording({k: v[gap] for k, v in data.items()}).save(tmp_path / "gap.csv")
    recording = furuta.Recording(tmp_path / "gap.csv")
    assert any("row 1502" in notice for notice in recording.notices), recording.notices
    said = [furuta.frf(given).notices for given in (tmp_path / "gap.csv", recording)]
    assert said[0] == said[1]
    for same in (copy.deepcopy(recording), pickle.loads(pickle.dumps(recording))):
        assert same == recording
        np.testing.assert_array_equal(furuta.frf(same).response, furuta.frf(recording).response)
    assert any(" other: " in f" {n}" for n in furuta.frf({"other": recording}).notices)
    recording.alpha[7] = np.nan
    with pytest.raises(furuta.RecordingError, match="row 7, column alpha: the value is NaN"):
        furuta.frf(recording)
    recording.alpha[7] = recording.alpha[6]
    before = furuta.frf(recording).response
    recording.u[:] *= 2
    np.testing.assert_allclose(furuta.frf(recording).response, before / 2)
