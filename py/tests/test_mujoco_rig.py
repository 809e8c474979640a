"""The MuJoCo rig against equations derived from the energies: before it may judge furuta, it is judged itself."""

from __future__ import annotations

import dataclasses
import json

import lagrange
import numpy as np
import pytest

pytest.importorskip("mujoco")

from mujoco_case import write_case  # noqa: E402
from mujoco_rig import EFFECTS, FAMILIES, FOREIGN, STEP, Plant, draw_effect, rig_toml  # noqa: E402

RIG = FAMILIES["bench-made"]


def constants(rig):
    return {"J": rig.arm_inertia, "m": rig.pend_mass, "L": rig.arm_length, "c": rig.pend_com, "I": rig.pend_inertia, "It": rig.pend_inertia, "Ia": 0.0, "g": rig.g}


def commands(samples, seed=3, scale=0.4):
    return RIG.vmax * scale * np.repeat(np.random.default_rng(seed).uniform(-1, 1, samples // 40), 40)


def torque_of(rig, effects, u):
    """The same effects written as torques on the equations: volts(t) arrive, drags oppose."""
    p = lambda effect, name: effects.get(effect, {}).get(name, 0.0)  # noqa: E731
    held = lambda t: u[min(int(np.floor(t * rig.rate + 1e-9)), len(u) - 1)] if t >= -1e-12 else 0.0  # noqa: E731

    def torque(t, x):
        theta, alpha, theta_dot, alpha_dot = x
        volts = held(t - p("motor.delay", "delay"))
        width = p("motor.deadzone", "width")
        volts = np.sign(volts) * max(abs(volts) - width, 0.0) + p("motor.bias", "voltage")
        arm = rig.torque_per_volt * volts - rig.arm_damping * theta_dot
        arm -= p("arm.spring", "stiffness") * (theta - p("arm.spring", "rest"))
        arm -= p("arm.quadratic", "coefficient") * abs(theta_dot) * theta_dot
        pendulum = -rig.pend_viscous * alpha_dot - p("pendulum.quadratic", "coefficient") * abs(alpha_dot) * alpha_dot
        # smoothed Coulomb friction: full torque from a hundredth of a degree per second on
        arm -= p("arm.coulomb", "torque") * np.tanh(theta_dot / 2e-4)
        pendulum -= p("pendulum.coulomb", "torque") * np.tanh(alpha_dot / 2e-4)
        return arm, pendulum

    return torque


def mujoco_states(rig, effects, u, x0):
    plant = Plant(rig, effects, alpha=x0[1], theta=x0[0])
    plant.data.qvel[:] = x0[2:]
    states = [plant.state]
    for volts in u:
        plant.advance(volts)
        states.append(plant.state)
    return np.array(states), plant


# Largest difference of angles over one second, rad; an encoder count is 1.5e-3. Drag is held for a step of 1e-4 s at a time; friction is a
# constraint of 0.1 ms there and a smoothed sign here. Falling from upright multiplies every difference, hence the factor below.
CASES = {
    "nothing": 1e-6,
    "arm.spring": 1e-6,
    "motor.deadzone": 1e-6,
    "motor.bias": 1e-6,
    "motor.delay": 1e-5,
    "arm.quadratic": 1e-6,
    "pendulum.quadratic": 1e-6,
    "arm.coulomb": 5e-4,
    "pendulum.coulomb": 5e-4,
}


@pytest.mark.parametrize("effect", CASES)
@pytest.mark.parametrize("start", ([0.1, np.pi - 0.4, 1.0, -2.0], [0.0, 0.05, 0.0, 0.0]), ids=("hanging", "falling"))
def test_motion_follows_the_energies(effect, start):
    effects = {} if effect == "nothing" else {effect: draw_effect(effect, RIG, np.random.default_rng(5))}
    if effect == "motor.delay":
        effects[effect]["delay"] = 0.00125  # whole substeps, half a sample: an edge within each sample
    u = commands(400)
    steps = 2 if effect == "motor.delay" else 1  # restart the integrator where the late command jumps
    times = np.arange(400 * steps + 1) / (RIG.rate * steps)
    stiff = {"method": "LSODA", "rtol": 1e-8, "atol": 1e-10} if "coulomb" in effect else {}
    expected = lagrange.integrate(constants(RIG), torque_of(RIG, effects, u), start, times, **stiff)[::steps]
    got, _ = mujoco_states(RIG, effects, u, np.array(start))
    difference = np.abs(got - expected)[:, :2].max()
    print(effect, difference)
    assert difference < CASES[effect] * (4 if start[1] < 1 else 1)


def test_lag_and_offset():
    """A held command through a lag: the arm alone (no gravity on it) obeys a linear equation with a closed-form answer."""
    rig = dataclasses.replace(RIG, pend_mass=1e-8, pend_inertia=1e-11, pend_viscous=0.0)
    lag, volts, seconds = 0.02, 3.0, 0.5
    plant = Plant(rig, {"motor.lag": {"time_constant": lag}, "sensor.alpha.offset": {"angle": 0.04}}, alpha=np.pi)
    for _ in range(round(seconds * rig.rate)):
        plant.advance(volts)
    rate, final = rig.arm_damping / rig.arm_inertia, rig.torque_per_volt * volts / rig.arm_damping
    fast = 1 / lag
    speed = final * (1 - (fast * np.exp(-rate * seconds) - rate * np.exp(-fast * seconds)) / (fast - rate))
    assert plant.state[2] == pytest.approx(speed, rel=1e-6)
    assert plant.measure()[1] - plant.state[1] == pytest.approx(0.04, abs=np.pi / rig.pend_counts)


def test_friction_stops_and_holds():
    """Coulomb friction alone: speed falls on a straight line, ends at zero, and less torque than it holds moves nothing."""
    rig = dataclasses.replace(RIG, pend_mass=1e-8, pend_inertia=1e-11, pend_viscous=0.0, arm_viscous=0.0, kb=0.0)
    friction, speed = 0.01, 2.0
    plant = Plant(rig, {"arm.coulomb": {"torque": friction}}, alpha=np.pi)
    plant.data.qvel[0] = speed
    stop = speed * rig.arm_inertia / friction
    for _ in range(round(2 * stop * rig.rate)):
        plant.advance(0.0)
    assert plant.state[0] == pytest.approx(0.5 * speed * stop, rel=2e-3)
    before = plant.state[0]
    for _ in range(200):
        plant.advance(0.9 * friction / rig.torque_per_volt)
    assert abs(plant.state[0] - before) < 2e-4


def test_case_folder(tmp_path):
    write_case(tmp_path, RIG, {"motor.bias": {"voltage": 0.8}}, seed=2, spread=0.03, seconds=2.0)
    truth = json.loads((tmp_path / "truth.json").read_text())
    assert truth["effects"] == {"motor.bias": {"voltage": 0.8}}
    for run, (complete, rows) in truth["runs"].items():
        (file,) = tmp_path.glob(f"run-*-{run}.csv")
        data = np.genfromtxt(file, delimiter=",", names=True)
        assert complete and len(data) == rows == 800
        assert data.dtype.names == ("t", "u", "theta", "alpha")
        counts = data["alpha"] * RIG.pend_counts / (2 * np.pi)
        assert np.abs(counts - np.round(counts)).max() < 1e-3
        assert np.abs(data["u"]).max() <= RIG.vmax
    assert (tmp_path / "rig.toml").read_text() != rig_toml(RIG)  # the sheet is wrong, as sheets are


@pytest.mark.parametrize("effect", FOREIGN)
def test_foreign_effects_change_the_motion(effect):
    u, x0 = commands(400), np.array([0.0, np.pi, 0.0, 0.0])
    with_effect, _ = mujoco_states(RIG, {effect: draw_effect(effect, RIG, np.random.default_rng(1))}, u, x0)
    without, _ = mujoco_states(RIG, {}, u, x0)
    assert np.abs(with_effect - without)[:, :2].max() > 10 * 2 * np.pi / RIG.pend_counts


def test_every_effect_has_a_size():
    for rig in FAMILIES.values():
        for effect in EFFECTS + FOREIGN:
            assert all(np.isfinite(v) for v in draw_effect(effect, rig, np.random.default_rng(0)).values())
