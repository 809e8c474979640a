"""What different experiments say of the cable on a QUBE's arm: three tables, and a picture of them.

    cargo build --release
    python examples/one_cable.py                          # the tables: ten minutes, most of them for the diagnoses
    python examples/one_cable.py --plot docs/one-cable.svg    # and the picture (needs matplotlib)

Every figure is an answer of the program (`--cli`), kept as JSON in `--out`; an answer that is there is not asked for
again. docs/one-cable.md says what the tables mean.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import pathlib
import shlex
import subprocess

HERE = pathlib.Path(__file__).resolve().parent
QUBE, BALANCED = HERE / "qube-servo-2", HERE / "qube-servo-2-balance"


def chirps(n: int) -> list[pathlib.Path]:
    return [QUBE / f"chirp-{sign}-{n}.csv" for sign in ("plus", "minus")]


SWING_UPS = [QUBE / f"swing-up-{n}.csv" for n in (1, 2)]
EXPERIMENTS = {
    "chirps, first": chirps(1),
    "chirps, last": chirps(5),
    "chirps, all four": [*chirps(1), *chirps(5)],
    "first swing-up": SWING_UPS[:1],
    "second swing-up": SWING_UPS[1:],
    "both swing-ups": SWING_UPS,
    "balanced (another QUBE)": sorted(BALANCED.glob("run-*.csv"))[:2],
}
# The law that the chirps show, fitted to each experiment alike; the values are where the fits start.
LAW = """
[effects."motor.lag"]
time_constant = 0.0036

[effects."arm.cable"]
stiffness = 0.001
asymmetry = -0.0007
cubic = 0.0006
rest = -0.526

[effects."arm.presliding"]
torque = 0.00026
stiffness = 0.0014
"""
# A plain spring in the place of cable and friction.
SPRING = """
[effects."motor.lag"]
time_constant = {lag}

[effects."arm.spring"]
stiffness = 0.0012
rest = -0.526
"""
# Recordings and span, s: the slower the chirp, the further the arm moves.
PARTS = [
    *(("chirps, all four", span) for span in ("0..2.5", "2.5..5", "5..7", "7..9", "8..10")),
    ("both swing-ups", "0..5"),
]
UNITS = {
    "arm.cable.stiffness": "mN m/rad",
    "arm.cable.asymmetry": "mN m/rad2",
    "arm.cable.cubic": "mN m/rad3",
    "arm.cable.rest": "rad",
    "arm.presliding.torque": "mN m",
    "arm.presliding.stiffness": "mN m/rad",
}


class Program:
    """`furuta`, and what it has answered."""

    def __init__(self, cli: str, out: pathlib.Path):
        self.cli, self.out = shlex.split(cli), out
        out.mkdir(parents=True, exist_ok=True)

    def ask(self, name: str, *arguments: object) -> dict:
        """The JSON that a command prints; from `out` where it is there."""
        kept = self.out / f"{name}.json"
        if not kept.exists():
            done = subprocess.run([*self.cli, *map(str, arguments), "--json"], capture_output=True, text=True)
            if done.returncode:
                raise SystemExit(f"{name}: {done.stderr.strip()}")
            kept.write_text(done.stdout)
        return json.loads(kept.read_text())


def motion(files: list[pathlib.Path], span: str = "0..1e9") -> tuple[float, float]:
    """Least and greatest angle of the arm within this span of the recordings, rad."""
    begin, end = map(float, span.split(".."))
    rows = [row for file in files for row in csv.DictReader(file.open())]
    theta = [float(row["theta"]) for row in rows if begin <= float(row["t"]) <= end]
    return min(theta), max(theta)


Interval = tuple[float, float, float]  # value, least, greatest


def cell(own: Interval | None, first: Interval | None) -> str:
    """A value in thousandths (N m: mN m) but for angles, its interval, and whether that shares nothing with the first
    one's."""
    if own is None:
        return "-"
    value, low, high = own
    apart = first is not None and (low > first[2] or high < first[1])
    return f"{value:.3g} [{low:.3g}, {high:.3g}]{' other' if apart else ''}"


def numbers(answer: dict) -> dict[str, Interval]:
    """What a diagnosis names, `effect.parameter`: mN m, rad, with 95 % intervals."""
    found = {}
    for effect in answer["effects"]:
        for name, estimate in effect["parameters"].items():
            if estimate["std"] is not None:
                scale = 1.0 if name == "rest" else 1e3
                value, half = scale * estimate["value"], scale * 1.96 * estimate["std"]
                found[f"{effect['id']}.{name}"] = (value, value - half, value + half)
    return found


def table(keys: list[str]) -> None:
    print(
        "| experiment | arm [rad] | "
        + " | ".join(f"{key.removeprefix('arm.')} [{UNITS[key]}]" for key in keys)
        + " | |"
    )
    print("|---" * (len(keys) + 3) + "|")


def named(program: Program) -> dict[str, dict]:
    """Table 1: what `furuta diagnose` names in each experiment, cable and friction with 95 % intervals."""
    print("1. Named (furuta diagnose); 95 % intervals; `other`: shares no value with that of the first chirps\n")
    table(list(UNITS))
    answers = {}
    for name, files in EXPERIMENTS.items():
        answer = program.ask(
            "diagnose " + name, "diagnose", *files, "--rig", files[0].parent / "rig.toml", "--time-limit", 1800
        )
        answers[name] = answer
        own, first = numbers(answer), numbers(next(iter(answers.values())))
        low, high = motion(files)
        ids = ", ".join(f"`{effect['id']}`" for effect in answer["effects"]) or "nothing"
        cells = [cell(own.get(key), first.get(key)) for key in UNITS]
        print(f"| {name} | {low:.2f} to {high:.2f} | " + " | ".join(cells) + f" | {ids} |", flush=True)
    return answers


def fitted(program: Program, name: str, files: list[pathlib.Path], rig: str, *options: object) -> dict:
    """`furuta identify calibrate` with this rig file."""
    file = program.out / f"{name}.toml"
    file.write_text(rig)
    return program.ask(name, "identify", "calibrate", *files, "--rig", file, *options)


def one_law(program: Program) -> dict[str, dict]:
    """Table 2: the law that the chirps show, fitted to each experiment with everything else."""
    print(
        "\n2. One law, fitted to each (furuta identify calibrate); "
        "the last column: the error left, over the encoders' noise\n"
    )
    keys = [key for key in UNITS if not key.endswith("rest")]
    table(keys)
    answers: dict[str, dict] = {}
    for name, files in EXPERIMENTS.items():
        if files[0].parent != QUBE:
            continue
        answer = fitted(program, "law " + name, files, (QUBE / "rig.toml").read_text() + LAW)
        answers[name] = answer
        cells = []
        for key in keys:
            own, first = (
                (1e3 * p["fitted"], *(1e3 * end for end in p["interval"])) if p["interval"] else None
                for p in (of["parameters"][key] for of in (answer, next(iter(answers.values()))))
            )
            cells.append(cell(own, first))
        low, high = motion(files)
        print(f"| {name} | {low:.2f} to {high:.2f} | " + " | ".join(cells) + f" | {answer['chi']:.1f} |", flush=True)
    return answers


def chord(law: dict, low: float, high: float) -> float:
    """Mean stiffness of the law's cable between two angles of the arm, N m/rad: of a chord of its torque."""
    value = {
        name: law["parameters"][f"arm.cable.{name}"]["fitted"] for name in ("stiffness", "asymmetry", "cubic", "rest")
    }
    a, b = low - value["rest"], high - value["rest"]
    return value["stiffness"] + value["asymmetry"] * (a + b) + value["cubic"] * (a * a + a * b + b * b)


def by_amplitude(
    program: Program, law: dict, parts: list[tuple[str, str]]
) -> list[tuple[str, float, float, float, float, float]]:
    """Table 3: a plain spring in the place of cable and friction, over parts of the recordings in which the arm moves
    more or less.

    The sheet's parameters and the lag are those of the law's fit to the first chirps; the spring and the arm's damping
    are free. Beside it what that law's cable alone would be on average over the same angles.
    """
    sheet = (QUBE / "rig.toml").read_text()
    for key, value in law["parameters"].items():
        table, _, name = key.rpartition(".")
        if not table.startswith(("arm", "pendulum", "motor")) or "." in table or key == "motor.lag.time_constant":
            continue
        head, tail = sheet.split(f"[{table}]", 1)
        lines = [
            f"{name} = {value['fitted']!r}" if line.split("=")[0].strip() == name else line
            for line in tail.splitlines()
        ]
        sheet = head + f"[{table}]" + "\n".join(lines) + "\n"
    rig = sheet + SPRING.format(lag=law["parameters"]["motor.lag.time_constant"]["fitted"])
    print("\n3. A plain spring in the place of cable and friction, by how far the arm moves\n")
    print(
        "| recordings | span [s] | arm [rad] | spring [mN m/rad] | cable of the first chirps [mN m/rad] | |\n"
        "|---|---|---|---|---|---|"
    )
    rows = []
    for name, span in parts:
        files = EXPERIMENTS[name]
        free = "arm.spring.stiffness,arm.viscous"
        answer = fitted(program, f"spring {name} {span}", files, rig, "--span", span, "--free", free)
        stiffness = answer["parameters"]["arm.spring.stiffness"]
        least, greatest = motion(files, span)
        expected = chord(law, least, greatest)
        low, high = stiffness["interval"] or (math.nan, math.nan)
        rows.append((name, greatest - least, stiffness["fitted"], low, high, expected))
        value = cell((1e3 * stiffness["fitted"], 1e3 * low, 1e3 * high), None)
        print(
            f"| {name} | {span} | {least:.2f} to {greatest:.2f} | {value} | {1e3 * expected:.3g} "
            f"| {answer['chi']:.1f} |",
            flush=True,
        )
    return rows


def law_of(answer: dict) -> dict[str, float] | None:
    """The cable's numbers as a diagnosis names them (a spring is a cable without the rest)."""
    for effect in answer["effects"]:
        if effect["id"] in ("arm.cable", "arm.spring"):
            return {"asymmetry": 0.0, "cubic": 0.0} | {
                name: value["value"] for name, value in effect["parameters"].items()
            }
    return None


def plot(
    file: pathlib.Path, answers: dict[str, dict], springs: list[tuple[str, float, float, float, float, float]]
) -> None:
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams["svg.hashsalt"] = "one-cable"
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.4), layout="constrained")
    colours = dict(
        zip(
            EXPERIMENTS,
            ("tab:blue", "tab:cyan", "tab:purple", "tab:orange", "tab:red", "tab:brown", "tab:green"),
            strict=True,
        )
    )
    for name, files in EXPERIMENTS.items():
        cable = law_of(answers[name])
        if cable is None:
            continue
        low, high = motion(files)
        angles = [low + (high - low) * i / 200 for i in range(201)]
        e = [angle - cable["rest"] for angle in angles]
        pull = [-1e3 * x * (cable["stiffness"] + x * (cable["asymmetry"] + x * cable["cubic"])) for x in e]
        left.plot(angles, pull, color=colours[name], label=name)
    left.axhline(0, color="0.7", linewidth=0.8)
    left.set(
        xlabel="angle of the arm [rad]",
        ylabel="torque of the cable on the arm [mN m]",
        title="The cable as named, where the arm was",
    )
    left.legend(frameon=False, fontsize=9)
    for name in dict.fromkeys(row[0] for row in springs):
        of = [row for row in springs if row[0] == name]
        errors = [[1e3 * (row[2] - row[3]) for row in of], [1e3 * (row[4] - row[2]) for row in of]]
        right.errorbar(
            [row[1] for row in of],
            [1e3 * row[2] for row in of],
            errors,
            fmt="o",
            capsize=4,
            color=colours[name],
            label=name,
        )
    right.plot(
        [row[1] for row in springs],
        [1e3 * row[5] for row in springs],
        "k_",
        markersize=14,
        label="cable of the first chirps, same angles",
    )
    right.set(
        xscale="log",
        xlabel="range of the arm [rad]",
        ylabel="stiffness of a plain spring [mN m/rad]",
        title="A spring in its place, by amplitude",
    )
    right.set_xticks([0.1, 0.3, 1, 3], ["0.1", "0.3", "1", "3"])
    right.set_xticks([], minor=True)
    right.set_ylim(bottom=0)
    right.legend(frameon=False, fontsize=9)
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(file, metadata={"Date": None})


def main() -> None:
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument("--cli", default=str(HERE.parent / "target/release/furuta"))
    a.add_argument("--out", type=pathlib.Path, default=HERE.parent / "out/one-cable", help="where the answers are kept")
    a.add_argument("--plot", type=pathlib.Path, help="an SVG picture")
    a = a.parse_args()
    program = Program(a.cli, a.out)
    answers = named(program)
    laws = one_law(program)
    springs = by_amplitude(program, laws["chirps, first"], PARTS)
    if a.plot:
        plot(a.plot, answers, springs)


if __name__ == "__main__":
    main()
