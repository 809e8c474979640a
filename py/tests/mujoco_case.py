"""Recordings of the MuJoCo rig, as an owner would make them: two hanging runs with a rich command and one balanced
upright.

A case is a folder with a data sheet (``rig.toml``, a few per cent off the truth), recordings (``run-*.csv``) and
``truth.json``. Each recording counts from zeros of its own: the arm's encoder from where the arm rested when it was
switched on, the pendulum's from where friction held it. Everything else, in the plant as in the truth, is in the true
frame: theta from the base's x axis, alpha from upright.

    python py/tests/mujoco_case.py --out DIR --rig qube-like --effect arm.coulomb \\
        --effect motor.delay:delay=0.011 --seed 7
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import pathlib

import numpy as np
from mujoco_effects import SECONDS, Effects, hide
from mujoco_plant import Plant
from mujoco_rig import FAMILIES, TrueRig, data_sheet, draw_rig, rig_toml
from scipy.linalg import solve_discrete_are
from scipy.signal import cont2discrete

FALLEN = 0.6  # rad from upright at which a balance run is given up


class Velocity:
    """Differenced and low-passed encoder angles: the velocity estimate of a plain laboratory controller."""

    def __init__(self, h: float, angles: np.ndarray, corner: float = 2 * np.pi * 25):
        self.h, self.keep, self.last, self.value = h, float(np.exp(-corner * h)), angles, np.zeros(2)

    def __call__(self, angles: np.ndarray) -> np.ndarray:
        self.value = self.keep * self.value + (1 - self.keep) * (angles - self.last) / self.h
        self.last = angles
        return self.value


def multisine(rig: TrueRig, t: np.ndarray, rng: np.random.Generator, rms: float = 0.27) -> np.ndarray:
    """A dozen sines from 0.4 to 6 Hz with random phases, RMS in command limits; 0.3 s of rest before."""
    frequencies = rng.uniform(0.4, 6.0, 12)
    sines = np.sin(2 * np.pi * np.outer(t - 0.3, frequencies) + rng.uniform(0, 2 * np.pi, 12)).sum(axis=1)
    return rig.vmax * rms * sines / np.sqrt(6.0) * (t > 0.3)


def steps(rig: TrueRig, t: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Levels of either sign held for a quarter of a second to a second and a quarter; one second of rest before."""
    u, begin = np.zeros_like(t), 1.0
    while begin < t[-1]:
        end = begin + rng.uniform(0.25, 1.25)
        u[(t >= begin) & (t < end)] = rig.vmax * rng.choice([-1, 0, 1], p=[0.4, 0.2, 0.4]) * rng.uniform(0.15, 0.75)
        begin = end
    return u


def decay(rig: TrueRig, effects: Effects, run: int, samples: int, rng: np.random.Generator, noise: float) -> np.ndarray:
    """Rows of a run in which the pendulum is lifted by one to two radians and let go, the command zero throughout."""
    lifted = np.pi + rng.choice([-1.0, 1.0]) * rng.uniform(1.0, 2.0)
    plant, rows = Plant(rig, effects, alpha=lifted, run=run), []
    for k in range(samples):
        rows.append((k / rig.rate, 0.0, *plant.measure(rng, noise)))
        plant.advance(0.0)
    return np.array(rows)


def hanging(
    rig: TrueRig, effects: Effects, run: int, excitation: np.ndarray, rng: np.random.Generator, noise: float
) -> np.ndarray:
    """Rows t, u, theta, alpha of a run from rest; a weak spring in software keeps the arm near the middle of its
    cable."""
    plant, rows = Plant(rig, effects, alpha=np.pi, run=run), []
    velocity = Velocity(1 / rig.rate, np.array(plant.measure()))
    for k, wanted in enumerate(excitation):
        angles = np.array(plant.measure(rng, noise))
        arm_speed = velocity(angles)[0]
        u = (
            0.0
            if k < 0.3 * rig.rate
            else float(np.clip(wanted - rig.vmax * (0.15 * angles[0] + 0.004 * arm_speed), -rig.vmax, rig.vmax))
        )
        u = round(u, 6)  # what is logged is what was applied
        rows.append((k / rig.rate, u, *angles))
        plant.advance(u)
    return np.array(rows)


def upright(rig: TrueRig) -> tuple[np.ndarray, np.ndarray]:
    """x' = A x + B u about the upright, from textbook mass matrix and gravity (a controller's model: it needs no
    more)."""
    m, c, length = rig.pend_mass, rig.pend_com, rig.arm_length
    mass = np.array(
        [[rig.arm_inertia + m * length**2, -m * length * c], [-m * length * c, rig.pend_inertia + m * c**2]]
    )
    stiffness, damping = np.diag([0.0, rig.gravity_torque]), np.diag([rig.arm_damping, rig.pend_viscous])
    a = np.block([[np.zeros((2, 2)), np.eye(2)], [np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)]])
    return a, np.concatenate([np.zeros(2), np.linalg.solve(mass, [rig.torque_per_volt, 0.0])])[:, None]


def dlqr(rig: TrueRig, delay: int, softness: float) -> np.ndarray:
    """LQR gain over [state, the last ``delay`` commands]."""
    a, b, *_ = cont2discrete((*upright(rig), np.eye(4), np.zeros((4, 1))), 1 / rig.rate)
    n = 4 + delay
    big, entry = np.zeros((n, n)), np.zeros((n, 1))
    big[:4, :4] = a
    if delay:  # a chain of past commands, oldest acting now
        big[:4, [n - 1]] = b
        big[5:, 4:-1] = np.eye(delay - 1)
        entry[4] = 1.0
    else:
        entry[:4] = b
    weight = np.zeros((n, n))
    weight[:4, :4] = np.diag([1.0, 4.0, 0.02, 0.02])
    effort = np.array([[softness * 30.0 / rig.vmax**2]])
    p = solve_discrete_are(big, entry, weight + 1e-9 * np.eye(n), effort)
    return np.linalg.solve(effort + entry.T @ p @ entry, entry.T @ p @ big)[0]


def balance(
    rig: TrueRig,
    effects: Effects,
    run: int,
    samples: int,
    rng: np.random.Generator,
    noise: float,
    softness: float,
    delay: int,
) -> np.ndarray:
    """Rows of a run balanced upright by an LQR on differenced encoders, the arm sent back and forth; ends where it
    falls."""
    plant, rows, gain = Plant(rig, effects, alpha=0.02, run=run), [], dlqr(rig, delay, softness)
    velocity, past = Velocity(1 / rig.rate, np.array(plant.measure())), [0.0] * delay
    t = np.arange(samples) / rig.rate
    reference = 0.25 * np.sign(np.sin(2 * np.pi * 0.23 * t + rng.uniform(0, 2 * np.pi))) * (t > 1.0)
    dither = multisine(rig, t, rng, rms=0.02)
    for k in range(samples):
        angles = np.array(plant.measure(rng, noise))
        if abs(angles[1]) > FALLEN:
            break
        x = np.concatenate([angles - [reference[k], 0.0], velocity(angles), past])
        u = round(float(np.clip(dither[k] - gain @ x, -rig.vmax, rig.vmax)), 6)
        past = ([u] + past)[:delay]
        rows.append((t[k], u, *angles))
        plant.advance(u)
    return np.array(rows)


def record(
    rig: TrueRig, effects: Effects, run: int, kind: str, rng: np.random.Generator, noise: float, seconds: float
) -> np.ndarray:
    """Run number ``run``. Like its owner, tries again with a tamer command or a softer gain when the pendulum goes
    over, or falls."""
    samples = round(seconds * rig.rate)
    t = np.arange(samples) / rig.rate
    if kind == "balance":
        late = (("motor.delay", "delay"), ("motor.lag", "time_constant"), ("sensor.delay", "delay"))
        delay = sum(effects.get(effect, {}).get(name, 0.0) for effect, name in late)
        best = np.empty((0, 4))
        for softness, lead in (
            (1.0, 0),
            (1.0, round(delay * rig.rate)),
            (0.2, 0),
            (5.0, round(delay * rig.rate)),
            (0.2, round(delay * rig.rate)),
        ):
            rows = balance(rig, effects, run, samples, rng, noise, softness, lead)
            best = max(best, rows, key=len)
            if len(best) == samples:
                break
        return best
    if kind == "decay":
        return decay(rig, effects, run, samples, rng, noise)
    excitation = {"multisine": multisine, "steps": steps}[kind](rig, t, rng)
    for _ in range(8):
        rows = hanging(rig, effects, run, excitation, rng, noise)
        if np.abs(rows[:, 3] - np.pi).max() < 2.6:
            break
        excitation = 0.75 * excitation
    return rows


def draw_zeros(rig: TrueRig, rng: np.random.Generator) -> np.ndarray:
    """Counts that one recording adds to [theta, alpha].

    The arm rested anywhere within 1.5 rad, friction held the pendulum a few counts from hanging.
    """
    arm = rng.uniform(-1.5, 1.5) * rig.arm_counts / (2 * np.pi)
    return np.round([arm, 1.5 * rng.standard_normal()])


def write_case(
    folder: pathlib.Path, rig: TrueRig, effects: Effects, *, seed: int, spread: float, noise: float = 0.0,
    seconds: float = SECONDS, runs: list[str] = ("multisine", "steps", "balance"), length_error: float = 0.03,
    own_zeros: bool = True,
) -> None:  # fmt: skip
    """Writes rig.toml (the data sheet, off by ``spread``, its arm length by up to ``length_error``), run-*.csv and
    truth.json.

    The zeros have a stream of their own: without them, the same seed makes the same recordings in the true frame.
    """
    rng = np.random.default_rng(10_000 + seed)
    laboratory = rng.spawn(1)[0]
    sheet = data_sheet(rig, rng, spread, length_error)
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob("run-*.csv"):
        old.unlink()
    (folder / "rig.toml").write_text(rig_toml(sheet))
    kept, zeros = {}, []
    for i, kind in enumerate(runs):
        rows = record(rig, effects, i, kind, rng, noise, seconds)
        kept[kind] = [len(rows) == round(seconds * rig.rate), len(rows)]
        counts = draw_zeros(rig, laboratory) if own_zeros else np.zeros(2)
        zero = counts * 2 * np.pi / [rig.arm_counts, rig.pend_counts]
        zeros.append({"run": i, "theta": zero[0], "alpha": zero[1]})
        if len(rows) > rig.rate:  # a run of less than a second is not worth keeping
            rows[:, 2:] += zero
            np.savetxt(
                folder / f"run-{i}-{kind}.csv",
                rows,
                fmt=["%.6f", "%.6f", "%.7f", "%.7f"],
                delimiter=",",
                header="t,u,theta,alpha",
                comments="",
            )
    truth = {"rig": rig.name, "effects": effects, "seed": seed, "spread": spread, "noise_counts": noise, "runs": kept}
    truth |= {"zeros": zeros, "arm_length": {"true": rig.arm_length, "data_sheet": sheet.arm_length}}
    truth["true_rig"] = {k: v for k, v in vars(rig).items() if k != "name"} | {"dt": 1e-4}
    (folder / "truth.json").write_text(json.dumps(truth, indent=1))


def main() -> None:
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument("--out", required=True, type=pathlib.Path, help="folder of the case, made if absent")
    a.add_argument("--rig", default="qube-like", choices=sorted(FAMILIES))
    a.add_argument(
        "--effect",
        action="append",
        default=[],
        metavar="ID[:NAME=VALUE,...]",
        help="hide this; sizes are drawn where not given; none: a clean case",
    )
    a.add_argument("--size", type=float, default=1.0, help="times the usual size of drawn effects")
    a.add_argument("--seed", type=int, default=1)
    a.add_argument("--spread", type=float, default=0.03, help="relative error of the data sheet")
    a.add_argument("--noise", type=float, default=0.0, help="encoder noise in counts RMS, beside the rounding")
    a.add_argument("--rate", type=float, help="samples per second (a divisor of 10000)")
    a.add_argument("--seconds", type=float, default=SECONDS, help="length of each run")
    a.add_argument(
        "--runs", default="multisine,steps,balance", help="of multisine, steps, decay and balance, in this order"
    )
    a.add_argument(
        "--length-error",
        type=float,
        default=0.03,
        help="largest relative error of the data sheet's arm length; 0: exact",
    )
    zeros = a.add_mutually_exclusive_group()
    zeros.add_argument(
        "--own-zeros",
        action="store_true",
        default=True,
        help="each recording counts from zeros of its own (the usual case)",
    )
    zeros.add_argument(
        "--same-zero", dest="own_zeros", action="store_false", help="all recordings count from the true frame's zeros"
    )
    a = a.parse_args()
    rng = np.random.default_rng(a.seed)
    rig = draw_rig(a.rig, rng)
    if a.rate:
        rig = dataclasses.replace(rig, rate=a.rate)
    given = {effect: pairs for effect, _, pairs in (entry.partition(":") for entry in a.effect)}
    rig, effects = hide(rig, tuple(given), rng, a.size)
    for effect, pairs in given.items():
        values = dict(pair.split("=") for pair in pairs.split(",") if pair)
        effects[effect] |= {name: value if name == "encoder" else float(value) for name, value in values.items()}
    write_case(
        a.out, rig, effects, seed=a.seed, spread=a.spread, noise=a.noise, seconds=a.seconds, runs=a.runs.split(","),
        length_error=a.length_error,
        own_zeros=a.own_zeros,
    )  # fmt: skip


if __name__ == "__main__":
    main()
