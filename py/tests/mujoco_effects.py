"""The effects that can be hidden in the MuJoCo rig, with sizes one meets on a rig of its class.

Ids, parameter names and signs are those of the catalogue (``furuta.catalogue()``); the laws are written again in
``mujoco_plant.py`` and ``mujoco_torques.py`` and ``mujoco_friction.py``. What no catalogue has is in
``mujoco_foreign.py``. Conventions that a name does not tell:

- ``drive.*``: ``motor_share`` of the arm's inertia is the rotor's; ``gap`` is the total play, the rotor starts in its
  middle; ``encoder`` says whether theta is read on the ``arm`` or on the ``motor``. Motor, back-EMF, arm friction of
  every kind and cogging act on the rotor; springs, cables, vibration and kicks on the arm.
- ``arm.tilt``: gravity is ``g (sin(angle) cos(direction), sin(angle) sin(direction), -cos(angle))`` in the base's axes,
  theta counted from x.
- ``disturbance.*kick``: in the run with this number, counted from 0, while ``time <= t < time + duration``.
- motor: delay, resolution, dead zone, bias, saturation, asymmetry, drift, lag, in this order, then inductance, limit of
  the current, and ripple of the torque that comes of it; sensors: delay, eccentric discs, offset, scale, counts.
- ``back_emf``: the part of the arm's damping that is the motor's.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np
from mujoco_foreign import EVENTS, FOREIGN, draw_foreign

if TYPE_CHECKING:
    from mujoco_rig import TrueRig

Effects = dict[str, dict[str, float | str]]

EFFECTS = (
    "arm.coulomb", "arm.stribeck", "arm.quadratic", "arm.spring", "arm.cable", "arm.presliding", "arm.cogging",
    "arm.tilt",
    "motor.deadzone", "motor.bias", "motor.saturation", "motor.lag", "motor.delay", "motor.asymmetry", "motor.drift",
    "motor.ripple",
    "drive.backlash", "drive.compliance",
    "pendulum.coulomb", "pendulum.quadratic", "pendulum.spring", "pendulum.bias", "pendulum.inertia_transverse",
    "sensor.alpha.offset", "sensor.alpha.scale", "sensor.theta.scale", "sensor.delay",
    "disturbance.vibration", "disturbance.kick", "disturbance.arm_kick",
)  # fmt: skip

# In no draw of the benchmark: those that a diagnosis looks for on request alone, and lost counts, which came later.
RARE = (
    "arm.load_friction", "arm.angle_friction", "arm.fading_friction", "arm.lugre", "arm.relaxation", "arm.stop",
    "motor.resolution", "motor.inductance", "motor.current_limit",
    "sensor.theta.eccentricity", "sensor.alpha.eccentricity",
    "sensor.theta.lost_counts", "sensor.alpha.lost_counts", "sensor.jitter",
)  # fmt: skip

# Two parts where the plant has room for one; delays are counted in even samples; a rod that bends has mass to be
# divided.
IMPOSSIBLE = (
    frozenset({"drive.backlash", "drive.compliance"}), frozenset({"arm.spring", "arm.cable"}),
    frozenset({"arm.presliding", "arm.lugre"}),
    frozenset({"x.clock_jitter", "motor.delay"}), frozenset({"x.clock_jitter", "sensor.delay"}),
    frozenset({"x.flexible_rod", "pendulum.inertia_transverse"}),
)  # fmt: skip

SECONDS = 12.0  # usual length of a recording: kicks fall into its middle half


def check(effects: Effects) -> None:
    """Raises where the plant does not have an effect, or not all of them together."""
    known = EFFECTS + RARE + FOREIGN + EVENTS
    unknown = set(effects) - set(known)
    if unknown:
        raise ValueError(f"the MuJoCo plant has no {', '.join(sorted(unknown))}; it has {', '.join(known)}")
    for pair in IMPOSSIBLE:
        if pair <= set(effects):
            raise ValueError(f"the MuJoCo plant has room for one of {' and '.join(sorted(pair))}")


def hide(rig: TrueRig, ids: tuple[str, ...], rng: np.random.Generator, size: float = 1.0) -> tuple[TrueRig, Effects]:
    """The rig in which these effects are hidden, and their drawn sizes."""
    effects = {effect: draw_effect(effect, rig, rng, size) for effect in ids}
    check(effects)
    if "pendulum.inertia_transverse" in effects:  # the model of the papers that leave it out; no body has it twice
        rig = dataclasses.replace(rig, pend_transverse=0.0)
    return rig, effects


# Typical sizes, as fractions of the rig's own scales; `size` multiplies them, so a third of a usual effect is size =
# 1/3.
def draw_effect(effect: str, rig: TrueRig, rng: np.random.Generator, size: float = 1.0) -> dict[str, float | str]:
    """Parameters (SI) of an effect of a size one meets on a rig of this class."""
    torque, sign = rig.torque_per_volt * rig.vmax, float(rng.choice([-1.0, 1.0]))

    def between(low: float, high: float) -> float:
        return float(size * rng.uniform(low, high))

    def plain(low: float, high: float) -> float:  # where, not how much
        return float(rng.uniform(low, high))

    match effect:
        case "arm.coulomb":
            return {"torque": torque * between(0.08, 0.17)}
        case "arm.stribeck":
            coulomb = torque * between(0.05, 0.09)
            return {"coulomb": coulomb, "static": coulomb * plain(1.8, 2.4), "velocity": plain(0.3, 0.8)}
        case "arm.quadratic":
            return {"coefficient": torque * between(0.006, 0.012)}
        case "arm.spring":
            return {"stiffness": torque * between(0.10, 0.20), "rest": plain(-0.2, 0.2)}
        case "arm.cable":
            stiffness = torque * between(0.06, 0.12)
            return {
                "stiffness": stiffness, "asymmetry": sign * stiffness * plain(0.3, 0.6),
                "cubic": stiffness * plain(0.4, 1.0), "rest": plain(-0.2, 0.2),
            }  # fmt: skip
        case "arm.presliding":
            friction = torque * between(0.08, 0.17)
            return {"torque": friction, "stiffness": friction / plain(0.03, 0.08)}
        case "arm.lugre":
            friction = torque * between(0.08, 0.17)
            stiffness = friction / plain(0.03, 0.08)
            return {
                "torque": friction, "stiffness": stiffness,
                "damping": plain(0.3, 1.0) * float(np.sqrt(stiffness * rig.arm_inertia)),
            }  # fmt: skip
        case "arm.cogging":
            return {
                "amplitude": torque * between(0.06, 0.11),
                "order": float(rng.integers(3, 9)),
                "phase": plain(0, 2 * np.pi),
            }
        case "arm.tilt":
            return {"angle": between(0.05, 0.10), "direction": plain(-np.pi, np.pi)}
        case "motor.deadzone":
            return {"width": rig.vmax * between(0.05, 0.09)}
        case "motor.bias":
            return {"voltage": sign * rig.vmax * between(0.05, 0.09)}
        case "motor.saturation":
            return {"limit": rig.vmax * max(1 - between(0.55, 0.70), 0.1)}
        case "motor.lag":
            return {"time_constant": between(0.010, 0.025)}
        case "motor.delay":
            return {"delay": between(0.006, 0.016)}
        case "motor.asymmetry":
            return {"negative_gain": 1 - between(0.12, 0.25)}
        case "motor.drift":
            return {"rate": sign * between(0.012, 0.025)}
        case "motor.ripple":  # motors of five to eleven segments, an odd number
            return {
                "amplitude": between(0.1, 0.2),
                "order": 2.0 * float(rng.choice([5, 7, 9, 11])),
                "phase": plain(0, 2 * np.pi),
            }
        case "drive.backlash":
            return {
                "gap": between(0.03, 0.07),
                "motor_share": plain(0.3, 0.6),
                "encoder": str(rng.choice(["arm", "motor"])),
            }
        # twist under half the motor's torque: 3 to 6 hundredths of a radian; it rings at 5 to 30 Hz
        case "drive.compliance":
            stiffness, share = 0.5 * torque / between(0.03, 0.06), plain(0.3, 0.6)
            reduced = share * (1 - share) * rig.arm_inertia
            return {
                "stiffness": stiffness,
                "damping": 2 * plain(0.05, 0.15) * float(np.sqrt(stiffness * reduced)),
                "motor_share": share,
            }
        case "pendulum.coulomb":
            return {"torque": rig.gravity_torque * between(0.025, 0.05)}
        case "pendulum.quadratic":
            return {"coefficient": rig.gravity_torque * between(0.0010, 0.0016)}
        case "pendulum.spring":
            return {"stiffness": rig.gravity_torque * between(0.025, 0.05), "rest": float(np.pi)}
        case "pendulum.bias":
            return {"torque": sign * rig.gravity_torque * between(0.03, 0.05)}
        case "pendulum.inertia_transverse":  # at most the hinge's: no thin rod has more
            return {"inertia": rig.pend_inertia * min(between(0.8, 1.0), 1.0)}
        case "sensor.alpha.offset":
            return {"angle": sign * between(0.03, 0.05)}
        case "sensor.alpha.scale" | "sensor.theta.scale":
            return {"scale": 1 + sign * between(0.025, 0.05)}
        case "sensor.delay":
            return {"delay": between(0.006, 0.014)}
        case "disturbance.vibration":
            return {
                "amplitude": torque * between(0.07, 0.13),
                "frequency": plain(4.0, 12.0),
                "phase": plain(0, 2 * np.pi),
            }
        case "disturbance.kick" | "disturbance.arm_kick":  # in a hanging run: upright, the pendulum would go over
            scale = rig.gravity_torque if effect == "disturbance.kick" else torque
            return {
                "run": float(rng.integers(2)), "time": SECONDS * plain(0.25, 0.75), "duration": plain(0.03, 0.05),
                "torque": sign * scale * between(0.8, 1.3),
            }  # fmt: skip
        case "arm.load_friction":
            return {"coefficient": between(0.20, 0.35), "back_emf": plain(0.1, 1.0)}
        case "arm.angle_friction":
            return {
                "torque": torque * between(0.08, 0.15),
                "depth": plain(0.8, 1.0),
                "order": float(rng.integers(1, 7)),
                "phase": plain(0, 2 * np.pi),
            }
        case "arm.fading_friction":
            return {"torque": torque * between(0.15, 0.25), "time_constant": plain(2.0, 4.0)}
        case "arm.relaxation":
            return {"stiffness": torque * between(0.3, 0.6), "time_constant": plain(0.3, 1.0)}
        case "arm.stop":
            stiffness = torque / 0.05
            return {
                "stiffness": stiffness, "angle": plain(0.3, 0.4), "middle": plain(-0.1, 0.1),
                "damping": 0.6 * float(np.sqrt(stiffness * rig.arm_inertia)),
            }  # fmt: skip
        case "motor.resolution":
            return {"step": rig.vmax * between(0.10, 0.16)}
        case "motor.inductance":
            return {"time_constant": between(0.01, 0.03), "back_emf": plain(0.7, 1.0)}
        case "motor.current_limit":
            return {"limit": torque * max(1 - between(0.72, 0.80), 0.1), "back_emf": plain(0.7, 1.0)}
        case "sensor.theta.eccentricity":
            return {"amplitude": between(0.08, 0.15), "phase": plain(0, 2 * np.pi)}
        case "sensor.alpha.eccentricity":
            return {"amplitude": between(0.03, 0.06), "phase": plain(0, 2 * np.pi)}
        case "sensor.jitter":
            return {"spread": between(1e-3, 2e-3), "seed": float(rng.integers(1000))}
        case "sensor.theta.lost_counts" | "sensor.alpha.lost_counts":
            return {"run": float(rng.integers(2)), "time": SECONDS * plain(0.25, 0.75), "size": sign * between(0.04, 0.08)}
    if (drawn := draw_foreign(effect, rig, rng, between, plain, SECONDS)) is not None:
        return drawn
    raise ValueError(f"no effect called {effect!r} in the MuJoCo plant; it has {', '.join(EFFECTS + RARE + FOREIGN)}")
