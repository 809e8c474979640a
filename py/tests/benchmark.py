"""Fresh hidden-effect cases and a table of how many `furuta diagnose` names: for judging a change without fitting to one set.

    python py/tests/benchmark.py --seed 1 --out out/bench-1          # makes the cases if they are not there, then scores
    python py/tests/benchmark.py --seed 1 --out out/bench-1 --only-generate
    python py/tests/benchmark.py --out out/bench-1 --groups usual,clean --jobs 2
    python py/tests/benchmark.py --seed 1 --out out/limit-1 --near-the-limit --jobs 2

`--near-the-limit` hides one effect so small that the data say little of it: 3 to 25 times the standard deviation with which the recordings determine its
strength (the Cramer-Rao bound, which `furuta diagnose` of the same rig without the effect reports in `limits`).

Another seed is another set of rigs, sizes, pairs and data sheets. The program under test sees a copy without truth.json.
"""

from __future__ import annotations

import argparse
import concurrent.futures
import dataclasses
import itertools
import json
import pathlib
import shlex
import shutil
import subprocess
import tempfile
import time

import numpy as np
from mujoco_case import write_case
from mujoco_effects import EFFECTS, FOREIGN, IMPOSSIBLE, draw_effect, hide
from mujoco_rig import FAMILIES, draw_rig

# Pairs whose order in the motor matters or which recordings cannot tell from one effect are not asked for.
UNASKED = ({"motor.deadzone", "motor.lag"}, {"motor.deadzone", "motor.bias"}, {"motor.delay", "motor.lag"}, {"motor.delay", "sensor.delay"}, *IMPOSSIBLE)


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

    def write(self, folder: pathlib.Path) -> str:
        rng = np.random.default_rng(self.seed)
        rig = draw_rig(self.family, rng)
        if self.rate:
            rig = dataclasses.replace(rig, rate=self.rate)
        rig, effects = hide(rig, self.effects, rng, self.size)
        write_case(folder / self.name, rig, effects, seed=self.seed, spread=self.spread, noise=self.noise, runs=self.runs)
        return self.name


def plan(seed: int) -> list[Case]:
    """Every effect twice at its usual size, clean ones, pairs, foreign effects, small effects under rough conditions, triples, and all that is hard at once."""
    rng = np.random.default_rng(seed)
    families, cases = sorted(FAMILIES), []

    def add(group: str, effects: tuple[str, ...], **conditions: float) -> None:
        family = families[(len(cases) + seed) % len(families)] if not group.startswith("usual") else families[int(rng.integers(len(families)))]
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
    for effect in FOREIGN:
        add("foreign", (effect,))
    for effect in rng.choice(known, 8, replace=False):
        add("small", (str(effect),), size=1 / 3, spread=float(rng.choice([0.03, 0.1, 0.2])), noise=float(rng.choice([0.0, 0.3, 1.0])),
            rate=float(rng.choice([200, 400, 500, 1000])))  # fmt: skip
    triples = [three for three in itertools.combinations(known, 3) if not any(set(pair) in UNASKED for pair in itertools.combinations(three, 2))]
    for i in rng.choice(len(triples), 6, replace=False):
        add("triple", triples[i], spread=0.05)
    # One to three effects of a third of the usual size, under rough conditions, in two runs.
    for i in range(12):
        effects = ((str(rng.choice(known)),), pairs[rng.integers(len(pairs))], triples[rng.integers(len(triples))])[i % 3]
        # Kicks fall into one of the first two runs, which hang: upright the pendulum would go over.
        runs = ("multisine", "steps") if any("kick" in effect for effect in effects) else (str(rng.choice(["multisine", "steps"])), "balance")
        add("hard", effects, size=1 / 3, spread=float(rng.choice([0.1, 0.2])), noise=float(rng.choice([0.0, 0.3, 1.0])),
            rate=float(rng.choice([200, 400, 500, 1000])), runs=runs)  # fmt: skip
    for _ in range(2):
        add("usual", ("motor.ripple",))
    return cases


# Effects with one strength, for which the tool reports how large they could still be.
FAINT = (
    "arm.coulomb", "arm.quadratic", "arm.spring", "arm.tilt", "motor.deadzone", "motor.bias", "motor.lag", "motor.asymmetry", "motor.drift",
    "pendulum.coulomb", "pendulum.quadratic", "pendulum.spring", "pendulum.bias", "sensor.alpha.offset", "sensor.alpha.scale", "sensor.theta.scale",
)  # fmt: skip
SIGMAS = (3, 4, 6, 12, 25)


def make_faint(seed: int, out: pathlib.Path, command: list[str], effects: list[str]) -> None:
    """Each effect (of `FAINT`) once at each of `SIGMAS` times its standard deviation, and the same rigs without."""
    families = sorted(FAMILIES)
    for i, effect in enumerate(FAINT):
        if effect not in effects:
            continue
        case = Case(f"{i:03d}-clean", families[(i + seed) % len(families)], (), 1000 * seed + i, spread=(0.03, 0.1, 0.2)[i % 3], noise=(0.0, 0.3, 1.0)[i // 3 % 3])
        if not (out / case.name / "truth.json").exists():
            case.write(out)
        answer = json.loads(subprocess.run([*command, "diagnose", *map(str, sorted((out / case.name).glob("run-*.csv"))), "--rig", str(out / case.name / "rig.toml"), "--json"], capture_output=True, text=True, check=True).stdout)  # fmt: skip
        limit = next((limit for limit in answer["limits"] if limit["id"] == effect), None)
        if limit is None:
            print(case.name, effect, "has no limit here", answer["verdict"], flush=True)
            continue
        # The size at which the effect is as strong as its standard deviation, its other draws as they will be.
        rng = np.random.default_rng(case.seed)
        usual = draw_effect(effect, draw_rig(case.family, rng), rng)
        off = 1.0 if limit["parameter"] in ("negative_gain", "scale") else 0.0
        for sigma in SIGMAS:
            name = f"{i:03d}-{sigma}sigma"
            if not (out / name / "truth.json").exists():
                size = sigma * limit["std"] / abs(float(usual[limit["parameter"]]) - off)
                dataclasses.replace(case, name=name, effects=(effect,), size=size).write(out)
                print("made", name, effect, f"size {size:.2g}", flush=True)


def score(command: list[str], case: pathlib.Path, limit: float) -> dict[str, object]:
    """Runs the program on a copy of the case and compares its answer with the truth."""
    truth = json.loads((case / "truth.json").read_text())
    wanted, begin = set(truth["effects"]), time.perf_counter()
    with tempfile.TemporaryDirectory() as copy:
        for file in [case / "rig.toml", *sorted(case.glob("run-*.csv"))]:
            shutil.copy(file, copy)
        runs = sorted(map(str, pathlib.Path(copy).glob("run-*.csv")))
        try:
            done = subprocess.run([*command, "diagnose", *runs, "--rig", f"{copy}/rig.toml", "--json"], capture_output=True, text=True, timeout=limit)
            answer = json.loads(done.stdout)
        except subprocess.TimeoutExpired:
            answer, error = None, f"no answer in {limit} s"
        except ValueError:  # no JSON: it failed
            answer, error = None, (done.stderr.strip().splitlines() or ["no answer"])[-1]
    row = {"case": case.name, "wanted": sorted(wanted), "seconds": time.perf_counter() - begin}
    if answer is None:
        return row | {"got": [error], "verdict": "error", "exact": False, "close": False}
    got = {e["id"] for e in answer["effects"]}
    rivals = got | {r for e in answer["effects"] for r in e.get("confusable_with", [])}
    if any(effect in FOREIGN for effect in wanted):
        exact = answer["verdict"] == "unexplained"
    elif not wanted:
        exact = not got and answer["verdict"] in ("no_gap", "parameters_only")
    else:
        exact = got == wanted
    close = exact or (bool(wanted) and wanted <= rivals and len(got) == len(wanted))
    return row | {"got": sorted(got), "verdict": answer["verdict"], "exact": exact, "close": close}


def main() -> None:
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument("--out", type=pathlib.Path, required=True)
    a.add_argument("--seed", type=int, default=1)
    a.add_argument("--cli", default="target/release/furuta")
    a.add_argument("--jobs", type=int, default=1)
    a.add_argument("--limit", type=float, default=300, help="seconds for one case")
    a.add_argument("--groups", default="", help="only these, e.g. usual,clean")
    a.add_argument("--near-the-limit", action="store_true", help="effects of 3 to 25 standard deviations in place of the usual groups")
    a.add_argument("--effects", default=",".join(FAINT), help="of --near-the-limit, only these")
    a.add_argument("--only-generate", action="store_true")
    a = a.parse_args()
    if a.near_the_limit:
        make_faint(a.seed, a.out, shlex.split(a.cli), a.effects.split(","))
    wanted = [] if a.near_the_limit else [case for case in plan(a.seed) if not a.groups or case.name.split("-", 1)[1] in a.groups.split(",")]
    missing = [case for case in wanted if not (a.out / case.name / "truth.json").exists()]
    with concurrent.futures.ProcessPoolExecutor(2) as pool:
        for name in pool.map(Case.write, missing, [a.out] * len(missing)):
            print("made", name, flush=True)
    if a.only_generate:
        return
    folders = sorted(p.parent for p in a.out.glob("*/truth.json"))
    groups = list(dict.fromkeys(f.name.split("-", 1)[1] for f in folders))
    groups = [g for g in groups if not a.groups or g in a.groups.split(",")]
    folders = [f for f in folders if f.name.split("-", 1)[1] in groups]
    rows = []
    with concurrent.futures.ThreadPoolExecutor(a.jobs) as pool:
        for row in pool.map(lambda f: score(shlex.split(a.cli), f, a.limit), folders):
            rows.append(row)
            mark = "ok  " if row["exact"] else "near" if row["close"] else "MISS"
            print(f"{row['case']:14} {mark} wanted {','.join(row['wanted']) or '-':40} got {','.join(row['got']) or '-'}  {row['verdict']}  {row['seconds']:.1f} s", flush=True)
    print(f"{'group':10} {'exact':>8} {'near':>6} {'seconds':>8}")
    for group in [*groups, "all"]:
        of = [r for r in rows if group in ("all", r["case"].split("-", 1)[1])]
        exact, near = sum(r["exact"] for r in of), sum(r["close"] and not r["exact"] for r in of)
        print(f"{group:10} {f'{exact}/{len(of)}':>8} {near:6d} {np.median([r['seconds'] for r in of]):8.1f}")


if __name__ == "__main__":
    main()
