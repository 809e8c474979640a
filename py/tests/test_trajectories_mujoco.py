"""The model's motion against MuJoCo's: every rig, every effect of the catalogue, by MuJoCo's own means where it has
them."""

from __future__ import annotations

import dataclasses

import furuta
import lagrange
import numpy as np
import pytest

pytest.importorskip("mujoco")

import lagrange_effects  # noqa: E402
from mujoco_effects import EFFECTS, RARE, Effects, hide  # noqa: E402
from mujoco_plant import STEP, Plant  # noqa: E402
from mujoco_rig import FAMILIES, TrueRig, rig_toml  # noqa: E402

# Largest difference of the angles over one second from the same state, rad; an encoder count is 1.5e-3 to 3e-3. The
# model takes four Runge-Kutta steps to a sample of 2 ms, MuJoCo twenty; where the torque is smooth within a sample they
# agree to 1e-8 and better, the points of two rigs being bodies of 1e-12 kg m2 in MuJoCo included.
SMOOTH = 5e-8
TOLERANCE = {
    # The plant holds applied torques and voltages for a step of 0.1 ms, and takes the mean over one where a command or
    # a kick begins.
    "motor.delay": 2e-6,
    "motor.lag": 2e-6,
    "arm.cogging": 2e-6,
    "motor.ripple": 2e-6,
    "arm.presliding": 2e-5,
    "arm.lugre": 2e-5,
    "disturbance.vibration": 2e-6,
    "disturbance.kick": 1e-5,
    "disturbance.arm_kick": 1e-5,
    # The model finds the moment of a stop; MuJoCo's dry friction is a constraint of 0.1 ms about it, and about twice as
    # much with static friction.
    "arm.coulomb": 1e-3,
    "arm.stribeck": 1.5e-3,
    "pendulum.coulomb": 5e-4,
    "arm.load_friction": 1e-3,
    "arm.angle_friction": 1.5e-3,
    "arm.fading_friction": 1e-3,
    # The current is held for a step, as a lagged voltage is.
    "motor.inductance": 2e-6,
    "arm.relaxation": 2e-6,
    # Kinks, at which the model's steps are not cut.
    "motor.current_limit": 2e-5,
    # The damper of MuJoCo's stop acts from the step after the contact on: five times as far at the usual step.
    "arm.stop": 1e-3,
    # MuJoCo's ends of the play bounce a little, and each bounce changes when the next one comes; a hundredth of the
    # play.
    "drive.backlash": 4e-3,
}

START = {"hanging": (0.1, np.pi - 0.5, 0.0, 0.0), "falling": (0.0, 0.05, 0.0, 0.0), "rest": (0.1, np.pi, 0.0, 0.0)}


def as_truth(rig: furuta.Rig) -> TrueRig:
    """The rig file's numbers under the plant's names."""
    p, s = rig.parameters, rig.sensors
    return TrueRig(
        rig.name, p["arm.length"], p["arm.inertia"], p["arm.viscous"], p["pendulum.mass"], p["pendulum.com"],
        p["pendulum.inertia"], p["pendulum.viscous"],
        p["motor.resistance"], p["motor.torque_constant"], p["motor.back_emf_constant"], p["motor.gear_ratio"],
        p["motor.efficiency"],
        p["motor.amplifier_gain"], p["motor.command_limit"], int(s["arm_counts_per_rev"]),
        int(s["pendulum_counts_per_rev"]), 500,
        p["environment.gravity"], p["pendulum.inertia_transverse"], p["pendulum.inertia_axial"],
    )  # fmt: skip


RIGS = FAMILIES | {name: as_truth(furuta.Rig.load(name)) for name in furuta.Rig.VOLTAGE}


def as_file(rig: TrueRig, effects: Effects) -> furuta.Rig:
    tables = (
        f'[effects."{id}"]\n' + "".join(f"{name} = {value!r}\n" for name, value in p.items())
        for id, p in effects.items()
    )
    return furuta.Rig.from_toml(rig_toml(rig) + "\n" + "\n".join(tables))


def commands(rig: TrueRig) -> np.ndarray:
    return rig.vmax * 0.5 * np.repeat(np.random.default_rng(3).uniform(-1, 1, 10), round(rig.rate / 10))


def engaged(plant: Plant) -> float:
    """Angle at which the rotor passes on what the arm needs at rest without a command: where the model has it begin."""
    values = lagrange_effects.constants(plant.rig, plant.effects)
    theta, alpha = plant.state[:2]
    torque = (
        -plant.drive["motor_share"]
        * plant.rig.arm_inertia
        * lagrange.accelerations(values, [theta, alpha, 0.0, 0.0], (0.0, 0.0))[0]
    )
    return theta + (
        np.sign(torque) * plant.drive["gap"] / 2 if "gap" in plant.drive else torque / plant.drive["stiffness"]
    )


def mujoco(rig: TrueRig, effects: Effects, start: tuple[float, ...], **how: float) -> tuple[np.ndarray, np.ndarray]:
    """MuJoCo's states, and what its encoders show."""
    plant = Plant(rig, effects, alpha=start[1], theta=start[0], **how)
    if plant.drive and start[1] != np.pi:
        plant.data.qpos[plant.motor] = engaged(plant)
    states, shown = [plant.state], [plant.measure()]
    for volts in commands(rig):
        plant.advance(volts)
        states.append(plant.state)
        shown.append(plant.measure())
    return np.array(states), np.array(shown)


def both(
    rig: TrueRig, effects: Effects, start: tuple[float, ...], **how: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """States of the model, of MuJoCo, and what MuJoCo's encoders show."""
    return furuta.simulate(as_file(rig, effects), start, commands(rig), 1 / rig.rate, substeps=4), *mujoco(
        rig, effects, start, **how
    )


def compare(name: str, effect: str, start: str) -> None:
    if effect != "nothing" and effect not in furuta.catalogue():
        pytest.skip(f"{effect} is not in the catalogue")
    if effect == "pendulum.inertia_transverse" and RIGS[name].pend_inertia == 0.0:
        pytest.skip("a point has no inertia")
    rig, effects = hide(RIGS[name], () if effect == "nothing" else (effect,), np.random.default_rng(8))
    if effect.endswith(("kick", "lost_counts")):
        effects[effect] |= {"run": 0.0, "time": 0.31234}
    file = as_file(rig, effects)
    x, expected, shown = both(rig, effects, START[start], step=STEP / 8 if effect == "arm.stop" else STEP)
    worst = np.abs(x - expected)[:, :2].max()
    print(f"{name} {effect} {start} {worst:.2e} rad")
    assert worst < TOLERANCE.get(effect, SMOOTH)
    if effect in ("sensor.alpha.offset", "sensor.alpha.scale", "sensor.theta.scale") or "eccentricity" in effect:
        count = 2 * np.pi / min(rig.arm_counts, rig.pend_counts)
        assert np.abs(furuta.measure(file, x) - shown).max() < 1.01 * count + worst
    if effect.endswith(("lost_counts", "jitter")):
        count = 2 * np.pi / min(rig.arm_counts, rig.pend_counts)
        _, read = furuta.simulate(file, START[start], commands(rig), 1 / rig.rate, substeps=4, encoders=True)
        assert np.abs(read - shown).max() < 1.01 * count + worst


@pytest.mark.parametrize("name", RIGS)
@pytest.mark.parametrize("effect", ["nothing", *EFFECTS, *RARE])
def test_hanging(effect, name):
    compare(name, effect, "hanging")


@pytest.mark.parametrize("name", RIGS)
@pytest.mark.parametrize("effect", ["nothing", "arm.tilt", "pendulum.inertia_transverse"])
def test_falling(effect, name):
    compare(name, effect, "falling")


@pytest.mark.parametrize("name", RIGS)
def test_without_any_damping(name):
    rig = dataclasses.replace(RIGS[name], arm_viscous=0.0, kb=0.0, pend_viscous=0.0)
    x, expected, _ = both(rig, {}, START["hanging"])
    worst = np.abs(x - expected)[:, :2].max()
    print(f"{name} without damping {worst:.2e} rad")
    assert worst < SMOOTH


@pytest.mark.parametrize("effect", ("drive.compliance", "drive.backlash"))
def test_a_hanging_pendulum_leaves_the_rotor_in_the_middle(effect):
    """Nothing to pass on: the play is free on both sides, the spring is not twisted."""
    if effect not in furuta.catalogue():
        pytest.skip(f"{effect} is not in the catalogue")
    compare("bench-made", effect, "rest")


SHAFT = ("arm.coulomb", "arm.stribeck", "arm.quadratic", "arm.presliding", "arm.cogging", "motor.ripple")


@pytest.mark.parametrize("drive", ("drive.compliance", "drive.backlash"))
@pytest.mark.parametrize("effect", SHAFT)
def test_what_belongs_to_the_motor_acts_on_the_rotor(effect, drive):
    """Two bodies: friction, drag, cogging and ripple turn with the rotor. From rest, where nothing twists the drive."""
    rig, effects = hide(RIGS["bench-made"], (drive, effect), np.random.default_rng(8))
    if effect == "arm.cogging":
        effects[effect]["phase"] = -effects[effect]["order"] * START["rest"][0]
    x, expected, _ = both(rig, effects, START["rest"])
    allowed = TOLERANCE.get(effect, SMOOTH) + TOLERANCE.get(drive, SMOOTH)
    # The model's play does not bounce, MuJoCo's does, and each blow makes a difference larger: there is an answer to
    # compare with as long as half the step and stops that hardly bounce change MuJoCo's own by less than half of what
    # is allowed.
    finer, _ = mujoco(rig, effects, START["rest"], step=STEP / 2, stop=3.0)
    moved = np.abs(finer - expected)[:, :2].max(axis=1) > allowed / 2
    end = int(moved.argmax()) if moved.any() else len(x)
    worst = np.abs(x - finer)[:end, :2].max()
    print(f"{drive} {effect} {worst:.2e} rad over {end / rig.rate} s")
    assert end > 0.25 * len(x)
    assert worst < allowed


def test_the_catalogue_holds_nothing_that_is_not_compared():
    of_voltage = {id for id, of in furuta.catalogue().items() if "voltage" in of["kinds"]}
    assert of_voltage <= set(EFFECTS + RARE)
