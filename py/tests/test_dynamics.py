"""The model against equations that SymPy derives from the energies and SciPy integrates."""

from __future__ import annotations

import furuta
import lagrange
import numpy as np
import pytest
from scipy.signal import cont2discrete


def reference(rig, x0, u, dt):
    per_volt, damping = lagrange.motor(rig.parameters)
    viscous = rig.parameters["pendulum.viscous"]

    def torque(t, x):
        k = min(int(np.floor(t / dt + 1e-9)), len(u) - 1)
        return per_volt * u[k] - damping * x[2], -viscous * x[3]

    return lagrange.integrate(lagrange.constants(rig.parameters), torque, x0, dt * np.arange(len(u) + 1))


ROD = furuta.Rig.load("qube-servo-2").with_parameters(
    {"pendulum.inertia_transverse": 2.1e-5, "pendulum.inertia_axial": 4e-6}
)
RIGS = [furuta.Rig.load(name) for name in furuta.Rig.VOLTAGE] + [ROD]


@pytest.mark.parametrize("rig", RIGS, ids=lambda rig: rig.name)
@pytest.mark.parametrize("start", ([0.3, 2.0, -1.0, 3.0], [0.0, 0.1, 0.0, 0.0]), ids=("hanging", "falling"))
def test_trajectory(rig, start):
    """Half a second, command changing every 20 ms. Fourth order at 1 ms leaves 1e-7 rad; at 0.25 ms, 256 times less."""
    u = 0.3 * rig.parameters["motor.command_limit"] * np.repeat(np.random.default_rng(1).uniform(-1, 1, 25), 20)
    expected = reference(rig, start, u, 1e-3)
    scale = 1 + np.abs(expected)
    assert (np.abs(furuta.simulate(rig, start, u, 1e-3) - expected) / scale).max() < 2e-6
    assert (np.abs(furuta.simulate(rig, start, u, 1e-3, substeps=4) - expected) / scale).max() < 1e-8


@pytest.mark.parametrize("rig", RIGS, ids=lambda rig: rig.name)
def test_jacobians(rig):
    """Central differences of the derived equations: 1e-6 relative is what a step of 1e-5 leaves."""
    per_volt, damping = lagrange.motor(rig.parameters)

    def rate(z):
        x, u = z[:4], z[4]
        torque = (per_volt * u - damping * x[2], -rig.parameters["pendulum.viscous"] * x[3])
        return np.concatenate([x[2:], lagrange.accelerations(lagrange.constants(rig.parameters), x, torque)])

    for point in ([0.0, 0.0, 0.0, 0.0, 0.0], [0.4, np.pi, 0.0, 0.0, 0.0], [-1.0, 0.7, 2.0, -3.0, 0.5]):
        step = 1e-5
        jacobian = np.array([(rate(point + step * e) - rate(point - step * e)) / (2 * step) for e in np.eye(5)]).T
        a, b = furuta.linearize(rig, point[:4], point[4])
        assert a.shape == (4, 4) and b.shape == (4, 1)
        np.testing.assert_allclose(np.hstack([a, b]), jacobian, rtol=1e-6, atol=1e-6 * np.abs(jacobian).max())


def test_effects_in_the_linear_model():
    rig = ROD.with_effect("arm.spring", stiffness=0.01, rest=0.0)
    assert furuta.linearize(rig, effects=False)[0][2, 0] == 0.0
    a, b = furuta.linearize(rig, effects=True)
    assert a[2, 0] < 0.0
    # What is named is used: the default is the model that designs are made for, and says what it does not hold.
    for default in (furuta.linearize(rig), furuta.linearize(rig, [0, 0, 0, 0])):
        np.testing.assert_array_equal(default[0], a)
        np.testing.assert_array_equal(default[1], b)
    rough = rig.with_effect("arm.coulomb", torque=1e-3).with_effect("motor.delay", delay=0.01)
    with pytest.warns(UserWarning) as said:
        a, b = furuta.linearize(rough)
    np.testing.assert_array_equal(a, furuta.linearize(rig)[0])
    assert [str(w.message).split(":")[0] for w in said] == ["arm.coulomb", "motor.delay"]
    with pytest.warns(UserWarning, match="motor.delay: left out|arm.coulomb: left out"):
        gain = furuta.lqr(rough, np.eye(4), 1)[0]
    np.testing.assert_array_equal(gain, furuta.lqr(a, b, np.eye(4), 1)[0])


def test_sampled_system():
    a, b = furuta.linearize(ROD)
    for dt in (1e-3, 0.02, 0.5):
        ad, bd = furuta.zero_order_hold(a, b, dt)
        expected = cont2discrete((a, b, np.eye(4), np.zeros((4, 1))), dt)
        np.testing.assert_allclose(ad, expected[0], rtol=1e-11, atol=1e-12 * np.abs(expected[0]).max())
        np.testing.assert_allclose(bd, expected[1], rtol=1e-11, atol=1e-12 * np.abs(expected[1]).max())


def test_what_the_encoders_show():
    x = furuta.simulate(ROD, [0, 3, 0, 0], np.full(100, 1.0), 0.002)
    counts = 2 * np.pi / np.array([ROD.sensors["arm_counts_per_rev"], ROD.sensors["pendulum_counts_per_rev"]])
    shown = furuta.measure(ROD, x)
    np.testing.assert_allclose(shown, np.round(x[:, :2] / counts) * counts, atol=1e-12)


def test_encoders_in_a_simulation():
    """What `measure` makes of the states, where it can; late, or from the motor's side of the play, where the states do
    not tell."""
    u = 3 * np.sin(0.1 * np.arange(300))
    scaled = ROD.with_effect("sensor.alpha.scale", scale=1.02)
    x, y = furuta.simulate(scaled, [0, 3, 0, 0], u, 0.002, encoders=True)
    np.testing.assert_array_equal(x, furuta.simulate(scaled, [0, 3, 0, 0], u, 0.002))
    np.testing.assert_array_equal(y, furuta.measure(scaled, x))

    late = ROD.with_effect("sensor.delay", delay=0.006)
    x, y = furuta.simulate(late, [0, 3, 0, 0], u, 0.002, encoders=True)
    np.testing.assert_array_equal(y[3:], furuta.measure(ROD, x[:-3]))
    x, y = furuta.simulate(late, [0, 3, 0, 0], u, 0.002, substeps=4, encoders=True)
    np.testing.assert_array_equal(y[3:], furuta.measure(ROD, x[:-3]))

    play = ROD.with_effect("drive.backlash", gap=0.4, motor_share=0.3, encoder="motor")
    x, y = furuta.simulate(play, [0, 3, 0, 0], u, 0.002, encoders=True)
    count = 2 * np.pi / ROD.sensors["arm_counts_per_rev"]
    assert abs(abs(y[:, 0] - x[:, 0]).max() - 0.2) < count

    for rig, effect in ((late, "sensor.delay"), (play, "drive.backlash")):
        with pytest.raises(furuta.SimulationError, match=rf"{effect}: .* encoders=True"):
            furuta.measure(rig, x)


def test_a_kick_belongs_to_one_run():
    kicked = ROD.with_effect("disturbance.kick", torque=0.01, time=0.101, duration=0.02, run=2)
    u, start = np.zeros(200), [0, np.pi, 0, 0]
    calm, hit = furuta.simulate(kicked, start, u, 0.002, run=1), furuta.simulate(kicked, start, u, 0.002, run=2)
    np.testing.assert_array_equal(calm, furuta.simulate(ROD, start, u, 0.002))
    np.testing.assert_array_equal(hit[:51], calm[:51])
    assert abs(hit[60:, 3]).max() > 0.1


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: furuta.simulate(ROD, [0, 0, 0], [1.0], 0.01), r"x0 has shape \(3,\); it must be \(4,\)"),
        (lambda: furuta.simulate(ROD, [0, np.nan, 0, 0], [1.0], 0.01), "not finite"),
        (lambda: furuta.simulate(ROD, [0, 0, 0, 0], [1.0, np.inf], 0.01), r"u\[1\]"),
        (lambda: furuta.simulate(ROD, [0, 0, 0, 0], [1.0], -0.01), "sample period"),
        (lambda: furuta.simulate(ROD, [0, 0, 0, 0], [1.0], 0.01, substeps=0), "substeps"),
        (
            lambda: furuta.simulate(ROD, [0, 1, 0, 1e9], np.ones(1000), 1.0),
            r"no longer finite at row \d+: use a shorter dt .*dt = 1 s",
        ),
        (
            lambda: furuta.simulate(ROD.with_effect("motor.delay", delay=0.5), [0, 1, 0, 0], [1.0], 1e-3),
            "a delay of 0.5 s is longer",
        ),
        (lambda: furuta.measure(ROD, [[0, 0]]), r"x has shape \(1, 2\); it must be \(n, 4\)"),
        (lambda: furuta.linearize(ROD, u=np.nan), "not a finite"),
    ],
)
def test_bad_input_is_named(call, message):
    with pytest.raises(furuta.SimulationError, match=message):
        call()


def test_other_threads_run_meanwhile():
    """The interpreter is released during a long simulation: another thread counts on."""
    import threading

    counted, stop = [0], threading.Event()

    def count():
        while not stop.is_set():
            counted[0] += 1

    thread = threading.Thread(target=count)
    thread.start()
    before = counted[0]
    furuta.simulate(ROD, [0, 3, 0, 0], np.zeros(100_000), 1e-3, substeps=4)
    during = counted[0] - before
    stop.set()
    thread.join()
    assert during > 1000
