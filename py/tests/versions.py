"""Two versions of the program on the same cases, in alternation: times, names, lines of code and constants.

    git worktree add ../before REVISION && (cd ../before && cargo build --release)
    python py/tests/versions.py --before ../before --cases out/benchmark --count 10

Each case is diagnosed by both in turn, `--rounds` times, without a time limit; of each the least processor time counts,
since what else runs on the machine only adds to it.
"""

from __future__ import annotations

import argparse
import json
import os
import pathlib
import re
import resource
import statistics
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]
# The engine and the search.
SOURCES = "crates/furuta-ident/src"


def size(root: pathlib.Path) -> tuple[int, int]:
    """Lines of the engine and the search, and the numbers among their constants."""
    lines, constants = 0, 0
    for path in (root / SOURCES).rglob("*.rs"):
        if {"diagnose", "shooting"} & set(path.parts):
            text = path.read_text()
            lines += text.count("\n")
            constants += len(re.findall(r"^\s*(?:pub(?:\([a-z]+\))? )?const [A-Z_]+: (?:f64|usize|u32|i32)\b", text, re.M))
    return lines, constants


def diagnose(program: pathlib.Path, case: pathlib.Path) -> tuple[float, list[str]]:
    """Processor time, s, and the names."""
    command = [program, "diagnose", *sorted(case.glob("run-*.csv")), "--rig", case / "rig.toml", "--json"]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([*command, "--time-limit", "100000"], capture_output=True, text=True, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    names = sorted(effect["id"] for effect in json.loads(done.stdout)["effects"])
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, names


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--before", type=pathlib.Path, required=True, help="a built clone of the other version")
    parser.add_argument("--cases", type=pathlib.Path, required=True, help="folder of folders with rig.toml, run-*.csv")
    parser.add_argument("--count", type=int, default=10)
    parser.add_argument("--rounds", type=int, default=2)
    args = parser.parse_args()
    target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", "target"))
    programs = [root / target / "release/furuta" for root in (args.before.resolve(), ROOT)]
    cases = sorted(path.parent for path in args.cases.glob("*/rig.toml"))
    ratios = []
    for case in cases[:: max(1, len(cases) // args.count)][: args.count]:
        tries = [[diagnose(program, case) for program in programs] for _ in range(args.rounds)]
        times = [min(one[k][0] for one in tries) for k in range(2)]
        names = [tries[0][k][1] for k in range(2)]
        ratios.append(times[1] / times[0])
        same = "same names" if names[0] == names[1] else f"{', '.join(names[0])} -> {', '.join(names[1])}"
        print(f"{case.name:24} {times[0]:7.2f} s {times[1]:7.2f} s  ratio {ratios[-1]:.2f}  {same}", flush=True)
    print(f"median of {len(ratios)} ratios of processor time, after over before: {statistics.median(ratios):.2f}")
    for what, *counts in zip(("lines", "constants"), size(args.before), size(ROOT)):
        print(f"{what} of engine and search: {counts[0]} before, {counts[1]} after")


if __name__ == "__main__":
    main()
