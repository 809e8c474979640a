"""Torques that MuJoCo has no means for: applied at its steps, from what the effect's law says.

A law is called in the middle of each step with the time, the angles, the speeds and the motor's torque, and gives a torque for one axis.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from mujoco_effects import Effects

THETA, ALPHA, ROTOR = 0, 1, 2  # the plant's axes; the rotor has its own where there is a drive between it and the arm

Law = Callable[[float, np.ndarray, np.ndarray, float], float]


class Bristles:
    """Dahl friction: bristles that bend with the way and give way at ``torque``; a way without reversal is solved exactly."""

    def __init__(self, axis: int, torque: float, stiffness: float, step: float):
        self.axis, self.most, self.stiffness, self.step, self.bend = axis, torque / stiffness, stiffness, step, 0.0

    def after(self, way: float) -> float:
        end = self.most if way > 0 else -self.most
        return end + (self.bend - end) * np.exp(-abs(way) / self.most)

    def __call__(self, t: float, angle: np.ndarray, speed: np.ndarray, motor: float) -> float:
        way = speed[self.axis] * self.step
        torque = -self.stiffness * self.after(way / 2)
        self.bend = self.after(way)
        return torque


class Sleeve:
    """A rubber sleeve on the arm: drag by the speed it remembers."""

    def __init__(self, axis: int, coefficient: float, tau: float, step: float):
        self.axis, self.coefficient, self.forget, self.remembered = axis, coefficient, step / tau, 0.0

    def __call__(self, t: float, angle: np.ndarray, speed: np.ndarray, motor: float) -> float:
        self.remembered += self.forget * (speed[self.axis] - self.remembered)
        return -self.coefficient * self.remembered


def torques(effects: Effects, motor: int, step: float) -> list[tuple[int, Law]]:
    """(axis, law) of each effect that is a torque; ``motor`` is the axis the motor turns, ``step`` (s) how long a torque is held."""
    laws: list[tuple[int, Law]] = []
    for effect, p in effects.items():
        match effect:
            case "arm.presliding":
                laws.append((motor, Bristles(motor, p["torque"], p["stiffness"], step)))
            case "arm.cogging":
                laws.append((motor, lambda t, angle, speed, driving, p=p: p["amplitude"] * np.sin(p["order"] * angle[motor] + p["phase"])))
            case "motor.ripple":
                laws.append((motor, lambda t, angle, speed, driving, p=p: driving * p["amplitude"] * np.sin(p["order"] * angle[motor] + p["phase"])))
            case "disturbance.vibration":
                laws.append((THETA, lambda t, angle, speed, driving, p=p: p["amplitude"] * np.sin(2 * np.pi * p["frequency"] * t + p["phase"])))
            case "x.memory":
                laws.append((motor, Sleeve(motor, p["coefficient"], p["tau"], step)))
            case "x.gain_angle":
                laws.append((motor, lambda t, angle, speed, driving, p=p: driving * p["depth"] * np.sin(angle[motor] + p["phase"])))
            case "x.cross_drag":
                laws.append((ALPHA, lambda t, angle, speed, driving, p=p: -p["coefficient"] * abs(speed[THETA]) * speed[ALPHA]))
    return laws


def pulses(effects: Effects, run: int) -> list[tuple[int, float, float, float]]:
    """(axis, begin, end, torque) of each kick in this run."""
    axes = {"disturbance.kick": ALPHA, "disturbance.arm_kick": THETA}
    kicks = [(axis, effects[id]) for id, axis in axes.items() if id in effects]
    return [(axis, p["time"], p["time"] + p["duration"], p["torque"]) for axis, p in kicks if round(p["run"]) == run]
