"""A Furuta pendulum in MuJoCo, with effects hidden in it.

Nothing here shares code or equations with furuta: the multibody dynamics, dry friction, springs, drags, the drive
between rotor and arm, gravity and the integrator are MuJoCo's. What MuJoCo has no means for is a torque held for one of
its steps (``mujoco_torques.py``) or a change of the command.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import mujoco
import numpy as np
from mujoco_effects import Effects, check
from mujoco_friction import frictions
from mujoco_torques import ALPHA, THETA, pulses, torques

if TYPE_CHECKING:
    from mujoco_rig import TrueRig

STEP = 1e-4  # s, MuJoCo's integration step: 10 to 50 of them per sample

# Least moment of inertia of a body, kg m2. MuJoCo takes no point masses; 1e-12 is 3e-8 of the smallest pendulum here
# about its hinge, and nothing to one about the arm's axis, where it is taken off the arm.
LEAST = 1e-12

# Formatted with MuJoCo's step, s. MuJoCo's friction acts ahead of the stop by the constraint's time constant: 10 ms by
# default. One step is the stiffest RK4 carries
# (rate 2 / constant), and `refsafe` would not allow it.
FRICTION = 'solreffriction="{step!s} 1" solimpfriction="0.9999 0.9999 0.001 0.5 2"'

# The ends of the play: so stiff that they yield by less than a tenth of an encoder count, and hardly bouncing: a
# seventh of the speed at damping ratio 1, less above.
STOP = 'solreflimit="{constant!s} {ratio!s}" solimplimit="0.9999 0.9999 0.001 0.5 2"'


def splitmix(seed: int, n: int) -> int:
    """The ``n``-th number of SplitMix64 (Steele, Lea, Flood, OOPSLA 2014)."""
    z = (seed + 0x9E3779B97F4A7C15 * (n + 1)) % 2**64
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9 % 2**64
    z = (z ^ z >> 27) * 0x94D049BB133111EB % 2**64
    return z ^ z >> 31


def untimely(jitter: dict[str, float], run: int, time: float) -> float:
    """How much later than ``time`` says a sample of ``sensor.jitter`` is taken, s: 64 coins, thrown anew each 0.1 ms."""
    coins = splitmix(splitmix(int(jitter["seed"]), run), int(np.floor(time / 1e-4 + 0.5)))
    return jitter["spread"] * (coins.bit_count() - 32) / 4


def principal(rig: TrueRig, extra: float) -> tuple[float, tuple[float, float, float], float]:
    """Arm inertia, the pendulum's principal inertias and the armature of its hinge: a body that exists, and the same
    motion.

    A body has no principal inertia above the sum of the others; rig files may (points, planar models). A constant on
    both axes across the hinge is one on the arm's axis (sin² + cos² = 1), where it is taken away; what the hinge has
    beyond the sum of the others is armature, which counts on the hinge's axis alone.
    """
    transverse = (rig.pend_inertia if rig.pend_transverse is None else rig.pend_transverse) + extra
    lift = max(LEAST - min(transverse, rig.pend_axial), 0.0)
    transverse, axial = transverse + lift, rig.pend_axial + lift
    hinge = max(min(rig.pend_inertia, transverse + axial), LEAST)
    if hinge + axial < transverse:
        raise ValueError(
            f"no body has the inertias {rig.pend_inertia} (hinge), {transverse} (transverse) and {axial} kg m2 (axial)"
        )
    return rig.arm_inertia - lift, (hinge, transverse, axial), max(rig.pend_inertia - hinge, 0.0)


class Clock:
    """How many steps into the recording each sample is taken.

    With ``x.clock_jitter``: late or early, with a standard deviation and a correlation time.
    """

    def __init__(self, jitter: dict[str, float] | None, rate: float, run: int, step: float):
        self.jitter, self.rate, self.length, self.away = jitter, rate, step, 0.0
        if jitter:
            self.rng = np.random.default_rng([int(jitter["seed"]), run])
            self.keep = np.exp(-1 / (rate * jitter["correlation"]))

    def step(self, sample: int, last: int) -> int:
        """The step of this sample; the one before it was taken at step ``last``."""
        if self.jitter:
            self.away = (
                self.keep * self.away + np.sqrt(1 - self.keep**2) * self.jitter["spread"] * self.rng.standard_normal()
            )
        return max(round((sample / self.rate + self.away) / self.length), last + 1)


class Supply:
    """What the amplifier makes of a command, in command units: play, then few levels from a supply that sags.

    Both are effects of ``mujoco_foreign.py``.
    """

    def __init__(self, effects: Effects, rig: TrueRig):
        self.play, self.pwm, self.rig = effects.get("x.voltage_backlash"), effects.get("x.pwm_sag"), rig
        self.last = self.load = 0.0

    def __call__(self, u: float) -> float:
        if self.play:
            u = self.last = float(np.clip(self.last, u - self.play["width"], u + self.play["width"]))
        if self.pwm:
            u = round(u / self.pwm["level"]) * self.pwm["level"]
            sagged = u * max(1 - self.pwm["sag"] * self.load, 0.0)
            self.load += (abs(u) / self.rig.vmax - self.load) / (self.pwm["tau"] * self.rig.rate)
            return sagged
        return u


class Plant:
    """The rig in MuJoCo. ``advance`` is one sample: command in; ``measure`` reads the encoders.

    ``run`` is the recording's number, from 0; ``step`` (s) is MuJoCo's, ``stop`` the damping ratio of the ends of the
    play.
    """

    def __init__(
        self,
        rig: TrueRig,
        effects: Effects,
        alpha: float,
        theta: float = 0.0,
        run: int = 0,
        step: float = STEP,
        stop: float = 1.0,
    ):
        check(effects)
        self.rig, self.effects, self.step, self.stop = rig, effects, step, stop
        self.drive = next((effects[id] for id in ("drive.backlash", "drive.compliance") if id in effects), None)
        self.model = mujoco.MjModel.from_xml_string(self._xml())
        self.data = mujoco.MjData(self.model)
        self.motor = int(self.model.joint("rotor").dofadr[0]) if self.drive else THETA
        self.data.qpos[[THETA, ALPHA, self.motor]] = theta, alpha, theta
        self.reads = [self.motor if self.drive and self.drive.get("encoder") == "motor" else THETA, ALPHA]
        self.substeps = round(1 / (rig.rate * self.step))
        if abs(self.substeps * self.step * rig.rate - 1) > 1e-9:
            raise ValueError(f"rate {rig.rate} does not divide into steps of {self.step} s")
        self.laws = torques(effects, rig, self.motor, self.step)
        self.frictions = frictions(effects, rig, self.motor)
        self.run = run
        self.pulses = pulses(effects, run)
        self.samples = self.steps = 0
        self.clock = Clock(effects.get("x.clock_jitter"), rig.rate, run, step)
        self.supply = Supply(effects, rig)
        self.damping = self.model.dof_damping.copy()
        self.lagged = 0.0  # state of motor.lag, V
        self.queue: list[float] = []  # past commands, newest first, for motor.delay
        self.past: list[np.ndarray] = []  # past readings and their rates, newest first, for sensor.delay

    def _parameter(self, effect: str, name: str) -> float:
        return self.effects.get(effect, {}).get(name, 0.0)

    def _xml(self) -> str:
        rig, p = self.rig, self._parameter
        lean, towards = p("arm.tilt", "angle"), p("arm.tilt", "direction")
        gravity = rig.g * np.array([np.sin(lean) * np.cos(towards), np.sin(lean) * np.sin(towards), -np.cos(lean)])
        cable = "arm.cable" if "arm.cable" in self.effects else "arm.spring"  # stiffness of x, x², x³
        stiffness = " ".join(str(p(cable, name)) for name in ("stiffness", "asymmetry", "cubic"))
        spring = f'stiffness="{stiffness}" springref="{p(cable, "rest")!s}"'
        friction_law = FRICTION.format(step=self.step)
        friction = p("arm.coulomb", "torque") + p("arm.stribeck", "static")  # the latter follows the speed in `advance`
        # damping of w and of |w| w
        damping = f"{rig.arm_damping!s} {p('arm.quadratic', 'coefficient')!s} 0"
        motor = f'damping="{damping}" frictionloss="{friction!s}" {friction_law}'
        arm, (hinge, transverse, axial), armature = principal(rig, p("pendulum.inertia_transverse", "inertia"))
        rod, upper = self._rod(hinge, transverse, axial)
        rotor = tendon = ""
        if self.drive:
            share = float(self.drive["motor_share"]) * rig.arm_inertia
            arm -= share
            rotor = f"""<body name="rotor">
      <joint name="rotor" type="hinge" axis="0 0 1" {motor}/>
      <inertial pos="0 0 0" mass="1" diaginertia="{share!s} {share!s} {share!s}"/>
    </body>"""
            motor, gap = "", p("drive.backlash", "gap")
            if gap:
                ends = STOP.format(constant=5 * self.step, ratio=self.stop)
                coupling = f'limited="true" range="{-gap / 2!s} {gap / 2!s}" {ends}'
            else:
                stiffness, damping = (p("drive.compliance", name) for name in ("stiffness", "damping"))
                coupling = f'stiffness="{stiffness!s}" damping="{damping!s}" springlength="0"'
            joints = '<joint joint="rotor" coef="1"/><joint joint="theta" coef="-1"/>'
            tendon = f'<tendon><fixed name="drive" {coupling}>{joints}</fixed></tendon>'
        alpha_damping = f"{rig.pend_viscous!s} {p('pendulum.quadratic', 'coefficient')!s} 0"
        alpha_rest = self.effects.get("pendulum.spring", {}).get("rest", np.pi)
        return f"""<mujoco>
  <compiler angle="radian"/>
  <option timestep="{self.step}" gravity="{gravity[0]!s} {gravity[1]!s} {gravity[2]!s}"
          integrator="RK4" cone="elliptic" tolerance="1e-10">
    <flag contact="disable" refsafe="disable"/>
  </option>
  <worldbody>
    <body name="arm">
      <joint name="theta" type="hinge" axis="0 0 1" {spring} {motor}/>
      <inertial pos="0 0 0" mass="1" diaginertia="{arm!s} {arm!s} {arm!s}"/>
      <body name="pendulum" pos="{rig.arm_length!s} 0 0">
        <joint name="alpha" type="hinge" axis="1 0 0" armature="{armature!s}" damping="{alpha_damping}"
               stiffness="{p("pendulum.spring", "stiffness")!s}" springref="{alpha_rest!s}"
               frictionloss="{p("pendulum.coulomb", "torque")!s}" {friction_law}/>
        {rod}{upper}
      </body>
    </body>
    {rotor}
  </worldbody>
  {tendon}
</mujoco>"""

    def _rod(self, hinge: float, transverse: float, axial: float) -> tuple[str, str]:
        """The pendulum's mass; with ``x.flexible_rod`` a share of it sits beyond a springy joint, both together as
        heavy as the one."""
        rig, bend = self.rig, self.effects.get("x.flexible_rod")
        if not bend:
            inertia = f"{hinge!s} {transverse!s} {axial!s}"
            return f'<inertial pos="0 0 {rig.pend_com!s}" mass="{rig.pend_mass!s}" diaginertia="{inertia}"/>', ""
        share, com, joint = bend["share"], rig.pend_com, 0.4 * rig.pend_com
        mass, ahead = share * rig.pend_mass, 0.6 * com  # of the upper part, whose middle is so far beyond the whole's
        lever, taken = com + ahead - joint, rig.pend_mass * share / (1 - share) * ahead**2 + LEAST
        lower = f"{hinge - taken!s} {transverse - taken!s} {axial + LEAST!s}"
        below = com - share / (1 - share) * ahead
        stiffness = mass * lever**2 * (2 * np.pi * bend["frequency"]) ** 2
        damping = 2 * bend["damping_ratio"] * mass * lever**2 * 2 * np.pi * bend["frequency"]
        return (
            f'<inertial pos="0 0 {below!s}" mass="{rig.pend_mass - mass!s}" diaginertia="{lower}"/>',
            f"""<body name="upper" pos="0 0 {joint!s}">
          <joint name="bend" type="hinge" axis="1 0 0" stiffness="{stiffness!s}" damping="{damping!s}"/>
          <inertial pos="0 0 {lever!s}" mass="{mass!s}" diaginertia="{LEAST} {LEAST} {LEAST}"/>
        </body>""",
        )

    @property
    def state(self) -> np.ndarray:
        """[theta, alpha, theta_dot, alpha_dot] of arm and pendulum, true, not measured."""
        return np.concatenate([self.data.qpos[:2], self.data.qvel[:2]])

    @property
    def rotor(self) -> np.ndarray:
        """[angle, speed] of the rotor; the arm's without a drive between them."""
        return np.array([self.data.qpos[self.motor], self.data.qvel[self.motor]])

    @property
    def time(self) -> float:
        """Since the recording began, s."""
        return self.steps / (self.substeps * self.rig.rate)

    def _shown(self) -> np.ndarray:
        """What the encoders see now, and how fast it changes: [[theta, alpha], [theta_dot, alpha_dot]]."""
        return np.array([self.data.qpos[self.reads], self.data.qvel[self.reads]])

    def _seen(self) -> np.ndarray:
        """True angles behind the encoders, late by the sensors' delay: the cubic through the samples on either side."""
        late = self._parameter("sensor.delay", "delay") * self.rig.rate
        if late == 0.0:
            return self._shown()[0]
        track = [self._shown(), *self.past]
        whole = int(late)
        if whole + 1 >= len(track):  # before the run: it stood where it began
            return track[-1][0]
        (y1, v1), (y0, v0) = track[whole], track[whole + 1]
        s, h = 1 - (late - whole), 1 / self.rig.rate
        return y0 + s * h * v0 + s * s * (3 * (y1 - y0) - h * (2 * v0 + v1)) + s**3 * (h * (v0 + v1) - 2 * (y1 - y0))

    def measure(self, rng: np.random.Generator | None = None, noise: float = 0.0) -> tuple[float, float]:
        """Encoder angles: late, with offset and scale, noise of ``noise`` counts RMS, rounded to whole counts."""
        angles = self._seen()
        if jitter := self.effects.get("sensor.jitter"):
            angles = angles + untimely(jitter, self.run, self.time) * self._shown()[1]
        axes = ("theta", "alpha")
        discs = np.array([self._parameter(f"x.eccentric_{axis}", "angle") for axis in axes])
        discs += [self._parameter(f"sensor.{axis}.eccentricity", "amplitude") for axis in axes]
        phases = [
            self._parameter(f"x.eccentric_{axis}", "phase") + self._parameter(f"sensor.{axis}.eccentricity", "phase")
            for axis in axes
        ]
        lost = self.effects.get("x.lost_counts", {"angle": 0.0, "time": 0.0})
        jumped = lost["angle"] if self.time >= lost["time"] else 0.0
        angles = angles + discs * np.sin(angles + phases) + [jumped, self._parameter("sensor.alpha.offset", "angle")]
        for axis, name in enumerate(axes):
            gone = self.effects.get(f"sensor.{name}.lost_counts")
            if gone and round(gone["run"]) == self.run and self.time >= gone["time"]:
                angles[axis] += gone["size"]
        angles = angles * [
            self.effects.get(f"sensor.{axis}.scale", {}).get("scale", 1.0) for axis in ("theta", "alpha")
        ]
        per_rad = np.array([self.rig.arm_counts, self.rig.pend_counts]) / (2 * np.pi)
        counts = angles * per_rad + (noise * rng.standard_normal(2) if rng is not None and noise else 0.0)
        theta, alpha = np.round(counts) / per_rad + 0.0  # no negative zeros in the files
        return float(theta), float(alpha)

    def _delayed(self, u: float, steps: int) -> np.ndarray:
        """Command at the motor in each substep: a transport delay of any real length, the substep of the edge
        averaged."""
        delay = self._parameter("motor.delay", "delay") / self.step  # in substeps
        if delay == 0.0:
            return np.full(steps, u)
        whole = int(np.ceil(delay / self.substeps))
        self.queue = ([u] + self.queue)[: whole + 1]
        held = self.queue + [0.0] * (whole + 1 - len(self.queue))
        start = np.arange(steps)
        # average over [start, start + 1] of the command given `delay` substeps earlier
        out = np.zeros(steps)
        for age, value in enumerate(held):  # held during [-age, -age + 1] samples, seen `delay` later
            begin = -age * self.substeps + delay
            end = begin + self.substeps
            out += value * np.clip(np.minimum(start + 1, end) - np.maximum(start, begin), 0.0, 1.0)
        return out

    def _voltage(self, u: float, middles: np.ndarray) -> np.ndarray:
        """What reaches the winding in each substep, in command units."""
        p = self._parameter
        volts = self._delayed(self.supply(u), len(middles))
        if step := p("motor.resolution", "step"):
            volts = step * np.round(volts / step)
        volts = np.sign(volts) * np.maximum(np.abs(volts) - p("motor.deadzone", "width"), 0.0) + p(
            "motor.bias", "voltage"
        )
        limit = self.effects.get("motor.saturation", {}).get("limit", np.inf)
        volts = np.clip(volts, -limit, limit)
        volts = np.where(volts < 0, self.effects.get("motor.asymmetry", {}).get("negative_gain", 1.0), 1.0) * volts
        volts = volts * (1 + p("motor.drift", "rate") * middles)
        constant = p("motor.lag", "time_constant")
        if constant > 0.0:
            keep = np.exp(-self.step / constant)
            # exact for a held input; the mean over the substep is what turns the arm
            for i, target in enumerate(volts):
                start, self.lagged = self.lagged, target + (self.lagged - target) * keep
                volts[i] = target + (start - target) * (1 - keep) * constant / self.step
        return volts

    def _happens(self, event: str) -> bool:
        """Whether one of `EVENTS` goes on."""
        when = self.effects.get(event)
        return bool(when) and round(when["run"]) == self.run and when["from"] <= self.time < when["to"]

    def advance(self, u: float) -> None:
        """Holds the command ``u`` for one sample."""
        rig, data, motor = self.rig, self.data, self.motor
        if "sensor.delay" in self.effects:
            self.past.insert(0, self._shown())
            del self.past[int(self._parameter("sensor.delay", "delay") * rig.rate) + 1 :]
        begin, last = self.time, self.steps
        if self._happens("x.cut_off"):
            u = 0.0
        for axis, event in ((ALPHA, "x.held_pendulum"), (THETA, "x.held_arm")):
            hand = self._parameter(event, "damping") if self._happens(event) else 0.0
            self.model.dof_damping[axis] = self.damping[axis] + hand
        self.samples += 1
        self.steps = self.clock.step(self.samples, last)
        edges = begin + self.step * np.arange(self.steps - last + 1)
        middles = edges[:-1] + self.step / 2
        planned = np.zeros((self.steps - last, self.model.nv))  # what does not depend on the motion
        planned[:, motor] = self._voltage(float(np.clip(u, -rig.vmax, rig.vmax)), middles) * rig.torque_per_volt
        turning = planned[:, motor].copy()  # the motor's part of the torque on its axis
        planned[:, ALPHA] += self._parameter("pendulum.bias", "torque")
        for axis, start, end, torque in self.pulses:
            planned[:, axis] += (
                torque * np.clip(np.minimum(edges[1:], end) - np.maximum(edges[:-1], start), 0.0, self.step) / self.step
            )
        if not (self.laws or self.frictions):  # constant within stretches: MuJoCo's own loop is faster
            for torque, stretch in itertools.groupby(planned.tolist()):
                data.qfrc_applied[:] = torque
                mujoco.mj_step(self.model, data, nstep=len(list(stretch)))
            return
        for t, driving, torque in zip(middles, turning, planned):
            # torques are held for the step: taken at its middle, extrapolated, they are right to second order
            speed = data.qvel + 0.5 * self.step * data.qacc
            angle = data.qpos + 0.5 * self.step * (data.qvel + 0.25 * self.step * data.qacc)
            for axis, law in self.laws:
                torque[axis] += law(t, angle, speed, driving)
            if self.frictions:
                limit = sum(law(t, angle, speed, driving) for law in self.frictions)
                self.model.dof_frictionloss[motor] = self._parameter("arm.coulomb", "torque") + limit
            data.qfrc_applied[:] = torque
            mujoco.mj_step(self.model, data)
