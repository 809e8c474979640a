"""To python-control and back."""

from __future__ import annotations

import subprocess
import sys

import furuta
import numpy as np
import pytest

control = pytest.importorskip("control")
RIG = furuta.Rig.load("qube-servo-2")


def test_importing_furuta_imports_neither_pandas_nor_control_nor_matplotlib():
    code = "import furuta, sys; print([m for m in ('pandas', 'control', 'matplotlib', 'scipy') if m in sys.modules])"
    assert (
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip() == "[]"
    )


def test_state_space_of_a_rig():
    system = RIG.to_ss()
    A, B = furuta.linearize(RIG)
    assert np.array_equal(system.A, A) and np.array_equal(system.B, B) and system.dt == 0
    assert system.state_labels == ["theta", "alpha", "theta_dot", "alpha_dot"]
    assert (system.input_labels, system.output_labels, system.name) == (["u"], ["theta", "alpha"], "qube-servo-2")
    sampled = RIG.to_ss(dt=0.002)
    theirs = control.c2d(system, 0.002)
    assert (
        sampled.dt == 0.002
        and np.allclose(sampled.A, theirs.A, rtol=1e-10)
        and np.allclose(sampled.B, theirs.B, rtol=1e-9)
    )
    hanging = RIG.to_ss([0, np.pi, 0, 0])
    assert (hanging.poles().real < 1e-6).all()
    assert np.array_equal(furuta.lqr(system, np.eye(4), 1)[0], furuta.lqr(RIG, np.eye(4), 1)[0])


@pytest.mark.parametrize("output", ["alpha", "theta"])
def test_transfer_function_of_a_rig(output):
    function = RIG.to_tf(output)
    system = RIG.to_ss([0, np.pi, 0, 0])
    s = 2j * np.pi * 3.0
    row = ["theta", "alpha"].index(output)
    assert function(s) == pytest.approx(system(s)[row, 0], rel=1e-6)
    with pytest.raises(ValueError, match="none of"):
        RIG.to_tf("u")


def test_responses_there_and_back():
    f = np.geomspace(0.3, 10, 60)
    function = control.tf([1, 4], [1, 2, 30])
    measured = furuta.Frf.from_control(function, f)
    assert np.allclose(measured.response, function(2j * np.pi * f), rtol=1e-12) and measured.sample_period == 0
    data = measured.to_control()
    again = furuta.Frf.from_control(data)
    assert np.allclose(again.frequency, f, rtol=1e-12) and np.allclose(again.response, measured.response, rtol=1e-12)
    fit = furuta.fit_transfer_function(measured, 1, 2)
    back = fit.to_control()
    assert np.allclose(back.num[0][0], [1, 4], rtol=1e-6) and np.allclose(back.den[0][0], [1, 2, 30], rtol=1e-6)
    sampled = furuta.Frf.from_control(control.c2d(function, 0.01), f)
    assert sampled.sample_period == 0.01
    with pytest.raises(furuta.IdentificationError, match="frequency must be given"):
        furuta.Frf.from_control(function)
    with pytest.raises(furuta.IdentificationError, match="2 pairs"):
        furuta.Frf.from_control(RIG.to_ss(), f)


def test_a_measured_response_there_and_back():
    """A recording is sampled: python-control refuses to evaluate such data on the unit circle."""
    u = furuta.signal("prbs", 20.0, 0.002, amplitude=0.5)
    x = furuta.simulate(RIG, [0, np.pi, 0, 0], u[:-1], 0.002)
    data = {"t": 0.002 * np.arange(len(u)), "u": u, "theta": x[:, 0], "alpha": x[:, 1]}
    measured = furuta.frf(data)
    assert len(measured.frequency) > 10
    again = furuta.Frf.from_control(measured.to_control())
    assert again.sample_period == measured.sample_period == pytest.approx(0.002)
    assert np.allclose(again.frequency, measured.frequency) and np.allclose(again.response, measured.response)
    few = measured.frequency[:2]
    assert np.allclose(furuta.Frf.from_control(measured.to_control(), few).response, measured.response[:2])


def test_comparisons_take_functions():
    rig = furuta.Rig.load("fong2014-emecs")
    function = rig.with_effect("arm.spring", stiffness=0.01, rest=0.0)
    A, B = furuta.linearize(function, [0, np.pi, 0, 0], effects=True)
    tf = control.ss2tf(A, B, [[0, 1, 0, 0]], [[0]])
    pair = furuta.compare((tf.num[0][0], tf.den[0][0]), rig)
    ours = furuta.compare(tf, rig)
    assert ours.as_given_error == pair.as_given_error
    assert ours.explanations[0]["effects"] == pair.explanations[0]["effects"]
    with pytest.raises(furuta.IdentificationError, match="measured must be an Frf"):
        furuta.compare(3, rig)


def test_orders_of_arguments_and_results_are_theirs():
    A, B = furuta.linearize(RIG)
    Q, R = np.diag([5, 1, 0.1, 0.1]), np.array([[0.1]])
    C, QN, RN = np.eye(2, 4), np.array([[1.0]]), 1e-4 * np.eye(2)
    # (function, arguments, which of the results are poles)
    for name, arguments, poles in [("lqr", (A, B, Q, R), 2), ("care", (A, B, Q, R), 1), ("lqe", (A, B, C, QN, RN), 2)]:
        ours, theirs = getattr(furuta, name)(*arguments), getattr(control, name)(*arguments)
        assert len(ours) == len(theirs) == 3
        for i, (mine, other) in enumerate(zip(ours, theirs)):
            mine, other = (
                (np.sort_complex(np.ravel(v)) for v in (mine, other)) if i == poles else (mine, np.asarray(other))
            )
            assert np.allclose(mine, other, rtol=1e-5, atol=1e-8 * np.abs(other).max()), (name, i)
