"""What a newcomer met on the first walk through the package, one test each."""

from __future__ import annotations

import os
import pathlib
import re
import subprocess
import sys

import control
import furuta
import numpy as np
import pytest

RIG = furuta.Rig.load("qube-servo-2")
A, B = furuta.linearize(RIG)
Q, R = np.diag([5, 1, 0.1, 0.1]), [[0.1]]
C = [[1, 0, 0, 0], [0, 1, 0, 0]]
NOISE = {"QN": [[1.0]], "RN": np.eye(2) * 1e-6}


def test_documented_keywords_are_the_arguments_names():
    for design in (furuta.lqr, furuta.care):
        assert all(np.array_equal(a, b) for a, b in zip(design(A, B, Q=Q, R=R), design(A=A, B=B, Q=Q, R=R)))
    ad, bd = furuta.zero_order_hold(A=A, B=B, dt=0.002)
    for design in (furuta.dlqr, furuta.dare):
        assert all(np.array_equal(a, b) for a, b in zip(design(ad, bd, Q, R), design(A=ad, B=bd, Q=Q, R=R)))
    assert furuta.lqr(A, B, Q=Q, R=R, N=np.zeros((4, 1)))[0].shape == (1, 4)
    assert furuta.lqi(A=A, B=B, C=[[1, 0, 0, 0]], Q=np.eye(5), R=R)[0].shape == (1, 5)
    assert furuta.lqe(A=A, G=B, C=C, **NOISE)[0].shape == (4, 2)
    assert furuta.dlqe(A=ad, G=bd, C=C, **NOISE)[0].shape == (4, 2)
    assert furuta.place(A=A, B=B, p=[-1, -2, -3, -4]).shape == (1, 4)
    assert furuta.controllability(A=A, B=B)[1] == 4


def test_numbers_and_vectors_stand_for_matrices_as_in_python_control():
    control = pytest.importorskip("control")
    for r, b in [(0.1, B), ([0.1], B), ([[0.1]], B[:, 0]), (np.float64(0.1), B.ravel().tolist())]:
        ours = furuta.lqr(A, b, Q, r)
        theirs = control.lqr(A, np.asarray(b).reshape(4, 1), Q, r)
        for mine, other in zip(ours, theirs):
            assert np.allclose(np.sort_complex(np.ravel(mine)), np.sort_complex(np.ravel(other)), rtol=1e-6)
    one = furuta.lqe(A, B, [0, 1, 0, 0] @ np.eye(4) + [1, 0, 0, 0], 1.0, 1e-6)
    assert one[0].shape == (4, 1)


@pytest.mark.parametrize("given", ["rig", "name", "python-control", "keywords", "mixed"])
def test_a_system_stands_for_its_matrices(given):
    control = pytest.importorskip("control")
    system = control.ss(A, B, np.eye(2, 4), 0)
    got = {
        "rig": lambda: furuta.lqr(RIG, Q, R),
        "name": lambda: furuta.lqr("qube-servo-2", Q, R),
        "python-control": lambda: furuta.lqr(system, Q, R),
        "keywords": lambda: furuta.lqr(system, Q=Q, R=R),
        "mixed": lambda: furuta.lqr(system, Q, R=R),
    }[given]()
    assert all(np.array_equal(mine, other) for mine, other in zip(got, furuta.lqr(A, B, Q, R)))


def test_systems_for_estimators_and_sampled_ones():
    control = pytest.importorskip("control")
    ad, bd = furuta.zero_order_hold(A, B, 0.002)
    system, sampled = control.ss(A, B, C, 0), control.ss(ad, bd, C, 0, 0.002)
    qn, rn = NOISE["QN"], NOISE["RN"]
    expected = furuta.lqe(A, B, C, qn, rn)
    for got in (furuta.lqe(system, qn, rn), furuta.lqe(RIG, qn, RN=rn), furuta.lqe(system, QN=qn, RN=rn)):
        assert all(np.array_equal(mine, other) for mine, other in zip(got, expected))
    assert np.array_equal(furuta.dlqr(sampled, Q, R)[0], furuta.dlqr(ad, bd, Q, R)[0])
    assert np.array_equal(furuta.dlqe(sampled, qn, rn)[0], furuta.dlqe(ad, bd, C, qn, rn)[0])
    with pytest.raises(furuta.DesignError, match="use dlqr"):
        furuta.lqr(sampled, Q, R)
    with pytest.raises(furuta.DesignError, match="use lqr"):
        furuta.dlqr(system, Q, R)
    with pytest.raises(furuta.DesignError, match="a rig's model is continuous"):
        furuta.dlqr(RIG, Q, R)
    with pytest.raises(furuta.DesignError, match="at most 3 arguments after a system"):
        furuta.lqr(RIG, Q, R, np.zeros((4, 1)), 1)


@pytest.mark.parametrize(
    "call, says",
    [
        (
            lambda: furuta.lqr(A, B, [5, 1, 0.1, 0.1], R),
            r"Q has shape \(4,\); a square matrix is expected: np.diag\(Q\)",
        ),
        (lambda: furuta.lqr(A, B, Q, np.eye(2)), r"R has shape \(2, 2\); it must be \(1, 1\)"),
        (lambda: furuta.lqr(A, B, Q), "lqr needs R, which was not given"),
        (lambda: furuta.lqr(control.tf(1, [1, 0, -2]), np.eye(2), 1), r"lqr needs the states .* give control.ss\(system\)"),
        (lambda: furuta.lqr(A, B, Q, "one"), "R must be an array of numbers; a str was given"),
        (lambda: furuta.place(A, B, 3.0), r"p is a single number; it must be an array of shape \(n,\)"),
        (lambda: furuta.simulate(RIG, [0, 1, 2], [0.0], 0.002), r"x0 has shape \(3,\); it must be \(4,\), a state"),
        (lambda: furuta.simulate(RIG, [0, 0, 0, 0], 0.5, 0.002), "u is a single number; it must be an array"),
        (
            lambda: furuta.simulate(RIG, [0, 0, 0, 0], np.zeros((3, 2)), 0.002),
            r"u has shape \(3, 2\); it must be \(n,\)",
        ),
        (lambda: furuta.measure(RIG, np.zeros((4, 3))), r"x has shape \(4, 3\); it must be \(n, 4\)"),
    ],
)
def test_shapes_are_named_expected_and_given(call, says):
    with pytest.raises(furuta.FurutaError, match=says):
        call()


def test_a_row_or_a_column_is_a_command():
    u = np.linspace(0, 1, 5)
    flat = furuta.simulate(RIG, [0, 3, 0, 0], u, 0.002)
    for given in (u[None, :], u[:, None]):
        assert np.array_equal(furuta.simulate(RIG, [0, 3, 0, 0], given, 0.002), flat)


def swing():
    t = 0.002 * np.arange(3000)
    u = 3 * np.sin(2 * t * (1 + t))
    x = furuta.simulate(RIG, [0, np.pi, 0, 0], u[:-1], 0.002)
    theta, alpha = furuta.measure(RIG, x).T
    return {"t": t, "u": u, "theta": theta, "alpha": alpha}


def test_one_string_is_a_list_of_one_and_a_name_is_a_rig(tmp_path):
    assert furuta.calibrate(swing(), "qube-servo-2", free="arm.inertia").fitted == ["arm.inertia"]
    held = furuta.calibrate(swing(), RIG, fix="arm.inertia").fitted
    assert held and "arm.inertia" not in held
    assert furuta.calibrate(swing(), RIG, hold=["arm.inertia"]).fitted == held  # its older name
    RIG.save(tmp_path / "rig.toml")
    for rig in ("qube-servo-2", tmp_path / "rig.toml", str(tmp_path / "rig.toml")):
        assert np.array_equal(furuta.linearize(rig)[0], A)
    with pytest.raises(
        TypeError, match="a furuta.Rig, the name of a built-in rig .* expected, a int was given\nwhile processing 'rig'"
    ):
        furuta.linearize(3)
    with pytest.raises(furuta.RigError, match="qube-servo-9"):
        furuta.linearize("qube-servo-9")
    with pytest.raises(TypeError, match="a list of str .* expected, a list was given\nwhile processing 'free'"):
        furuta.calibrate(swing(), RIG, free=[1])


def test_estimators_names_in_small_letters():
    data = swing()
    assert np.array_equal(furuta.frf(data, estimator="h1").response, furuta.frf(data, estimator="H1").response)
    with pytest.raises(furuta.IdentificationError, match='"H3" is none of "local", "H1", "H2"'):
        furuta.frf(data, estimator="H3")


def test_an_effect_alone_has_its_typical_size():
    assert RIG.with_effect("arm.coulomb")["arm.coulomb.torque"] == pytest.approx(0.0025, rel=0.1)
    with pytest.raises(furuta.RigError, match="rest"):
        RIG.with_effect("arm.spring", stiffness=1e-3)


def test_signals_have_the_command_lines_words():
    u = furuta.signal("chirp", 10, 0.001, band=(0, 8))
    assert np.array_equal(u, furuta.signal("chirp", 10, 0.001))
    crossings = np.flatnonzero(np.diff(np.sign(u)))
    assert np.diff(crossings)[:10].mean() < 0.2 * np.diff(crossings)[-3:].mean()  # the frequency falls
    assert np.array_equal(u, furuta.signal("chirp", 10, 0.001, f0=8, f1=0))
    pairs = [
        ("multisine", {"amplitude": 2, "band": (0.5, 5)}, {"rms": 2, "low": 0.5, "high": 5}),
        ("noise", {"amplitude": 2, "band": (0.5, 5)}, {"rms": 2, "low": 0.5, "high": 5}),
        ("prbs", {"hold": 0.1}, {"clock": 0.1}),
        ("ramp", {"amplitude": 3}, {"end": 3}),
        ("step", {"fade": 1}, {"fade_in": 1, "fade_out": 1}),
    ]
    for kind, words, older in pairs:
        assert np.array_equal(furuta.signal(kind, 10, 0.01, **words), furuta.signal(kind, 10, 0.01, **older)), kind
    for kind, both in [
        ("chirp", {"band": (0, 1), "f0": 1}),
        ("noise", {"band": (0, 1), "low": 1}),
        ("noise", {"rms": 1, "amplitude": 1}),
    ]:
        with pytest.raises(furuta.SignalError, match="give one of them"):
            furuta.signal(kind, 10, 0.01, **both)
    with pytest.raises(furuta.SignalError, match="band = .* is not \\(low, high\\)"):
        furuta.signal("noise", 10, 0.01, band=(5, 1))


def test_rows_of_arrays_are_indices():
    data = swing()
    data["theta"] = data["theta"].copy()
    data["theta"][17] = np.nan
    with pytest.raises(furuta.RecordingError, match=re.escape("recording-0: row 17, column theta: the value is NaN")):
        furuta.diagnose(data, RIG)
    data = swing()
    data["t"] = data["t"].copy()
    data["t"][20] = data["t"][18]
    with pytest.raises(furuta.RecordingError, match="row 20, column t: time goes backwards"):
        furuta.diagnose(data, RIG)


def test_sentences_about_recordings_name_them_once():
    data = swing()
    data["alpha"] = np.degrees(data["alpha"])
    with pytest.raises(furuta.RecordingError) as raised:
        furuta.validate(data, RIG)
    assert str(raised.value).count("recording-0") == 1
    odd = swing()
    odd["alpha"] = odd["alpha"] - np.pi
    found = furuta.validate([swing(), odd], RIG)
    for notice in found.notices:
        assert notice.count("recording-1") <= 1, notice


def test_rigs_parameters_by_key_files_and_dicts(tmp_path):
    assert RIG["arm.length"] == RIG.parameters["arm.length"]
    sprung = RIG.with_effect("arm.spring", stiffness=1e-3, rest=0.1)
    assert sprung["arm.spring"] == {"stiffness": 1e-3, "rest": 0.1}
    assert sprung["arm.spring.rest"] == 0.1
    assert "arm.spring" in sprung and "arm.spring" not in RIG
    with pytest.raises(KeyError, match="arm.lenght: a rig has .*arm.length"):
        RIG["arm.lenght"]
    sprung.save(tmp_path / "sprung.toml")
    assert furuta.Rig.load(tmp_path / "sprung.toml") == sprung
    with pytest.raises(FileExistsError, match="force=True"):
        RIG.save(tmp_path / "sprung.toml")
    RIG.save(tmp_path / "sprung.toml", force=True)
    assert furuta.Rig.load(tmp_path / "sprung.toml") == RIG
    told = sprung.to_dict()
    assert (
        told["name"] == "qube-servo-2" and told["effects"] == sprung.effects and told["parameters"] == sprung.parameters
    )


def test_a_controller_from_a_gain(tmp_path):
    K, _, _ = furuta.lqr(RIG, Q, 0.1)
    balance = furuta.Controller.lqr(K, RIG, dt=0.001)
    assert np.array_equal(balance.gain, K[0]) and balance.rig == RIG and balance.dt == 0.001
    assert balance.update([0, 0.01, 0, 0]) == pytest.approx(-K[0, 1] * 0.01)
    balance.save(tmp_path / "balance.toml")
    assert furuta.Controller.from_file(tmp_path / "balance.toml", RIG, 0.001) == balance
    with pytest.raises(furuta.ControllerError, match="K has 3 numbers"):
        furuta.Controller.lqr([1, 2, 3], RIG)


def test_the_package_carries_the_command():
    clean = {"PATH": "/nowhere"} | {name: value for name, value in os.environ.items() if name == "PYTHONPATH"}

    def run(*command):
        return subprocess.run(command, capture_output=True, text=True, env=clean, timeout=60)

    for command in ([sys.executable, "-m", "furuta"], [pathlib.Path(sys.executable).with_name("furuta")]):
        asked = run(*command, "--version")
        assert asked.returncode == 0 and asked.stdout == f"furuta {furuta.__version__}\n"
        assert "qube-servo-2" in run(*command, "rigs").stdout
        mistyped = run(*command, "rig")
        assert mistyped.returncode == 2 and "Usage: furuta" in mistyped.stderr
        failed = run(*command, "diagnose", "--rig", "qube-servo-2", "nothing.csv")
        assert failed.returncode == 1 and failed.stderr.startswith("furuta: nothing.csv")
