"""The recordings beside the project in which an effect is hidden, scored by the script that comes with them."""

from __future__ import annotations

import json
import pathlib
import re
import shlex
import subprocess
import sys

import pytest
from command_line import program

SHARED = pathlib.Path(__file__).resolve().parents[3] / "shared/blind"

# Of 29 cases, two are clean, one is outside the catalogue. The 16 have sheets that are off and a zero in each of their
# recordings.
EXACT = {"dev": 29, "rough": 16}

# What is named must not depend on how fast this machine is: the command runs until it has searched all.
UNTIL_DONE = 600


@pytest.mark.skipif(not (SHARED / "score.py").exists(), reason="no ../shared/blind beside the project")
@pytest.mark.parametrize("cases", [pytest.param("dev", marks=pytest.mark.long), "rough"])
def test_score(cases):
    without_hurry = f'exec {shlex.quote(str(program()))} "$@" --time-limit {UNTIL_DONE}'
    command = [sys.executable, str(SHARED / "score.py"), "--cli", shlex.join(["sh", "-c", without_hurry, "sh"])]
    command += ["--cases", str(SHARED / cases), "--jobs", "2", "--limit", str(UNTIL_DONE)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=3000)
    print(done.stdout, done.stderr)
    if cases == "dev":
        assert "clean 2/2" in done.stdout
        assert "outside the catalogue 1/1" in done.stdout
    exact = int(re.search(r"^(\d+) passed, \d+ failed$", done.stdout, re.MULTILINE).group(1))
    assert exact == EXACT[cases]


CASES = sorted((SHARED / "dev").glob("dev-*"))


@pytest.mark.skipif(not CASES, reason="no ../shared/blind/dev beside the project")
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_recordings_made_by_others(case):
    """Another's MuJoCo rig with the same truth shows the same counts under the same commands: the conventions are the
    same, signs and sides included.

    Three seconds, past a kick where there is one; rounding alone is up to one count, differences of the engines' set-up
    may grow to a few.
    """
    pytest.importorskip("mujoco")
    import numpy as np
    from mujoco_effects import FOREIGN
    from mujoco_plant import Plant
    from mujoco_rig import TrueRig

    truth = json.loads((case / "truth.json").read_text())
    effects, wanted = truth["effects"], truth["true_rig"]
    if set(effects) & set(FOREIGN):
        pytest.skip("what is in no catalogue need not be the same")
    rig = TrueRig(name=case.name, **{key: value for key, value in wanted.items() if key != "dt"})
    run = next((round(p["run"]) for p in effects.values() if "run" in p), 0)
    seconds = 3 + max((p["time"] for p in effects.values() if "time" in p), default=0.0)
    (file,) = case.glob(f"run-{run}-*.csv")
    rows = np.genfromtxt(file, delimiter=",", names=True)[: round(seconds * rig.rate)]
    plant, shown = Plant(rig, effects, alpha=np.pi, run=run), []
    for u in rows["u"]:
        shown.append(plant.measure())
        plant.advance(u)
    counts = (np.array(shown) - np.c_[rows["theta"], rows["alpha"]]) * [rig.arm_counts, rig.pend_counts] / (2 * np.pi)
    print(case.name, list(effects), np.abs(counts).max(axis=0).round(), "counts")
    assert np.abs(counts).max() < 8.5
    assert np.sqrt(np.mean(counts**2)) < 1.5
