"""Fresh hidden-effect cases and a table of how many `furuta diagnose` names.

For judging a change without fitting to one set. Makes the cases if they are not there, then scores:

    python py/tests/benchmark.py --seed 1 --out out/bench-1
    python py/tests/benchmark.py --seed 1 --out out/bench-1 --only-generate
    python py/tests/benchmark.py --out out/bench-1 --groups usual,clean --jobs 2
    python py/tests/benchmark.py --seed 1 --out out/rough-1 --groups rough,foreign,lookalike   # as laboratories record
    python py/tests/benchmark.py --seed 1 --out out/limit-1 --near-the-limit --jobs 2

`--near-the-limit` hides one effect so small that the data say little of it: 3 to 25 times the standard deviation with
which the recordings determine its strength (the Cramer-Rao bound, which `furuta diagnose` of the same rig without the
effect reports in `limits`).

A foreign case (what no catalogue has, alone or with a catalogue effect beside) counts as exact when the verdict is
`unexplained`, nothing false is named, and the effect beside is; the table counts the three apart, too.

Another seed is another set of rigs, sizes, pairs and data sheets. The program under test sees a copy without
truth.json.
"""

from __future__ import annotations

import argparse
import concurrent.futures
import dataclasses
import json
import pathlib
import shlex
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterable

import numpy as np
from benchmark_cases import Case, plan
from mujoco_effects import FOREIGN, draw_effect
from mujoco_rig import FAMILIES, draw_rig

# Effects with one strength, for which the tool reports how large they could still be.
FAINT = (
    "arm.coulomb", "arm.quadratic", "arm.spring", "arm.tilt", "motor.deadzone", "motor.bias", "motor.lag",
    "motor.asymmetry", "motor.drift",
    "pendulum.coulomb", "pendulum.quadratic", "pendulum.spring", "pendulum.bias", "sensor.alpha.offset",
    "sensor.alpha.scale", "sensor.theta.scale",
)  # fmt: skip
SIGMAS = (3, 4, 6, 12, 25)


def diagnose(command: list[str], folder: pathlib.Path, limit: float | None = None) -> dict[str, object]:
    """The program's answer on the recordings and the data sheet in this folder.

    Raises ``ValueError`` with the last line it wrote where there is none.
    """
    call = [
        *command,
        "diagnose",
        *map(str, sorted(folder.glob("run-*.csv"))),
        "--rig",
        str(folder / "rig.toml"),
        "--json",
    ]
    done = subprocess.run(call, capture_output=True, text=True, timeout=limit)
    if done.returncode == 2:  # a version whose --json takes a file
        done = subprocess.run([*call, "-"], capture_output=True, text=True, timeout=limit)
    if not done.stdout.lstrip().startswith("{"):
        raise ValueError((done.stderr.strip().splitlines() or ["no answer"])[-1])
    return json.loads(done.stdout)


def make_faint(seed: int, out: pathlib.Path, command: list[str], effects: list[str]) -> None:
    """Each effect (of `FAINT`) once at each of `SIGMAS` times its standard deviation, and the same rigs without."""
    families = sorted(FAMILIES)
    for i, effect in enumerate(FAINT):
        if effect not in effects:
            continue
        case = Case(
            f"{i:03d}-clean",
            families[(i + seed) % len(families)],
            (),
            1000 * seed + i,
            spread=(0.03, 0.1, 0.2)[i % 3],
            noise=(0.0, 0.3, 1.0)[i // 3 % 3],
        )
        if not (out / case.name / "truth.json").exists():
            case.write(out)
        answer = diagnose(command, out / case.name)
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


def named(ids: Iterable[str]) -> set[str]:
    """The effects by what recordings can tell of them: a late encoder is a late command."""
    return {"motor.delay" if id == "sensor.delay" else id for id in ids}


def score(command: list[str], case: pathlib.Path, limit: float) -> dict[str, object]:
    """Runs the program on a copy of the case and compares its answer with the truth."""
    truth = json.loads((case / "truth.json").read_text())
    wanted, begin = named(truth["effects"]), time.perf_counter()
    with tempfile.TemporaryDirectory() as copy:
        for file in [case / "rig.toml", *sorted(case.glob("run-*.csv"))]:
            shutil.copy(file, copy)
        try:
            answer = diagnose(command, pathlib.Path(copy), limit)
        except subprocess.TimeoutExpired:
            answer, error = None, f"no answer in {limit} s"
        except ValueError as none:
            answer, error = None, str(none)
    row = {"case": case.name, "wanted": sorted(wanted), "seconds": time.perf_counter() - begin}
    known = wanted - set(FOREIGN)  # what can be named
    row |= {"foreign": known != wanted, "beside": sorted(known)}
    if answer is None:
        return row | {
            "got": [error],
            "verdict": "error",
            "exact": False,
            "close": False,
            "false": [],
            "missed": sorted(known),
        }
    got = named(e["id"] for e in answer["effects"])
    rivals = got | named(r for e in answer["effects"] for r in e.get("confusable_with", []))
    if row["foreign"]:
        exact = answer["verdict"] == "unexplained" and got == known
        close = answer["verdict"] == "unexplained"
    elif not wanted:
        exact = close = not got and answer["verdict"] in ("no_gap", "parameters_only")
    else:
        exact = got == wanted
        close = exact or (wanted <= rivals and len(got) == len(wanted))
    return row | {
        "got": sorted(got),
        "verdict": answer["verdict"],
        "exact": exact,
        "close": close,
        "false": sorted(got - wanted),
        "missed": sorted(known - got),
    }


def table(rows: list[dict[str, object]], groups: list[str]) -> list[str]:
    """How many of each group are exact or near, and how many have something named that is not there.

    Of foreign effects: how many were `unexplained` alone, and beside how many the catalogue effect was named.
    """
    lines = [f"{'group':10} {'exact':>8} {'near':>6} {'false':>6} {'unexplained':>12} {'beside':>8} {'seconds':>8}"]
    for group in [*groups, "all"]:
        of = [r for r in rows if group in ("all", r["case"].split("-", 1)[1])]
        if not of:
            continue
        exact, near, false = (
            sum(r["exact"] for r in of),
            sum(r["close"] and not r["exact"] for r in of),
            sum(bool(r["false"]) for r in of),
        )
        alone = [r["verdict"] == "unexplained" for r in of if r["foreign"] and not r["beside"]]
        beside = [not r["missed"] for r in of if r["foreign"] and r["beside"]]
        shares = [f"{sum(hits)}/{len(hits)}" if hits else "-" for hits in (alone, beside)]
        lines.append(
            f"{group:10} {f'{exact}/{len(of)}':>8} {near:6d} {false:6d} {shares[0]:>12} {shares[1]:>8} "
            f"{np.median([r['seconds'] for r in of]):8.1f}"
        )
    return lines


def main() -> None:
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument("--out", type=pathlib.Path, required=True)
    a.add_argument("--seed", type=int, default=1)
    a.add_argument("--cli", default="target/release/furuta")
    a.add_argument("--jobs", type=int, default=1)
    a.add_argument("--limit", type=float, default=300, help="seconds for one case")
    a.add_argument("--groups", default="", help="only these, e.g. usual,clean")
    a.add_argument(
        "--near-the-limit",
        action="store_true",
        help="effects of 3 to 25 standard deviations in place of the usual groups",
    )
    a.add_argument("--effects", default=",".join(FAINT), help="of --near-the-limit, only these")
    a.add_argument("--only-generate", action="store_true")
    a = a.parse_args()
    if a.near_the_limit:
        make_faint(a.seed, a.out, shlex.split(a.cli), a.effects.split(","))
    wanted = (
        []
        if a.near_the_limit
        else [case for case in plan(a.seed) if not a.groups or case.name.split("-", 1)[1] in a.groups.split(",")]
    )
    missing = [case for case in wanted if not (a.out / case.name / "truth.json").exists()]
    with concurrent.futures.ProcessPoolExecutor(a.jobs) as pool:
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
            print(
                f"{row['case']:14} {mark} wanted {','.join(row['wanted']) or '-':40} "
                f"got {','.join(row['got']) or '-'}  {row['verdict']}  {row['seconds']:.1f} s",
                flush=True,
            )
    print("\n".join(table(rows, groups)))


if __name__ == "__main__":
    main()
