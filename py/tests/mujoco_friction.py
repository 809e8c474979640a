"""Dry friction whose size changes: MuJoCo's constraint holds the joint, its limit is set at every step.

A law is called in the middle of each step with the time, the angles, the speeds and the motor's torque,
and gives a torque that is not negative.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from mujoco_effects import Effects
from mujoco_torques import Law

if TYPE_CHECKING:
    from mujoco_rig import TrueRig


def frictions(effects: Effects, rig: TrueRig, motor: int) -> list[Law]:
    """The changing limits of the dry friction on the axis the motor turns; they add up."""
    laws: list[Law] = []
    for effect, p in effects.items():
        match effect:
            case "arm.stribeck":
                laws.append(
                    lambda t, angle, speed, driving, p=p: (
                        p["coulomb"] + (p["static"] - p["coulomb"]) * np.exp(-((speed[motor] / p["velocity"]) ** 2))
                    )
                )
            case "x.gear_friction":
                laws.append(
                    lambda t, angle, speed, driving, p=p: (
                        p["coefficient"] * abs(driving - rig.back_emf_damping * speed[motor])
                    )
                )
            case "arm.load_friction":
                laws.append(
                    lambda t, angle, speed, driving, p=p: (
                        p["coefficient"] * abs(driving - p["back_emf"] * rig.arm_damping * speed[motor])
                    )
                )
            case "x.friction_angle" | "arm.angle_friction":
                laws.append(
                    lambda t, angle, speed, driving, p=p: (
                        p["torque"] * (1 + p["depth"] * np.sin(p["order"] * angle[motor] + p["phase"]))
                    )
                )
            case "x.fading_friction" | "arm.fading_friction":
                laws.append(lambda t, angle, speed, driving, p=p: p["torque"] * np.exp(-t / p["time_constant"]))
    return laws
