"""examples/one_cable.py: what it computes itself, and a table that it has the program fill."""

from __future__ import annotations

import json
import sys

import pytest
from command_line import ROOT, program

sys.path.insert(0, str(ROOT / "examples"))

import one_cable  # noqa: E402

VALUES = {"stiffness": 1.4e-3, "asymmetry": -8e-4, "cubic": 3e-4, "rest": -0.5}
LAW = {"parameters": {f"arm.cable.{name}": {"fitted": value} for name, value in VALUES.items()}}


def pull(theta):
    e = theta - VALUES["rest"]
    return VALUES["stiffness"] * e + VALUES["asymmetry"] * e**2 + VALUES["cubic"] * e**3


def test_a_chord_of_the_torque():
    low, high = -1.1, 0.8
    assert one_cable.chord(LAW, low, high) == pytest.approx((pull(high) - pull(low)) / (high - low), rel=1e-12)
    assert one_cable.chord(LAW, -0.5, -0.5) == pytest.approx(VALUES["stiffness"])


def test_every_experiment_is_there():
    assert all(file.exists() for files in one_cable.EXPERIMENTS.values() for file in files)
    low, high = one_cable.motion(one_cable.chirps(1), "9..10")
    assert low < -1.3 and high > 0.7


def test_an_answer_is_asked_for_once(tmp_path):
    asked = tmp_path / "asked.py"
    asked.write_text(
        "import json, sys, pathlib\n"
        "with open(pathlib.Path(__file__).with_suffix('.log'), 'a') as log: print(sys.argv[1:], file=log)\n"
        "print(json.dumps({'a': 1}))"
    )
    of = one_cable.Program(f"{sys.executable} {asked}", tmp_path / "out")
    assert of.ask("x", "diagnose", 1) == of.ask("x", "diagnose", 1) == {"a": 1}
    assert asked.with_suffix(".log").read_text() == "['diagnose', '1', '--json']\n"
    wrong = one_cable.Program(f"{sys.executable} -c 'raise SystemExit(3)'", tmp_path / "out")
    with pytest.raises(SystemExit, match="y: "):
        wrong.ask("y")


def test_a_spring_for_a_swing_up(tmp_path, monkeypatch, capsys):
    """A spring in the place of the cable is about as stiff as the cable's law says for the same angles."""
    monkeypatch.setattr(
        one_cable, "EXPERIMENTS", {"chirps, first": one_cable.chirps(1), "both swing-ups": one_cable.SWING_UPS}
    )
    of = one_cable.Program(str(program()), tmp_path)
    laws = one_cable.one_law(of)
    ((_, swing, stiffness, low, high, expected),) = one_cable.by_amplitude(
        of, laws["chirps, first"], [("both swing-ups", "0..5")]
    )
    assert 1.5 < swing < 1.8 and low < stiffness < high
    assert stiffness == pytest.approx(expected, rel=0.25)
    assert "| both swing-ups | 0..5 |" in capsys.readouterr().out
    assert json.loads((tmp_path / "law chirps, first.json").read_text())["chi"] > 3
