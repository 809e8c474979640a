"""A Furuta pendulum in MuJoCo: the independent plant in which the tests hide effects.

Nothing here shares code or equations with furuta: the multibody dynamics, the friction constraint and the integrator are MuJoCo's.
A case is a folder with a data sheet (``rig.toml``, a few per cent off the truth), recordings (``run-*.csv``) and ``truth.json``.

    python py/tests/mujoco_rig.py --out DIR --rig qube-like --effect arm.coulomb --effect motor.delay:delay=0.011 --seed 7

Conventions are the project's: SI, radians, alpha = 0 upright, the command of row k is held until row k + 1.
"""

from __future__ import annotations

import argparse
import dataclasses
import itertools
import pathlib

import mujoco
import numpy as np

STEP = 1e-4  # s, MuJoCo's integration step: 10 to 50 of them per sample


@dataclasses.dataclass(frozen=True)
class TrueRig:
    """What the plant really is (SI). The names are those of ``true_rig`` in ``truth.json``."""

    name: str
    arm_length: float
    arm_inertia: float  # about the motor axis, rotor and gears included, pendulum not
    arm_viscous: float
    pend_mass: float
    pend_com: float
    pend_inertia: float  # about the centre of mass, both transverse axes
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

    @property
    def torque_per_volt(self) -> float:
        """Arm torque per unit of command at standstill, N m."""
        return self.amp * self.kt * self.gear * self.eff / self.R

    @property
    def arm_damping(self) -> float:
        """Viscous friction and back-EMF together, N m s/rad."""
        return self.arm_viscous + self.kt * self.kb * self.gear**2 * self.eff / self.R

    @property
    def gravity_torque(self) -> float:
        """Largest gravity torque on the pendulum, N m."""
        return self.pend_mass * self.g * self.pend_com


# Four classes of rig found in laboratories, from a desk-top direct drive to a geared servo.
FAMILIES = {
    rig.name: rig
    for rig in (
        TrueRig("qube-like", 0.085, 2.3e-4, 1.0e-4, 0.024, 0.0645, 3.33e-5, 5e-5, 8.4, 0.042, 0.042, 1, 1, 1, 10, 2048, 2048, 500),
        TrueRig("emecs", 0.16, 2.15e-3, 8e-3, 0.022, 0.080, 1.877e-4, 3e-4, 2.56, 0.01826, 0.01826, 1, 1, 10, 2.4, 2000, 2000, 500),
        TrueRig("srv02-like", 0.158, 3.58e-3, 4e-3, 0.125, 0.1675, 1.2e-3, 1.2e-3, 2.6, 7.683e-3, 7.678e-3, 70, 0.621, 1, 10, 4096, 4096, 500),
        TrueRig("bench-made", 0.11, 6e-4, 4e-4, 0.045, 0.098, 1.4e-4, 1.2e-4, 5.1, 0.055, 0.055, 1, 1, 1, 12, 4096, 4096, 400),
    )
}


def draw_rig(family: str, rng: np.random.Generator, spread: float = 0.15) -> TrueRig:
    """A rig of the family's class that is nobody else's: every inertia, friction and motor constant moved by up to ``spread``."""
    rig = FAMILIES[family]
    moved = {
        key: getattr(rig, key) * (1 + spread * rng.uniform(-1, 1))
        for key in ("arm_length", "arm_inertia", "arm_viscous", "pend_mass", "pend_com", "pend_inertia", "pend_viscous", "R", "kt")
    }
    return dataclasses.replace(rig, **moved, kb=rig.kb * moved["kt"] / rig.kt)


def data_sheet(rig: TrueRig, rng: np.random.Generator, spread: float) -> TrueRig:
    """What the owner believes: each quantity a maker cannot know exactly is off by a normal error of ``spread`` (clipped at two)."""
    keys = ("arm_inertia", "arm_viscous", "pend_mass", "pend_com", "pend_inertia", "pend_viscous", "R", "kt")
    wrong = {key: getattr(rig, key) * (1 + spread * np.clip(rng.standard_normal(), -2, 2)) for key in keys}
    return dataclasses.replace(rig, **wrong, kb=rig.kb * wrong["kt"] / rig.kt)


def rig_toml(rig: TrueRig) -> str:
    """The rig as a furuta rig file."""
    return f"""[rig]
name = "{rig.name}"

[arm]
length = {rig.arm_length:.8g}      # m, motor axis to pendulum pivot
inertia = {rig.arm_inertia:.8g}    # kg m2, about the motor axis, rotor and gears included, pendulum not
viscous = {rig.arm_viscous:.8g}    # N m s/rad

[pendulum]
mass = {rig.pend_mass:.8g}         # kg
com = {rig.pend_com:.8g}           # m, pivot to centre of mass
inertia = {rig.pend_inertia:.8g}   # kg m2, about the centre of mass, both transverse axes
inertia_axial = 0.0                # kg m2, about the rod's own axis
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


# Typical sizes, as fractions of the rig's own scales; `size` multiplies them, so a third of a usual effect is size = 1/3.
def draw_effect(effect: str, rig: TrueRig, rng: np.random.Generator, size: float = 1.0) -> dict[str, float]:
    """Parameters (SI) of an effect of a size one meets on a rig of this class."""
    torque, sign = rig.torque_per_volt * rig.vmax, rng.choice([-1.0, 1.0])

    def between(low: float, high: float) -> float:
        return float(size * rng.uniform(low, high))

    match effect:
        case "arm.coulomb":
            return {"torque": torque * between(0.08, 0.17)}
        case "arm.spring":
            return {"stiffness": torque * between(0.10, 0.20), "rest": float(rng.uniform(-0.2, 0.2))}
        case "arm.quadratic":
            return {"coefficient": torque * between(0.006, 0.012)}
        case "motor.deadzone":
            return {"width": rig.vmax * between(0.05, 0.09)}
        case "motor.bias":
            return {"voltage": float(sign) * rig.vmax * between(0.05, 0.09)}
        case "motor.delay":
            return {"delay": between(0.006, 0.016)}
        case "motor.lag":
            return {"time_constant": between(0.010, 0.025)}
        case "pendulum.coulomb":
            return {"torque": rig.gravity_torque * between(0.025, 0.05)}
        case "pendulum.quadratic":
            return {"coefficient": rig.gravity_torque * between(0.0010, 0.0016)}
        case "sensor.alpha.offset":
            return {"angle": float(sign) * between(0.03, 0.05)}
        case "x.memory":  # a rubber sleeve: drag that remembers
            return {"coefficient": torque * between(0.06, 0.10), "tau": 1.5}
        case "x.gain_angle":  # a torque constant that varies once per turn
            return {"depth": between(0.25, 0.40), "phase": float(rng.uniform(0, 2 * np.pi))}
        case "x.cross_drag":  # a joint whose drag grows with the other joint's speed
            return {"coefficient": rig.gravity_torque * between(0.004, 0.008)}
    raise ValueError(f"no effect called {effect!r} in the MuJoCo plant; it has {', '.join(EFFECTS + FOREIGN)}")


EFFECTS = (
    "arm.coulomb", "arm.spring", "arm.quadratic", "motor.deadzone", "motor.bias", "motor.delay", "motor.lag",
    "pendulum.coulomb", "pendulum.quadratic", "sensor.alpha.offset",
)  # fmt: skip
FOREIGN = ("x.memory", "x.gain_angle", "x.cross_drag")  # in no catalogue: to be reported as unexplained

Effects = dict[str, dict[str, float]]


class Plant:
    """The rig in MuJoCo, with effects hidden in it. ``advance`` is one sample: command in, encoder readings out."""

    def __init__(self, rig: TrueRig, effects: Effects, alpha: float, theta: float = 0.0):
        unknown = set(effects) - set(EFFECTS) - set(FOREIGN)
        if unknown:
            raise ValueError(f"the MuJoCo plant has no {sorted(unknown)}")
        self.rig = rig
        self.effects = effects
        self.model = mujoco.MjModel.from_xml_string(self._xml())
        self.data = mujoco.MjData(self.model)
        self.data.qpos[:] = theta, alpha
        self.substeps = round(1 / (rig.rate * STEP))
        if abs(self.substeps * STEP * rig.rate - 1) > 1e-9:
            raise ValueError(f"rate {rig.rate} does not divide into steps of {STEP} s")
        self.lagged = 0.0  # state of motor.lag, V
        self.remembered = 0.0  # state of x.memory, rad/s
        self.queue: list[float] = []  # past commands, newest first, for motor.delay

    def _parameter(self, effect: str, name: str) -> float:
        return self.effects.get(effect, {}).get(name, 0.0)

    def _xml(self) -> str:
        rig, p = self.rig, self._parameter
        # MuJoCo's friction acts ahead of the stop by the constraint's time constant: 10 ms by default. One step is the stiffest RK4 carries
        # (rate 2 / constant), and `refsafe` would not allow it.
        stiff = f'solreffriction="{STEP} 1" solimpfriction="0.9999 0.9999 0.001 0.5 2"'
        return f"""<mujoco>
  <compiler angle="radian"/>
  <option timestep="{STEP}" gravity="0 0 {-rig.g}" integrator="RK4" cone="elliptic" tolerance="1e-10">
    <flag contact="disable" refsafe="disable"/>
  </option>
  <worldbody>
    <body name="arm">
      <joint name="theta" type="hinge" axis="0 0 1" damping="{rig.arm_damping!s}" stiffness="{p("arm.spring", "stiffness")!s}"
             springref="{p("arm.spring", "rest")!s}" frictionloss="{p("arm.coulomb", "torque")!s}" {stiff}/>
      <inertial pos="0 0 0" mass="1" diaginertia="{rig.arm_inertia!s} {rig.arm_inertia!s} {rig.arm_inertia!s}"/>
      <body name="pendulum" pos="{rig.arm_length!s} 0 0">
        <joint name="alpha" type="hinge" axis="1 0 0" damping="{rig.pend_viscous!s}" frictionloss="{p("pendulum.coulomb", "torque")!s}" {stiff}/>
        <inertial pos="0 0 {rig.pend_com!s}" mass="{rig.pend_mass!s}" diaginertia="{rig.pend_inertia!s} {rig.pend_inertia!s} 1e-12"/>
      </body>
    </body>
  </worldbody>
</mujoco>"""

    @property
    def state(self) -> np.ndarray:
        """[theta, alpha, theta_dot, alpha_dot], true, not measured."""
        return np.concatenate([self.data.qpos, self.data.qvel])

    def measure(self, rng: np.random.Generator | None = None, noise: float = 0.0) -> tuple[float, float]:
        """Encoder angles: true angle (+ offset), noise of ``noise`` counts RMS, rounded to whole counts."""
        angles = np.array(self.data.qpos) + [0.0, self._parameter("sensor.alpha.offset", "angle")]
        per_rad = np.array([self.rig.arm_counts, self.rig.pend_counts]) / (2 * np.pi)
        counts = angles * per_rad + (noise * rng.standard_normal(2) if rng is not None and noise else 0.0)
        theta, alpha = np.round(counts) / per_rad + 0.0  # no negative zeros in the files
        return float(theta), float(alpha)

    def _delayed(self, u: float) -> np.ndarray:
        """Command at the motor in each substep: a transport delay of any real length, the substep of the edge averaged."""
        delay = self._parameter("motor.delay", "delay") / STEP  # in substeps
        whole = int(np.ceil(delay / self.substeps))
        self.queue = ([u] + self.queue)[: whole + 1]
        held = self.queue + [0.0] * (whole + 1 - len(self.queue))
        start = np.arange(self.substeps)
        # average over [start, start + 1] of the command given `delay` substeps earlier
        out = np.zeros(self.substeps)
        for age, value in enumerate(held):  # held during [-age, -age + 1] samples, seen `delay` later
            begin = -age * self.substeps + delay
            end = begin + self.substeps
            out += value * np.clip(np.minimum(start + 1, end) - np.maximum(start, begin), 0.0, 1.0)
        return out

    def _voltage(self, u: float) -> np.ndarray:
        """What reaches the winding in each substep, in command units: delay, dead zone, bias, lag, in this order."""
        volts = self._delayed(u)
        width = self._parameter("motor.deadzone", "width")
        volts = np.sign(volts) * np.maximum(np.abs(volts) - width, 0.0) + self._parameter("motor.bias", "voltage")
        constant = self._parameter("motor.lag", "time_constant")
        if constant > 0.0:
            keep = np.exp(-STEP / constant)
            for i, target in enumerate(volts):  # exact for a held input; the mean over the substep is what turns the arm
                start, self.lagged = self.lagged, target + (self.lagged - target) * keep
                volts[i] = target + (start - target) * (1 - keep) * constant / STEP
        return volts

    def advance(self, u: float) -> None:
        """Holds the command ``u`` for one sample."""
        rig, data, p = self.rig, self.data, self._parameter
        arm_drag, pendulum_drag = p("arm.quadratic", "coefficient"), p("pendulum.quadratic", "coefficient")
        memory, depth, phase = p("x.memory", "coefficient"), p("x.gain_angle", "depth"), p("x.gain_angle", "phase")
        forget = STEP / p("x.memory", "tau") if memory else 0.0
        cross = p("x.cross_drag", "coefficient")
        applied = data.qfrc_applied
        torques = self._voltage(float(np.clip(u, -rig.vmax, rig.vmax))) * rig.torque_per_volt
        if not (arm_drag or pendulum_drag or memory or depth or cross):  # constant within stretches: MuJoCo's own loop is faster
            for torque, stretch in itertools.groupby(torques):
                applied[0] = torque
                mujoco.mj_step(self.model, data, nstep=len(list(stretch)))
            return
        for motor in torques:
            # torques are held for the step: taken at its middle, extrapolated, they are right to second order
            arm_speed, pendulum_speed = data.qvel + 0.5 * STEP * data.qacc
            torque = motor - arm_drag * abs(arm_speed) * arm_speed
            if memory:
                self.remembered += forget * (arm_speed - self.remembered)
                torque -= memory * self.remembered
            if depth:
                torque += motor * depth * np.sin(data.qpos[0] + phase)
            applied[0] = torque
            applied[1] = -pendulum_drag * abs(pendulum_speed) * pendulum_speed - cross * abs(arm_speed) * pendulum_speed
            mujoco.mj_step(self.model, data)


def main() -> None:
    from mujoco_case import write_case  # the recordings live in their own file

    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument("--out", required=True, type=pathlib.Path, help="folder of the case, made if absent")
    a.add_argument("--rig", default="qube-like", choices=sorted(FAMILIES))
    a.add_argument("--effect", action="append", default=[], metavar="ID[:NAME=VALUE,...]", help="hide this; sizes are drawn where not given; none: a clean case")
    a.add_argument("--size", type=float, default=1.0, help="times the usual size of drawn effects")
    a.add_argument("--seed", type=int, default=1)
    a.add_argument("--spread", type=float, default=0.03, help="relative error of the data sheet")
    a.add_argument("--noise", type=float, default=0.0, help="encoder noise in counts RMS, beside the rounding")
    a.add_argument("--rate", type=float, help="samples per second (a divisor of 10000)")
    a.add_argument("--seconds", type=float, default=12.0, help="length of each run")
    a.add_argument("--runs", default="multisine,steps,balance")
    a = a.parse_args()
    rng = np.random.default_rng(a.seed)
    rig = draw_rig(a.rig, rng)
    if a.rate:
        rig = dataclasses.replace(rig, rate=a.rate)
    effects = {}
    for entry in a.effect:
        effect, _, given = entry.partition(":")
        effects[effect] = draw_effect(effect, rig, rng, a.size)
        effects[effect] |= {k: float(v) for k, v in (pair.split("=") for pair in given.split(",") if pair)}
    write_case(a.out, rig, effects, seed=a.seed, spread=a.spread, noise=a.noise, seconds=a.seconds, runs=a.runs.split(","))


if __name__ == "__main__":
    main()
