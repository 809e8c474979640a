"""Fresh hidden-effect cases and a table of how many `furuta diagnose` names.

For judging a change without fitting to one set. Makes the cases if they are not there, then scores:

    python py/tests/benchmark.py --seed 1 --out out/bench-1
    python py/tests/benchmark.py --seed 1 --out out/bench-1 --only-generate
    python py/tests/benchmark.py --out out/bench-1 --groups usual,clean --jobs 2
    python py/tests/benchmark.py --seed 1 --out out/rough-1 --groups rough,foreign,lookalike,seldom,event
    python py/tests/benchmark.py --seed 1 --out out/limit-1 --near-the-limit --jobs 2

`--near-the-limit` hides one effect so small that the data say little of it: 3 to 25 times the standard deviation with
which the recordings determine its strength (the Cramer-Rao bound, which `furuta diagnose` of the same rig without the
effect reports in `limits`).

A foreign case (what no catalogue has, alone or with a catalogue effect beside) counts as exact when the verdict is
`unexplained`, nothing false is named, and the effect beside is; the table counts the three apart, too. Some of what is
foreign is in the catalogue by now: such a case is exact as well when it is called by that name and the effect beside is
named.

What happened for a while in one recording (the group `event`) counts as exact when that stretch is left out, within a
second at either end, and what is named is what is hidden beside.

Another seed is another set of rigs, sizes, pairs and data sheets. The program under test sees a copy without
truth.json.

Cases are made and scored by `furuta.campaign`, with `--jobs` processes. Scores are in a folder of `scores` in `--out`,
one for each program, limit and set of cases: a run that was broken off goes on, the same program is not asked twice,
another is asked anew.
"""

from __future__ import annotations

import argparse
import dataclasses
import hashlib
import json
import pathlib
import shlex
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterable

import furuta
import numpy as np
from benchmark_cases import Case, plan
from mujoco_effects import FOREIGN, SECONDS, draw_effect
from mujoco_foreign import CALLED, EVENTS
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


def is_left_out(stretch: dict[str, object] | None, event: dict[str, float]) -> bool:
    """Whether this stretch is the one in which something else happened, within a second at either end."""
    if stretch is None:
        return False
    begins = abs(stretch["from"] - event["from"]) < 1.0
    ends = event["to"] >= SECONDS or abs(stretch["to"] - event["to"]) < 1.0  # it lasts to the end of the recording
    return str(stretch["run"]).startswith(f"run-{event['run']:.0f}-") and begins and ends


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
    known = wanted - set(FOREIGN) - set(EVENTS)  # what can be named
    called = {CALLED[id] for id in wanted if id in CALLED}
    row |= {"foreign": known != wanted, "beside": sorted(known), "called": sorted(called)}
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
    events = [truth["effects"][id] for id in wanted & set(EVENTS)]
    if events:
        close = answer["verdict"] == "unexplained"
        exact = close and got == known and all(is_left_out(answer.get("left_out"), event) for event in events)
    elif row["foreign"]:
        told = bool(called) and called <= got and answer["verdict"] == "missing_effects"
        close = told or answer["verdict"] == "unexplained"
        exact = close and got - called == known
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
        "false": sorted(got - wanted - called),
        "missed": sorted(known - got),
    }


def table(rows: list[dict[str, object]], groups: list[str]) -> list[str]:
    """How many of each group are exact or near, and how many have something named that is not there.

    Of foreign effects: how many were named or else `unexplained` alone, how many of those that are in the catalogue
    were named, and beside how many the catalogue effect was.
    """
    heads = (f"{head:>8}" for head in ("alone", "named", "beside", "seconds"))
    lines = [f"{'group':10} {'exact':>8} {'near':>6} {'false':>6} {' '.join(heads)}"]
    for group in [*groups, "all"]:
        of = [r for r in rows if group in ("all", r["case"].split("-", 1)[1])]
        if not of:
            continue
        exact, near, false = (
            sum(r["exact"] for r in of),
            sum(r["close"] and not r["exact"] for r in of),
            sum(bool(r["false"]) for r in of),
        )
        alone = [r["close"] for r in of if r["foreign"] and not r["beside"]]
        called = [set(r["called"]) <= set(r["got"]) for r in of if r["called"]]
        beside = [not r["missed"] for r in of if r["foreign"] and r["beside"]]
        shares = [f"{sum(hits)}/{len(hits)}" if hits else "-" for hits in (alone, called, beside)]
        lines.append(
            f"{group:10} {f'{exact}/{len(of)}':>8} {near:6d} {false:6d} "
            f"{' '.join(f'{share:>8}' for share in shares)} {np.median([r['seconds'] for r in of]):8.1f}"
        )
    return lines


def make(case: tuple[Case, str]) -> dict[str, object]:
    """Writes a case, as a campaign does it."""
    return {"made": case[0].write(pathlib.Path(case[1]))}


def scored(case: tuple[str, list[str], float]) -> dict[str, object]:
    """`score`, as a campaign does it: with `case` and `seconds` under names that a campaign's table leaves free."""
    folder, command, limit = case
    row = score(command, pathlib.Path(folder), limit)
    return {"folder": row.pop("case"), "took": row.pop("seconds"), **row}


def row_of(found: dict[str, object]) -> dict[str, object]:
    """A row of the campaign as `score` gives it. What `score` raised ends the benchmark."""
    if found["error"] is not None:
        raise RuntimeError(f"{found['input']}: {found['error']}\n{found['traceback']}")
    names = ("wanted", "foreign", "beside", "called", "got", "verdict", "exact", "close", "false", "missed")
    return {"case": found["folder"], "seconds": found["took"], **{name: found[name] for name in names}}


def told(found: dict[str, object]) -> None:
    """Prints a row."""
    row = row_of(found)
    mark = "ok  " if row["exact"] else "near" if row["close"] else "MISS"
    print(
        f"{row['case']:14} {mark} wanted {','.join(row['wanted']) or '-':40} "
        f"got {','.join(row['got']) or '-'}  {row['verdict']}  {row['seconds']:.1f} s",
        flush=True,
    )


def scores_of(out: pathlib.Path, command: list[str], limit: float, folders: list[pathlib.Path]) -> pathlib.Path:
    """Where the scores of this program on these cases are: another program has another folder."""
    seen = hashlib.sha256(json.dumps([command, limit, [folder.name for folder in folders]]).encode())
    found = [shutil.which(word) or word for word in command]
    for file in [*map(pathlib.Path, found), *(folder / "truth.json" for folder in folders)]:
        if file.is_file():
            seen.update(file.read_bytes())
    return out / "scores" / seen.hexdigest()[:12]


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
    made = furuta.campaign(
        make,
        [(case, str(a.out)) for case in missing],
        workers=a.jobs,
        on_row=lambda row: print("made", row["made"] or row["error"], flush=True),
    )
    if made["error"].null_count < len(made):
        raise RuntimeError(made["traceback"].drop_null()[0].as_py())
    if a.only_generate:
        return
    folders = sorted(p.parent for p in a.out.glob("*/truth.json"))
    groups = list(dict.fromkeys(f.name.split("-", 1)[1] for f in folders))
    groups = [g for g in groups if not a.groups or g in a.groups.split(",")]
    folders = [f for f in folders if f.name.split("-", 1)[1] in groups]
    command = shlex.split(a.cli)
    answers = furuta.campaign(
        scored,
        [(str(folder), command, a.limit) for folder in folders],
        out=scores_of(a.out, command, a.limit, folders),
        workers=a.jobs,
        on_row=told,
        again=True,
    )
    rows = [row_of(found) for found in answers.to_pylist()]
    print("\n".join(table(rows, groups)))


if __name__ == "__main__":
    main()
