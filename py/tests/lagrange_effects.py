"""The effects once more, as torques on the equations of ``lagrange.py``: what the MuJoCo plant is judged by.

Dry friction is a steep ``tanh``, play a stiff spring and damper beyond its ends, delays and kicks are edges at which
the integrator starts anew: other means than the plant's wherever there are others.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import lagrange
import numpy as np
from mujoco_effects import Effects

if TYPE_CHECKING:
    from mujoco_rig import TrueRig

REST = 2e-4  # rad/s: dry friction has three quarters of its torque from here on
BOUNCE = 5e-4, 1.0  # s, -: decay and damping ratio of the ends of the play (the plant's)


def constants(rig: TrueRig, effects: Effects) -> dict[str, float]:
    """Values of ``lagrange.ARGUMENTS``."""
    transverse = rig.pend_inertia if rig.pend_transverse is None else rig.pend_transverse
    transverse += effects.get("pendulum.inertia_transverse", {}).get("inertia", 0.0)
    return {
        "J": rig.arm_inertia, "m": rig.pend_mass, "L": rig.arm_length, "c": rig.pend_com, "I": rig.pend_inertia,
        "It": transverse, "Ia": rig.pend_axial,
        "g": rig.g, "lean": effects.get("arm.tilt", {}).get("angle", 0.0),
        "towards": effects.get("arm.tilt", {}).get("direction", 0.0),
    }  # fmt: skip


@dataclasses.dataclass
class Motion:
    """The rig's motion under the held commands ``u``. Behind [theta, alpha] and their rates stand rotor angle and
    speed, bristles' bend, lagged voltage, the stretch of a cable that relaxes, the voltage across the winding."""

    rig: TrueRig
    effects: Effects
    u: np.ndarray
    run: int = 0

    def __post_init__(self) -> None:
        self.values = constants(self.rig, self.effects)
        self.drive = self.effects.get("drive.backlash", self.effects.get("drive.compliance"))
        if self.drive:
            self.rotor = self.drive["motor_share"] * self.rig.arm_inertia
            self.values["J"] -= self.rotor

    def parameter(self, effect: str, name: str, default: float = 0.0) -> float:
        return self.effects.get(effect, {}).get(name, default)

    def voltage(self, t: float) -> float:
        """At the motor before its lag, in command units."""
        p = self.parameter
        sample = int(np.floor((t - p("motor.delay", "delay")) * self.rig.rate + 1e-7))
        volts = self.u[min(sample, len(self.u) - 1)] if sample >= 0 else 0.0
        if step := p("motor.resolution", "step"):
            volts = step * np.round(volts / step)
        volts = max(abs(volts) - p("motor.deadzone", "width"), 0.0) * (1 if volts > 0 else -1) + p(
            "motor.bias", "voltage"
        )
        volts = min(max(volts, -p("motor.saturation", "limit", np.inf)), p("motor.saturation", "limit", np.inf))
        return (
            volts
            * (p("motor.asymmetry", "negative_gain", 1.0) if volts < 0 else 1.0)
            * (1 + p("motor.drift", "rate") * t)
        )

    def friction(self, effect: str, speed: float) -> float:
        p = self.parameter
        level = p(effect, "torque")
        if effect == "arm.coulomb":
            rest, velocity = (
                p("arm.stribeck", "static") - p("arm.stribeck", "coulomb"),
                p("arm.stribeck", "velocity", 1.0),
            )
            level += p("arm.stribeck", "coulomb") + rest * np.exp(-((speed / velocity) ** 2))
        return -level * np.tanh(speed / REST)

    def kick(self, effect: str, t: float) -> float:
        p = self.effects.get(effect)
        on = p and round(p["run"]) == self.run and p["time"] - 1e-9 <= t < p["time"] + p["duration"] - 1e-9
        return p["torque"] if on else 0.0

    def transmitted(self, twist: float, rate: float, alpha: float) -> float:
        """Torque from the rotor to the arm."""
        if "gap" not in self.drive:
            return self.drive["stiffness"] * twist + self.drive["damping"] * rate
        time, ratio = BOUNCE
        deep = abs(twist) - self.drive["gap"] / 2
        if deep <= 0:
            return 0.0
        side = 1 if twist > 0 else -1
        # what turns with it included
        arm = 1 / lagrange.accelerations(self.values | {"g": 0.0}, [0.0, alpha, 0.0, 0.0], (1.0, 0.0))[0]
        reduced = self.rotor * arm / (self.rotor + arm)
        return side * max(reduced * (deep / (time * ratio) ** 2 + 2 * side * rate / time), 0.0)

    def torque(self, t: float, x: list[float]) -> tuple[float, ...]:
        """Torques on arm and pendulum, and the rates of what stands behind the pendulum's state."""
        rig, p = self.rig, self.parameter
        theta, alpha, theta_dot, alpha_dot, *behind = x
        more: list[float] = []
        angle, speed = (behind.pop(0), behind.pop(0)) if self.drive else (theta, theta_dot)

        volts = self.voltage(t)
        rotor = (
            -rig.arm_damping * speed
            - p("arm.quadratic", "coefficient") * abs(speed) * speed
            + self.friction("arm.coulomb", speed)
        )
        rotor += p("arm.cogging", "amplitude") * np.sin(p("arm.cogging", "order") * angle + p("arm.cogging", "phase"))
        if "arm.presliding" in self.effects:
            bend, stiffness = behind.pop(0), p("arm.presliding", "stiffness")
            rotor -= stiffness * bend
            more.append(speed - abs(speed) * stiffness * bend / p("arm.presliding", "torque"))
        if "arm.lugre" in self.effects:
            bend, stiffness = behind.pop(0), p("arm.lugre", "stiffness")
            rate = speed - abs(speed) * stiffness * bend / p("arm.lugre", "torque")
            rotor -= stiffness * bend + p("arm.lugre", "damping") * rate
            more.append(rate)
        if "motor.lag" in self.effects:
            lagged = behind.pop(0)
            more.append((volts - lagged) / p("motor.lag", "time_constant"))
            volts = lagged
        stretch = behind.pop(0) if "arm.relaxation" in self.effects else 0.0
        if "arm.relaxation" in self.effects:
            more.append(theta_dot - stretch / p("arm.relaxation", "time_constant"))
        if "motor.inductance" in self.effects:
            across = behind.pop(0)
            emf = p("motor.inductance", "back_emf") * rig.arm_damping / rig.torque_per_volt * speed
            more.append((volts - emf - across) / p("motor.inductance", "time_constant"))
            volts = across + emf
        if "motor.current_limit" in self.effects:
            emf = p("motor.current_limit", "back_emf") * rig.arm_damping / rig.torque_per_volt * speed
            most = p("motor.current_limit", "limit") / rig.torque_per_volt
            volts = np.clip(volts - emf, -most, most) + emf
        if "arm.load_friction" in self.effects:
            passed = rig.torque_per_volt * volts - p("arm.load_friction", "back_emf") * rig.arm_damping * speed
            rotor -= p("arm.load_friction", "coefficient") * abs(passed) * np.tanh(speed / REST)
        if "arm.angle_friction" in self.effects:
            place = np.sin(p("arm.angle_friction", "order") * angle + p("arm.angle_friction", "phase"))
            level = p("arm.angle_friction", "torque") * (1 + p("arm.angle_friction", "depth") * place)
            rotor -= level * np.tanh(speed / REST)
        if "arm.fading_friction" in self.effects:
            fade = np.exp(-t / p("arm.fading_friction", "time_constant"))
            rotor -= p("arm.fading_friction", "torque") * fade * np.tanh(speed / REST)
        ripple = p("motor.ripple", "amplitude") * np.sin(
            p("motor.ripple", "order") * angle + p("motor.ripple", "phase")
        )
        rotor += rig.torque_per_volt * volts * (1 + ripple)

        e = theta - p("arm.spring", "rest") - p("arm.cable", "rest")  # one of them
        arm = (
            -(p("arm.spring", "stiffness") + p("arm.cable", "stiffness")) * e
            - p("arm.cable", "asymmetry") * e**2
            - p("arm.cable", "cubic") * e**3
        )
        arm -= p("arm.relaxation", "stiffness") * stretch
        if "arm.stop" in self.effects:
            from_middle = theta - p("arm.stop", "middle")
            deep = abs(from_middle) - p("arm.stop", "angle")
            side = 1 if from_middle > 0 else -1
            if deep > 0:
                arm -= side * max(p("arm.stop", "stiffness") * deep + p("arm.stop", "damping") * side * theta_dot, 0.0)
        vibration = 2 * np.pi * p("disturbance.vibration", "frequency") * t + p("disturbance.vibration", "phase")
        arm += p("disturbance.vibration", "amplitude") * np.sin(vibration) + self.kick("disturbance.arm_kick", t)

        pendulum = -rig.pend_viscous * alpha_dot - p("pendulum.quadratic", "coefficient") * abs(alpha_dot) * alpha_dot
        pendulum += (
            self.friction("pendulum.coulomb", alpha_dot)
            + p("pendulum.bias", "torque")
            + self.kick("disturbance.kick", t)
        )
        pendulum -= p("pendulum.spring", "stiffness") * (alpha - p("pendulum.spring", "rest", np.pi))

        if self.drive:
            through = self.transmitted(angle - theta, speed - theta_dot, alpha)
            more[:0] = [speed, (rotor - through) / self.rotor]
            return arm + through, pendulum, *more
        return arm + rotor, pendulum, *more

    def at(self, times: np.ndarray, x0: np.ndarray, **options: object) -> np.ndarray:
        """[theta, alpha, theta_dot, alpha_dot, ...] at ``times`` from ``x0`` (four numbers) at 0, the rest behind it
        relaxed. Before 0 all stands at ``x0``."""
        samples = np.arange(len(self.u) + 1) / self.rig.rate
        kicks = [
            (p["time"], p["time"] + p["duration"]) for effect, p in self.effects.items() if effect.endswith("kick")
        ]
        edges = np.concatenate([times, samples, samples + self.parameter("motor.delay", "delay"), np.ravel(kicks)])
        edges = np.unique(np.round(edges, 12))  # one edge where rounding makes two
        edges = edges[(edges >= 0) & (edges <= max(times) + 1e-9)]
        start = [
            *x0,
            *((x0[0], x0[2]) if self.drive else ()),
            *([0.0] * len(self.effects.keys() & {"arm.presliding", "arm.lugre", "motor.lag"})),
            *([0.0] * len(self.effects.keys() & {"arm.relaxation", "motor.inductance"})),
        ]
        rubs = ("coulomb", "stribeck", "load_friction", "angle_friction", "fading_friction", "arm.stop")
        stiff = "drive.backlash" in self.effects or any(word in id for id in self.effects for word in rubs)
        options = ({"method": "LSODA", "rtol": 1e-8, "atol": 1e-10} if stiff else {}) | options
        states = lagrange.integrate(self.values, self.torque, start, edges, **options)
        return states[np.searchsorted(edges, np.clip(np.round(times, 12), 0, None))]
