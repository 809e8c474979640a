"""The controllers `scheduled_lqr` and `pid` from Python: SciPy's gains at speed, textbook commands."""

import furuta
import numpy as np
import pytest
from scipy.linalg import solve_discrete_are
from scipy.signal import cont2discrete

H = 0.002


@pytest.mark.parametrize("name", furuta.Rig.VOLTAGE)
def test_the_scheduled_command_is_that_of_scipys_gain(name):
    rig, speed = furuta.Rig.load(name), 6.0
    limit = rig.parameters["motor.command_limit"]
    q, r = np.diag([1 / 16, 4.0, 0, 0]), np.array([[1 / limit**2]])
    a, b = furuta.linearize(rig, [0.0, 0.0, speed, 0.0])
    a, b, *_ = cont2discrete((a, b, np.eye(4), np.zeros((4, 1))), H)
    s = solve_discrete_are(a, b, q, r)
    k = np.linalg.solve(r + b.T @ s @ b, b.T @ s @ a)[0]
    text = f'[controller]\nkind = "scheduled_lqr"\nq = [0.0625, 4.0, 0.0, 0.0]\nr = {float(r[0, 0])!r}\nfastest = 6.0\n'
    control = furuta.Controller.from_toml(text, rig, H)
    reference = np.array([0.0, 0.0, speed, 0.0])
    steady = control.update(reference, reference)
    off = np.array([0.01, 0.002, 0.0, -0.01])
    assert control.update(reference + off, reference) - steady == pytest.approx(-k @ off, rel=1e-6)
    # At rest it is the LQR of the same weights.
    fixed = furuta.Controller.from_toml(text.replace("scheduled_lqr", "lqr").replace("fastest = 6.0\n", ""), rig, H)
    assert control.update(off) == fixed.update(off)


def test_the_pid_pair_is_the_textbooks():
    """Åström and Hägglund's algorithm written out again, back-calculation included."""
    rig = furuta.Rig.load("qube-servo-2")
    text = (
        '[controller]\nkind = "pid"\npendulum = [30.0, 5.0, 2.5]\narm = [-0.05, -0.02, -0.04]\n'
        "filter = 80.0\ntracking = 0.3\n"
    )
    control = furuta.Controller.from_toml(text, rig, H)
    limit, share = control.command_limit, 1 - np.exp(-80.0 * H)
    arm = pendulum = 0.0
    before = rates = None
    limited = 0
    for k in range(600):
        x = np.array([0.5 * np.sin(0.02 * k), 0.25 * np.sin(0.05 * k), 0.1, -0.2])
        target = 0.3 if k < 300 else -0.3
        if before is None:
            rates = x[2:].copy()
        else:
            rates = rates + share * ((x[:2] - before) / H - rates)
        before = x[:2].copy()
        error = target - x[0]
        lean = -0.05 * error + arm - 0.04 * -rates[0]
        wanted = 30.0 * (lean - x[1]) + pendulum - 2.5 * rates[1]
        u = np.clip(wanted, -limit, limit)
        limited += u != wanted
        arm += -0.02 * error * H + (u - wanted) * H / 0.3 / 30.0
        pendulum += 5.0 * (lean - x[1]) * H + (u - wanted) * H / 0.3
        assert control.update(x, [target, 0, 0, 0]) == pytest.approx(u, rel=1e-9, abs=1e-9)
    assert 10 < limited < 500


def test_what_a_pid_refuses():
    with pytest.raises(furuta.ControllerError, match="give both pendulum and arm"):
        furuta.Controller.from_toml('[controller]\nkind = "pid"\narm = [-0.05, 0.0, -0.04]\n', "qube-servo-2", H)
