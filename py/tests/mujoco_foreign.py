"""What can be hidden in the MuJoCo rig and is in no catalogue, to be reported as unexplained.

Some of it is in the catalogue since (`CALLED`), which a diagnosis names where it explains the recordings.

Sizes are such that recordings show each several times above an encoder's noise within half a second.

- ``x.memory``: drag by the arm's speed as a rubber sleeve remembers it.
- ``x.maxwell_cable``: a spring in series with a dashpot, a cable that relaxes.
- ``x.gear_friction``: dry friction in proportion to the torque the motor transmits.
- ``x.friction_angle``: dry friction that depends on the arm's angle.
- ``x.fading_friction``: dry friction that wears off as the rig warms up.
- ``x.sqrt_friction``: torque by the root of the speed.
- ``x.gain_angle``: a torque constant that varies once a turn.
- ``x.inductance``: the current follows voltage less back-EMF late.
- ``x.current_limit``: an amplifier that limits the current, not the voltage.
- ``x.voltage_backlash``: the amplifier's input has play.
- ``x.pwm_sag``: few levels of voltage, from a supply that sags under load.
- ``x.cross_drag``: the pendulum's drag grows with the arm's speed.
- ``x.detent``: a magnet holds the pendulum at some angles.
- ``x.flexible_rod``: the rod bends below its middle: a second mode.
- ``x.end_stops``: the arm meets rubber.
- ``x.eccentric_theta``, ``x.eccentric_alpha``: an encoder's disc off its axis.
- ``x.lost_counts``: theta's zero steps, in every run.
- ``x.clock_jitter``: samples are taken around the moments that their stamps claim.

What happens once, for a second or more, in one recording (`EVENTS`), is no physics of the rig:

- ``x.cut_off``: the motor gets nothing from a moment on, while the command goes on.
- ``x.held_pendulum``, ``x.held_arm``: a hand brakes the pendulum, or the arm.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from mujoco_rig import TrueRig

FOREIGN = (
    "x.memory", "x.gain_angle", "x.cross_drag",
    "x.gear_friction", "x.friction_angle", "x.maxwell_cable", "x.inductance", "x.current_limit", "x.eccentric_theta",
    "x.eccentric_alpha", "x.lost_counts",
    "x.pwm_sag", "x.clock_jitter", "x.end_stops", "x.detent", "x.flexible_rod", "x.fading_friction", "x.sqrt_friction",
    "x.voltage_backlash",
)  # fmt: skip

EVENTS = ("x.cut_off", "x.held_pendulum", "x.held_arm")

# By what name the catalogue has it. Lost counts there are one recording's alone.
CALLED = {
    "x.memory": "arm.relaxation",
    "x.maxwell_cable": "arm.relaxation",
    "x.gear_friction": "arm.load_friction",
    "x.friction_angle": "arm.angle_friction",
    "x.fading_friction": "arm.fading_friction",
    "x.gain_angle": "motor.ripple",
    "x.inductance": "motor.inductance",
    "x.current_limit": "motor.current_limit",
    "x.eccentric_theta": "sensor.theta.eccentricity",
    "x.eccentric_alpha": "sensor.alpha.eccentricity",
    "x.end_stops": "arm.stop",
}

Draw = Callable[[float, float], float]


def draw_foreign(
    effect: str, rig: TrueRig, rng: np.random.Generator, between: Draw, plain: Draw, seconds: float
) -> dict[str, float] | None:
    """Parameters (SI) of one of `FOREIGN`, or None.

    ``between`` draws how much, ``plain`` where or when, ``seconds`` is the usual length of a recording.
    """
    torque = rig.torque_per_volt * rig.vmax
    match effect:
        case "x.memory":
            return {"coefficient": torque * between(0.06, 0.10), "tau": 1.5}
        case "x.gain_angle":
            return {"depth": between(0.25, 0.40), "phase": plain(0, 2 * np.pi)}
        case "x.cross_drag":
            return {"coefficient": rig.gravity_torque * between(0.004, 0.008)}
        case "x.gear_friction":
            return {"coefficient": between(0.20, 0.35)}
        case "x.friction_angle":
            return {
                "torque": torque * between(0.08, 0.15),
                "depth": plain(0.8, 1.0),
                "order": float(rng.integers(3, 7)),
                "phase": plain(0, 2 * np.pi),
            }
        case "x.maxwell_cable":
            return {"stiffness": torque * between(0.3, 0.6), "tau": plain(0.3, 1.0)}
        case "x.inductance":
            return {"time_constant": between(0.04, 0.07)}
        case "x.current_limit":
            return {"torque": torque * max(1 - between(0.72, 0.80), 0.1)}
        case "x.eccentric_theta":
            return {"angle": between(0.12, 0.20), "phase": plain(0, 2 * np.pi)}
        case "x.eccentric_alpha":
            return {"angle": between(0.04, 0.08), "phase": plain(0, 2 * np.pi)}
        case "x.cut_off":
            return {"run": float(rng.integers(2)), "from": seconds * plain(0.5, 0.65), "to": seconds}
        case "x.held_pendulum" | "x.held_arm":  # a speed halves within some 20 ms
            start = seconds * plain(0.2, 0.6)
            pendulum = rig.pend_inertia + rig.pend_mass * rig.pend_com**2
            held = pendulum if effect == "x.held_pendulum" else rig.arm_inertia + rig.pend_mass * rig.arm_length**2
            return {
                "run": float(rng.integers(2)), "from": start, "to": start + plain(1.2, 2.2), "damping": 40.0 * held,
            }  # fmt: skip
        case "x.lost_counts":
            return {"angle": between(0.10, 0.20), "time": seconds * plain(0.25, 0.75)}
        case "x.pwm_sag":
            return {"level": rig.vmax * between(0.10, 0.16), "sag": between(0.5, 0.8), "tau": plain(0.8, 2.0)}
        case "x.clock_jitter":
            return {"spread": between(0.005, 0.009), "correlation": 0.1, "seed": float(rng.integers(1 << 30))}
        case "x.end_stops":
            return {
                "angle": plain(0.3, 0.4),
                "stiffness": torque / 0.05,
                "damping": 0.6 * float(np.sqrt(torque / 0.05 * rig.arm_inertia)),
            }
        case "x.detent":
            return {
                "torque": rig.gravity_torque * between(0.06, 0.10),
                "order": float(rng.integers(6, 13)),
                "phase": plain(0, 2 * np.pi),
            }
        case "x.flexible_rod":
            return {
                "share": min(between(0.25, 0.33), 0.33),
                "frequency": plain(3.0, 4.0),
                "damping_ratio": plain(0.02, 0.05),
            }
        case "x.fading_friction":
            return {"torque": torque * between(0.15, 0.25), "time_constant": plain(2.0, 4.0)}
        case "x.sqrt_friction":
            return {"coefficient": torque * between(0.06, 0.10)}
        case "x.voltage_backlash":
            return {"width": rig.vmax * between(0.06, 0.10)}
    return None
