"""The rigs in which the tests hide effects: what they really are, and what their owners believe.

Conventions are the project's: SI, radians, alpha = 0 upright, the command of row k is held until row k + 1.
"""

from __future__ import annotations

import dataclasses

import numpy as np


@dataclasses.dataclass(frozen=True)
class TrueRig:
    """What the plant really is (SI). The names are those of ``true_rig`` in ``truth.json``."""

    name: str
    arm_length: float
    arm_inertia: float  # about the motor axis, rotor and gears included, pendulum not
    arm_viscous: float
    pend_mass: float
    pend_com: float
    pend_inertia: float  # about the centre of mass, about the hinge's direction
    pend_viscous: float
    R: float
    kt: float
    kb: float
    gear: float
    eff: float
    amp: float  # V at the motor per unit of command
    vmax: float  # command limit
    arm_counts: int
    pend_counts: int
    rate: float  # samples per second
    g: float = 9.81
    pend_transverse: float | None = None  # about the other transverse axis; None: the same
    pend_axial: float = 0.0  # about the rod's own axis

    @property
    def torque_per_volt(self) -> float:
        """Arm torque per unit of command at standstill, N m."""
        return self.amp * self.kt * self.gear * self.eff / self.R

    @property
    def back_emf_damping(self) -> float:
        """Arm torque that the back-EMF takes per speed, N m s/rad."""
        return self.kt * self.kb * self.gear**2 * self.eff / self.R

    @property
    def arm_damping(self) -> float:
        """Viscous friction and back-EMF together, N m s/rad."""
        return self.arm_viscous + self.back_emf_damping

    @property
    def gravity_torque(self) -> float:
        """Largest gravity torque on the pendulum, N m."""
        return self.pend_mass * self.g * self.pend_com


# Four classes of rig found in laboratories, from a desk-top direct drive to a geared servo.
FAMILIES = {
    rig.name: rig
    for rig in (
        TrueRig(
            "qube-like",
            0.085,
            2.3e-4,
            1.0e-4,
            0.024,
            0.0645,
            3.33e-5,
            5e-5,
            8.4,
            0.042,
            0.042,
            1,
            1,
            1,
            10,
            2048,
            2048,
            500,
        ),
        TrueRig(
            "emecs",
            0.16,
            2.15e-3,
            8e-3,
            0.022,
            0.080,
            1.877e-4,
            3e-4,
            2.56,
            0.01826,
            0.01826,
            1,
            1,
            10,
            2.4,
            2000,
            2000,
            500,
        ),
        TrueRig(
            "srv02-like",
            0.158,
            3.58e-3,
            4e-3,
            0.125,
            0.1675,
            1.2e-3,
            1.2e-3,
            2.6,
            7.683e-3,
            7.678e-3,
            70,
            0.621,
            1,
            10,
            4096,
            4096,
            500,
        ),
        TrueRig(
            "bench-made",
            0.11,
            6e-4,
            4e-4,
            0.045,
            0.098,
            1.4e-4,
            1.2e-4,
            5.1,
            0.055,
            0.055,
            1,
            1,
            1,
            12,
            4096,
            4096,
            400,
        ),
    )
}


def draw_rig(family: str, rng: np.random.Generator, spread: float = 0.15) -> TrueRig:
    """A rig of the family's class that no other case has: every inertia, friction and motor constant moved by up to
    ``spread``.
    """
    rig = FAMILIES[family]
    moved = {
        key: getattr(rig, key) * (1 + spread * rng.uniform(-1, 1))
        for key in (
            "arm_length",
            "arm_inertia",
            "arm_viscous",
            "pend_mass",
            "pend_com",
            "pend_inertia",
            "pend_viscous",
            "R",
            "kt",
        )
    }
    return dataclasses.replace(rig, **moved, kb=rig.kb * moved["kt"] / rig.kt)


def data_sheet(rig: TrueRig, rng: np.random.Generator, spread: float, length_error: float = 0.03) -> TrueRig:
    """What the owner believes of the rig.

    What a maker cannot know exactly is off by a normal error of ``spread`` (clipped at two), the arm's length, taken
    with a ruler, by up to ``length_error`` either way; the ruler's error has a stream of its own. The gear with its
    efficiency, the amplifier, the encoders and gravity are as on their makers' sheets: right.
    """
    keys = ("arm_inertia", "arm_viscous", "pend_mass", "pend_com", "pend_inertia", "pend_viscous", "R", "kt")
    ruler = rng.spawn(1)[0]
    wrong = {key: getattr(rig, key) * (1 + spread * np.clip(rng.standard_normal(), -2, 2)) for key in keys}
    wrong["arm_length"] = rig.arm_length * (1 + length_error * ruler.uniform(-1, 1))
    for key in ("pend_transverse", "pend_axial"):  # as far off as the inertia they were computed with
        if getattr(rig, key) is not None:
            wrong[key] = (
                getattr(rig, key) * wrong["pend_inertia"] / rig.pend_inertia if rig.pend_inertia else getattr(rig, key)
            )
    return dataclasses.replace(rig, **wrong, kb=rig.kb * wrong["kt"] / rig.kt)


def rig_toml(rig: TrueRig) -> str:
    """The rig as a furuta rig file."""
    transverse = rig.pend_inertia if rig.pend_transverse is None else rig.pend_transverse
    return f"""[rig]
name = "{rig.name}"

[arm]
length = {rig.arm_length:.8g}      # m, motor axis to pendulum pivot
inertia = {rig.arm_inertia:.8g}    # kg m2, about the motor axis, rotor and gears included, pendulum not
viscous = {rig.arm_viscous:.8g}    # N m s/rad

[pendulum]
mass = {rig.pend_mass:.8g}         # kg
com = {rig.pend_com:.8g}           # m, pivot to centre of mass
inertia = {rig.pend_inertia:.8g}   # kg m2, about the centre of mass and the hinge's direction
inertia_transverse = {transverse:.8g}
inertia_axial = {rig.pend_axial:.8g}  # kg m2, about the rod's own axis
viscous = {rig.pend_viscous:.8g}   # N m s/rad

[motor]
resistance = {rig.R:.8g}           # ohm
torque_constant = {rig.kt:.8g}     # N m/A
back_emf_constant = {rig.kb:.8g}   # V s/rad
gear_ratio = {float(rig.gear)}
efficiency = {float(rig.eff)}
amplifier_gain = {float(rig.amp)}  # V at the motor per unit of command
command_limit = {float(rig.vmax)}  # V

[sensors]
arm_counts_per_rev = {rig.arm_counts}
pendulum_counts_per_rev = {rig.pend_counts}

[environment]
gravity = {rig.g}                  # m/s2
"""
