"""Recordings that keep every N-th row of a faster controller: the command went on changing between two rows."""

from __future__ import annotations

import json

import furuta
import numpy as np
import pytest

pytest.importorskip("mujoco")

from benchmark_cases import Case  # noqa: E402

EVERY = 5  # of 500 rows a second


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """The sheet and two recordings of a MuJoCo rig with dry friction, every fifth row of them; its torque, N m."""
    folder = tmp_path_factory.mktemp("kept")
    case = Case("rig", "bench-made", ("arm.coulomb",), 7, runs=("multisine", "steps"), rate=500.0)
    case.write(folder)
    recordings = {}
    for path in sorted((folder / "rig").glob("run-*.csv")):
        rows = np.genfromtxt(path, delimiter=",", names=True)[::EVERY]
        recordings[path.stem] = {name: rows[name] for name in ("t", "u", "theta", "alpha")}
    truth = json.loads((folder / "rig" / "truth.json").read_text())
    return furuta.Rig.load(folder / "rig" / "rig.toml"), recordings, truth["effects"]["arm.coulomb"]["torque"]


def test_a_held_command_is_half_a_row_late(kept):
    rig, recordings, _ = kept
    with pytest.raises(furuta.RecordingError, match=r"0\.\d rows before u is written.*command=\"smooth\""):
        furuta.diagnose(recordings, rig)


def test_a_smooth_command_names_what_is_hidden(kept):
    rig, recordings, hidden = kept
    found = furuta.diagnose(recordings, rig, command="smooth", time_limit=None)
    assert (found.verdict, [e["id"] for e in found.effects]) == ("missing_effects", ["arm.coulomb"])
    torque = found.effects[0]["parameters"]["torque"]
    assert abs(torque["value"] - hidden) < 0.02 * hidden


def test_calibrate_and_validate_take_the_same(kept):
    rig, recordings, _ = kept
    rig = rig.with_effect("arm.coulomb", torque=1e-3)
    smooth = furuta.validate(recordings, rig, command="smooth")
    assert smooth is not None
    with pytest.raises(furuta.RecordingError, match="rows before u is written"):
        furuta.calibrate(recordings, rig, free=["arm.inertia"])
    assert furuta.calibrate(recordings, rig, free=["arm.inertia"], command="smooth").parameters["arm.inertia"]
    with pytest.raises(ValueError, match="command: `cubic` is neither held nor smooth"):
        furuta.validate(recordings, rig, command="cubic")
