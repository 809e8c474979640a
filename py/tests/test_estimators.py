"""Estimators against SciPy's Riccati equation and a linear filter written here."""

import numpy as np
import pytest
import scipy.linalg

import furuta

DT = 0.002
RIGS = furuta.Rig.VOLTAGE


def linear_filter(a, b, gain, y, u):
    """The current-state Kalman filter of x+ = a x + b u, angles measured."""
    x = np.array([*y[0], 0, 0])
    states = [x]
    for k in range(1, len(u)):
        x = a @ x + b[:, 0] * u[k - 1]
        x = x + gain @ (y[k] - x[:2])
        states.append(x)
    return np.array(states)


@pytest.mark.parametrize("name", RIGS)
def test_kalman(name):
    rig = furuta.Rig.load(name)
    noise = {"command_noise": 0.1, "pendulum_noise": 2.0, "reading_noise": [1e-3, 2e-3]}
    a, b = furuta.zero_order_hold(*furuta.linearize(rig), DT)
    c = np.eye(2, 4)
    pushed = np.array([0, DT**2 / 2, 0, DT]) * noise["pendulum_noise"]
    process = b @ b.T * noise["command_noise"] ** 2 + np.outer(pushed, pushed)
    reading = np.diag(np.square(noise["reading_noise"]))
    p = scipy.linalg.solve_discrete_are(a.T, c.T, process, reading)
    gain = p @ c.T @ np.linalg.inv(c @ p @ c.T + reading)
    # So small that the pendulum's sine is its argument to eleven digits.
    rng = np.random.default_rng(1)
    y, u = 1e-6 * rng.standard_normal((300, 2)), 1e-4 * rng.standard_normal(300)
    expected = linear_filter(a, b, gain, y, u)
    ours = furuta.Estimator("kalman", rig, DT, **noise).filter(y[:, 0], y[:, 1], u)
    # Against the linear filter RK4 errs by the fifth power of a pole times dt.
    np.testing.assert_allclose(ours, expected, atol=2e-5 * np.abs(expected).max())


@pytest.mark.parametrize("kind", furuta.Estimator.KINDS)
def test_a_swing_is_followed(kind):
    rig = furuta.Rig.load("shahzad2022-srv02")
    u = np.sin(np.arange(1500) * 0.02)
    x, y = furuta.simulate(rig, [0, 2.0, 0, 0], u, DT, encoders=True)
    estimator = furuta.Estimator(kind, rig, DT)
    seen = estimator.filter(y[:-1, 0], y[:-1, 1], u)
    # The pendulum swings at up to 11 rad/s; the slowest, a derivative, lags by 9 ms.
    assert np.abs(seen[200:, 3] - x[200:-1, 3]).max() < 1.0
    # Sample by sample the same.
    one_by_one = [estimator.update(*y[k], u[k])[0] for k in range(50)]
    np.testing.assert_array_equal(one_by_one, seen[:50])
    estimator.start()
    np.testing.assert_array_equal(estimator.update(*y[0], u[0])[0], seen[0])


def test_the_voltage_beside_the_command():
    rig = furuta.Rig.load("qube-servo-2")
    u = np.where(np.arange(2000) % 400 < 200, 1.0, -1.0)
    biased = rig.with_effect("motor.bias", voltage=0.3)
    _, y = furuta.simulate(biased, [0, np.pi, 0, 0], u, DT, encoders=True)
    observer = furuta.Estimator("disturbance_observer", rig, DT)
    found = [observer.update(*row, v)[2] for row, v in zip(y[:-1], u, strict=True)]
    assert np.mean(found[-500:]) == pytest.approx(0.3, abs=0.02)


def test_what_cannot_be():
    rig = furuta.Rig.load("qube-servo-2")
    with pytest.raises(furuta.DesignError, match="kalman"):
        furuta.Estimator("oracle", rig, DT)
    with pytest.raises(furuta.DesignError, match="bandwidth"):
        furuta.Estimator("observer", rig, DT, bandwidth=-1)
    with pytest.raises(furuta.DesignError, match="rates"):
        furuta.Estimator("luenberger", rig, DT, rates=[1, 2])
    with pytest.raises(furuta.DesignError, match=r"0\.1 s"):
        furuta.Estimator("observer", rig, float("nan"))
    with pytest.raises(furuta.DesignError, match="alike"):
        furuta.Estimator("observer", rig, DT).filter([0, 0], [0, 0], [0])
    # What is no number gives no number, and is forgotten.
    seen = furuta.Estimator("ekf", rig, DT).filter([np.nan, 0.1, 0.1, 0.1], [0, 0.2, 0.2, 0.2], [0] * 4)
    assert np.isfinite(seen[-1]).all()
    for name in ("theta", "alpha", "held"):
        sample = {"theta": 0.0, "alpha": 0.0, "held": 0.0} | {name: np.nan}
        with pytest.raises(furuta.DesignError, match=f"{name} = NaN is not a finite number"):
            furuta.Estimator("ekf", rig, DT).update(**sample)
    with pytest.raises(furuta.DesignError, match="periods = 0"):
        furuta.Estimator("ekf", rig, DT).update(0, 0, 0, periods=0)
    with pytest.raises(furuta.ControllerError, match="held = NaN V"):
        furuta.Supervisor(rig).step(0.0, 0.0, 3.1, held=np.nan)
    with pytest.raises(furuta.DesignError, match=r"A\[0, 1\] = NaN"):
        furuta.zero_order_hold([[0, np.nan], [0, 0]], [[0], [1]], 0.1)
