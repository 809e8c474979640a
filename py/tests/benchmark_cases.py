"""The cases of the benchmark: what is hidden, in what kind of rig, recorded how. Another seed is another set."""

from __future__ import annotations

import dataclasses
import itertools
import pathlib
import tempfile

import numpy as np
from mujoco_case import write_case
from mujoco_effects import EFFECTS, FOREIGN, IMPOSSIBLE, SECONDS, hide
from mujoco_foreign import EVENTS
from mujoco_rig import FAMILIES, TrueRig, draw_rig

# Pairs whose order in the motor matters or which recordings cannot tell from one effect are not asked for.
UNASKED = (
    {"motor.deadzone", "motor.lag"},
    {"motor.deadzone", "motor.bias"},
    {"motor.delay", "motor.lag"},
    {"motor.delay", "sensor.delay"},
    *IMPOSSIBLE,
)


@dataclasses.dataclass(frozen=True)
class Case:
    """What to hide, in what kind of rig, recorded how."""

    name: str
    family: str
    effects: tuple[str, ...]
    seed: int
    size: float = 1.0
    spread: float = 0.03
    noise: float = 0.0
    rate: float | None = None
    runs: tuple[str, ...] = ("multisine", "steps", "balance")
    seconds: float = SECONDS
    length_error: float = 0.0  # of the data sheet's arm length
    own_zeros: bool = False  # of each recording
    encoder: str | None = None  # side of the drive on which theta is read: arm or motor; None: drawn
    limit: float | None = None  # of the voltage, as a share of the largest command that is given without it

    def write(self, folder: pathlib.Path) -> str:
        rng = np.random.default_rng(self.seed)
        rig = draw_rig(self.family, rng)
        if self.rate:
            rig = dataclasses.replace(rig, rate=self.rate)
        rig, effects = hide(rig, self.effects, rng, self.size)
        if self.encoder:
            for drive in effects.keys() & DRIVES:
                effects[drive]["encoder"] = self.encoder
        if self.limit:
            with tempfile.TemporaryDirectory() as free:
                unlimited = {key: value for key, value in effects.items() if key != "motor.saturation"}
                self.record(pathlib.Path(free), rig, unlimited)
                runs = [np.genfromtxt(run, delimiter=",", names=True) for run in pathlib.Path(free).glob("run-*.csv")]
            effects["motor.saturation"] = {"limit": self.limit * max(np.abs(run["u"]).max() for run in runs)}
        self.record(folder / self.name, rig, effects)
        return self.name

    def record(self, folder: pathlib.Path, rig: TrueRig, effects: dict[str, dict[str, object]]) -> None:
        write_case(
            folder, rig, effects, seed=self.seed, spread=self.spread, noise=self.noise,
            seconds=self.seconds, runs=self.runs,
            length_error=self.length_error, own_zeros=self.own_zeros,
        )  # fmt: skip


def plan(seed: int) -> list[Case]:
    """Every effect twice at its usual size, clean ones, pairs, foreign effects, small effects under rough conditions,
    triples, and all that is hard at once."""
    rng = np.random.default_rng(seed)
    families, cases = sorted(FAMILIES), []

    def add(group: str, effects: tuple[str, ...], **conditions: float) -> None:
        family = (
            families[(len(cases) + seed) % len(families)]
            if not group.startswith("usual")
            else families[int(rng.integers(len(families)))]
        )
        cases.append(Case(f"{len(cases):03d}-{group}", family, effects, 1000 * seed + len(cases), **conditions))

    # The newest comes last, and into no draw: a seed's other cases stay what they were.
    known = tuple(effect for effect in EFFECTS if effect != "motor.ripple")
    for effect in known * 2:
        add("usual", (effect,))
    for i in range(6):
        add("clean", (), spread=(0.03, 0.1, 0.2)[i % 3], noise=(0.0, 0.0, 0.5, 0.3, 0.0, 1.0)[i])
    pairs = [pair for pair in itertools.combinations(known, 2) if set(pair) not in UNASKED]
    for i in rng.choice(len(pairs), 8, replace=False):
        add("pair", pairs[i], spread=0.05)
    for effect in FOREIGN[:3]:  # the others came later: below
        add("foreign", (effect,))
    for effect in rng.choice(known, 8, replace=False):
        add("small", (str(effect),), size=1 / 3, spread=float(rng.choice([0.03, 0.1, 0.2])),
            noise=float(rng.choice([0.0, 0.3, 1.0])),
            rate=float(rng.choice([200, 400, 500, 1000])))  # fmt: skip
    triples = [
        three
        for three in itertools.combinations(known, 3)
        if not any(set(pair) in UNASKED for pair in itertools.combinations(three, 2))
    ]
    for i in rng.choice(len(triples), 6, replace=False):
        add("triple", triples[i], spread=0.05)
    # One to three effects of a third of the usual size, under rough conditions, in two runs.
    for i in range(12):
        effects = ((str(rng.choice(known)),), pairs[rng.integers(len(pairs))], triples[rng.integers(len(triples))])[
            i % 3
        ]
        # Kicks fall into one of the first two runs, which hang: upright the pendulum would go over.
        runs = (
            ("multisine", "steps")
            if any("kick" in effect for effect in effects)
            else (str(rng.choice(["multisine", "steps"])), "balance")
        )
        add("hard", effects, size=1 / 3, spread=float(rng.choice([0.1, 0.2])), noise=float(rng.choice([0.0, 0.3, 1.0])),
            rate=float(rng.choice([200, 400, 500, 1000])), runs=runs)  # fmt: skip
    for _ in range(2):
        add("usual", ("motor.ripple",))
    return cases + laboratory(seed, len(cases))


DRIVES = {"drive.backlash", "drive.compliance"}

# Where there is little back-EMF, a winding's lag is the amplifier's (motor.lag), a limit of the current one of the
# voltage (motor.saturation).
GEARED = {"x.inductance", "x.current_limit"}


def conditions(rng: np.random.Generator) -> dict[str, object]:
    """How laboratories record: three runs of 10 s, each with zeros of its own, noisy encoders.

    The sheet is 6 to 12 % off, its lengths within 3 %.
    """
    return {
        "spread": float(rng.uniform(0.06, 0.12)), "noise": float(rng.choice([0.0, 0.3, 0.6])),
        "rate": float(rng.choice([250, 400, 500])), "seconds": 10.0,
        "runs": (("multisine", "steps", "balance"), ("multisine", "decay", "balance"),
                 ("multisine", "steps", "decay"))[int(rng.integers(3))],
        "length_error": 0.03, "own_zeros": True,
    }  # fmt: skip


def askable(ids: tuple[str, ...]) -> bool:
    """Whether recordings can tell these effects from one another, and the plant has room for them."""
    return len(set(ids)) == len(ids) and not any(pair <= set(ids) for pair in map(set, UNASKED))


def laboratory(seed: int, first: int) -> list[Case]:
    """The groups recorded as laboratories record: `rough`, 45 of `foreign`, `lookalike`, `seldom`, `event`; from
    ``first`` on.

    Each group has a stream of its own.
    """
    families, cases = sorted(FAMILIES), []

    def add(rng: np.random.Generator, group: str, effects: tuple[str, ...], **more: object) -> None:
        number = first + len(cases)
        family = families[int(rng.integers(len(families)))]
        family = "srv02-like" if GEARED & set(effects) else family
        cases.append(
            Case(f"{number:03d}-{group}", family, effects, 1000 * seed + number, **conditions(rng), **more)
        )

    def beside(rng: np.random.Generator, effect: str, taken: tuple[str, ...] = ()) -> str:
        """A catalogue effect that can be told from this one."""
        others = [other for other in EFFECTS if other not in taken and askable((effect, other))]
        return str(rng.choice(others))

    rng = np.random.default_rng([seed, 1])
    for _ in range(16):
        add(rng, "rough", ())
    for effect in rng.permutation(EFFECTS)[:22]:
        add(rng, "rough", (str(effect),))
    for effect in rng.choice(EFFECTS, 10, replace=False):
        add(rng, "rough", (str(effect), beside(rng, str(effect))))

    # with the three above: each kind alone, 32 in all, and 16 with an effect beside
    rng = np.random.default_rng([seed, 2])
    alone = [*FOREIGN[3:], *rng.permutation(FOREIGN)]
    for effect in alone[:29]:
        add(rng, "foreign", (str(effect),))
    for effect in rng.permutation(FOREIGN)[:16]:
        add(rng, "foreign", (str(effect), beside(rng, str(effect))))

    rng = np.random.default_rng([seed, 3])
    friction = ("arm.coulomb", "arm.stribeck", "arm.presliding")
    for i in range(10):
        law = friction[i % 2]
        add(rng, "lookalike", (law, beside(rng, law, friction)))
    for i in range(10):
        add(
            rng,
            "lookalike",
            (
                ("disturbance.kick",),
                ("arm.tilt",),
                ("disturbance.arm_kick",),
                ("arm.tilt", "disturbance.kick"),
                ("arm.tilt",),
            )[i % 5],
        )
    for i in range(10):
        add(rng, "lookalike", (("drive.backlash", "drive.compliance")[i % 2],), encoder=("arm", "motor")[i // 2 % 2])
    for i in range(10):
        add(rng, "lookalike", ("arm.coulomb", "drive.compliance"), encoder=("arm", "motor")[i % 2])

    # what acts once beside what acts once, and a limit of the voltage that only the highest peaks reach
    rng = np.random.default_rng([seed, 4])
    once = ("disturbance.kick", "disturbance.arm_kick", "sensor.theta.lost_counts", "sensor.alpha.lost_counts")
    for i, pair in enumerate(rng.permutation(list(itertools.combinations(once, 2)) * 2)[:10]):
        pair = tuple(str(effect) for effect in pair)
        add(rng, "seldom", pair if i % 2 else (*pair, beside(rng, pair[0], once)))
    for i in range(10):
        others = () if i % 2 else (beside(rng, "motor.saturation", ("motor.saturation", *once)),)
        add(rng, "seldom", ("motor.saturation", *others), limit=float(rng.uniform(0.85, 0.95)))

    # what happens for a while in one of the two recordings that the motor drives, alone and beside an effect
    rng = np.random.default_rng([seed, 5])
    for i in range(12):
        event = EVENTS[i % len(EVENTS)]
        add(rng, "event", (event,) if i < 6 else (event, beside(rng, event, once)))
        cases[-1] = dataclasses.replace(cases[-1], runs=("multisine", "steps", "balance"))
    return cases
