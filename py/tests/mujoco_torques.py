"""Torques that MuJoCo has no means for: applied at its steps, from what the effect's law says.

A law is called in the middle of each step with the time, the angles, the speeds and the motor's torque, and gives a
torque for one axis.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from mujoco_effects import Effects

if TYPE_CHECKING:
    from mujoco_rig import TrueRig

THETA, ALPHA = 0, 1  # the plant's axes; what else turns (a rod's upper half, a rotor behind a drive) comes after them

Law = Callable[[float, np.ndarray, np.ndarray, float], float]


class Bristles:
    """Dahl friction: bristles that bend with the way and give way at ``torque``; a way without reversal is solved
    exactly. With damping, LuGre friction at one level."""

    def __init__(self, axis: int, torque: float, stiffness: float, step: float, damping: float = 0.0):
        self.axis, self.most, self.stiffness, self.step, self.bend = axis, torque / stiffness, stiffness, step, 0.0
        self.damping = damping

    def after(self, way: float) -> float:
        end = self.most if way > 0 else -self.most
        return end + (self.bend - end) * np.exp(-abs(way) / self.most)

    def __call__(self, t: float, angle: np.ndarray, speed: np.ndarray, motor: float) -> float:
        way = speed[self.axis] * self.step
        bend = self.after(way / 2)
        rate = speed[self.axis] - abs(speed[self.axis]) * bend / self.most
        torque = -self.stiffness * bend - self.damping * rate
        self.bend = self.after(way)
        return torque


class Sleeve:
    """A rubber sleeve on the arm: drag by the speed it remembers."""

    def __init__(self, axis: int, coefficient: float, tau: float, step: float):
        self.axis, self.coefficient, self.forget, self.remembered = axis, coefficient, step / tau, 0.0

    def __call__(self, t: float, angle: np.ndarray, speed: np.ndarray, motor: float) -> float:
        self.remembered += self.forget * (speed[self.axis] - self.remembered)
        return -self.coefficient * self.remembered


class Maxwell:
    """A spring in series with a dashpot: the torque of a cable that relaxes; exact for a speed that is held."""

    def __init__(self, axis: int, stiffness: float, tau: float, step: float):
        self.axis, self.most, self.keep, self.pull = axis, stiffness * tau, np.exp(-step / tau), 0.0

    def __call__(self, t: float, angle: np.ndarray, speed: np.ndarray, motor: float) -> float:
        start, end = self.pull, self.most * speed[self.axis]
        self.pull = end + (start - end) * self.keep
        return -0.5 * (start + self.pull)


class Inductance:
    """A winding in which the current follows voltage less back-EMF late: what this adds to the torque of one that
    follows at once."""

    def __init__(self, axis: int, back_emf: float, time_constant: float, step: float):
        self.axis, self.back_emf, self.keep, self.current = axis, back_emf, np.exp(-step / time_constant), 0.0
        # of the difference at the step's start, what is left on average
        self.lead = time_constant / step * (1 - self.keep)

    def __call__(self, t: float, angle: np.ndarray, speed: np.ndarray, motor: float) -> float:
        final = motor - self.back_emf * speed[self.axis]
        missing = self.current - final
        self.current = final + missing * self.keep
        return missing * self.lead


def stop(p: dict[str, float], angle: float, speed: float) -> float:
    """Torque of rubber on either side of the middle, which pushes and does not pull."""
    angle -= p.get("middle", 0.0)
    over = angle - np.clip(angle, -p["angle"], p["angle"])
    push = p["stiffness"] * over + p["damping"] * speed
    return -push if over * push > 0.0 else 0.0


def torques(effects: Effects, rig: TrueRig, motor: int, step: float) -> list[tuple[int, Law]]:
    """(axis, law) of each effect that is a torque; ``motor`` is the axis the motor turns, ``step`` (s) how long a
    torque is held."""
    emf = rig.back_emf_damping

    def limited(torque: float, most: float) -> float:
        return np.clip(torque, -most, most) - torque

    laws: list[tuple[int, Law]] = []
    for effect, p in effects.items():
        match effect:
            case "arm.presliding":
                laws.append((motor, Bristles(motor, p["torque"], p["stiffness"], step)))
            case "arm.lugre":
                laws.append((motor, Bristles(motor, p["torque"], p["stiffness"], step, p["damping"])))
            case "arm.cogging":
                laws.append(
                    (
                        motor,
                        lambda t, angle, speed, driving, p=p: (
                            p["amplitude"] * np.sin(p["order"] * angle[motor] + p["phase"])
                        ),
                    )
                )
            case "motor.ripple":
                laws.append(
                    (
                        motor,
                        lambda t, angle, speed, driving, p=p: (
                            driving * p["amplitude"] * np.sin(p["order"] * angle[motor] + p["phase"])
                        ),
                    )
                )
            case "disturbance.vibration":
                laws.append(
                    (
                        THETA,
                        lambda t, angle, speed, driving, p=p: (
                            p["amplitude"] * np.sin(2 * np.pi * p["frequency"] * t + p["phase"])
                        ),
                    )
                )
            case "x.memory":
                laws.append((motor, Sleeve(motor, p["coefficient"], p["tau"], step)))
            case "x.gain_angle":
                laws.append(
                    (
                        motor,
                        lambda t, angle, speed, driving, p=p: driving * p["depth"] * np.sin(angle[motor] + p["phase"]),
                    )
                )
            case "x.cross_drag":
                laws.append(
                    (ALPHA, lambda t, angle, speed, driving, p=p: -p["coefficient"] * abs(speed[THETA]) * speed[ALPHA])
                )
            case "x.maxwell_cable":
                laws.append((THETA, Maxwell(THETA, p["stiffness"], p["tau"], step)))
            case "arm.relaxation":
                laws.append((THETA, Maxwell(THETA, p["stiffness"], p["time_constant"], step)))
            case "x.inductance":
                laws.append((motor, Inductance(motor, emf, p["time_constant"], step)))
            case "motor.inductance":
                back = p["back_emf"] * rig.arm_damping
                laws.append((motor, Inductance(motor, back, p["time_constant"], step)))
            case "motor.current_limit":
                laws.append(
                    (
                        motor,
                        lambda t, angle, speed, driving, p=p: limited(
                            driving - p["back_emf"] * rig.arm_damping * speed[motor], p["limit"]
                        ),
                    )
                )
            case "x.current_limit":
                laws.append(
                    (motor, lambda t, angle, speed, driving, p=p: limited(driving - emf * speed[motor], p["torque"]))
                )
            case "x.end_stops" | "arm.stop":
                laws.append((THETA, lambda t, angle, speed, driving, p=p: stop(p, angle[THETA], speed[THETA])))
            case "x.detent":
                laws.append(
                    (
                        ALPHA,
                        lambda t, angle, speed, driving, p=p: (
                            p["torque"] * np.sin(p["order"] * angle[ALPHA] + p["phase"])
                        ),
                    )
                )
            case "x.sqrt_friction":  # smooth within a hundredth of a radian a second
                laws.append(
                    (
                        motor,
                        lambda t, angle, speed, driving, p=p: (
                            -p["coefficient"] * speed[motor] / (speed[motor] ** 2 + 1e-4) ** 0.25
                        ),
                    )
                )
    return laws


def pulses(effects: Effects, run: int) -> list[tuple[int, float, float, float]]:
    """(axis, begin, end, torque) of each kick in this run."""
    axes = {"disturbance.kick": ALPHA, "disturbance.arm_kick": THETA}
    kicks = [(axis, effects[id]) for id, axis in axes.items() if id in effects]
    return [(axis, p["time"], p["time"] + p["duration"], p["torque"]) for axis, p in kicks if round(p["run"]) == run]
