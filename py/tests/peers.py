"""furuta diagnose beside two others on the same recordings: discrepancy SINDy and a ladder of friction models.

    python py/tests/peers.py --cli target/release/furuta --cases out/peers --real examples/qube-servo-2 \\
        [--seed 1] [--only arm.coulomb,nothing] [--markdown FILE]

All three see the same recordings and the same data sheet, and predict a recording that none has seen: open loop over
its whole length, from rest.

1. Both peers start from the data sheet refitted (inertias, gain, viscous frictions; windows of half a second from
   smoothed states, then whole runs).
2. SINDy: smoothed accelerations give the torque that the sheet, as given or refitted, leaves unexplained; PySINDy's
   STLSQ regresses it on a library of functions of state and command. Of both sheets, two libraries and six thresholds
   the sparsest is kept that predicts three seconds of the recordings within a tenth of the best (in squares).
3. Ladder, in the manner of BAM (Duclusaud et al., "Extended friction models for the physics simulation of servo
   actuators"): Coulomb, Stribeck, load-dependent, both, quadratic on the arm, each fitted together with the parameters,
   the one kept that predicts three seconds best.
4. furuta diagnose --verify.

The cases are those of `benchmark.py`, one for each effect that is asked for; they are made in `--cases` where they are
not there.

Not part of the tests: it needs Python 3.11, `pip install mujoco pysindy numba scipy`, and minutes.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import pathlib
import shlex
import subprocess
import tempfile
import time
import tomllib
from collections.abc import Callable

import numba
import numpy as np
from benchmark_cases import plan
from scipy.optimize import least_squares
from scipy.signal import savgol_filter

try:
    import pysindy
except ImportError:  # the table says so
    pysindy = None

HIDDEN = (
    "arm.coulomb",
    "arm.spring",
    "motor.delay",
    "motor.deadzone",
    "drive.backlash",
    "arm.cogging",
    "nothing",
    "x.memory",
)
WINDOW = 0.5  # s, of the fits
CHOICE = 3.0  # s, of the predictions by which a peer's model is chosen
SMOOTH = 25  # samples of the local quartic that gives speeds and accelerations
SOFT = 0.05  # rad/s: below, a peer's sign of a speed is a slope


@dataclasses.dataclass
class Run:
    """A recording: time, command, the two angles."""

    name: str
    h: float
    u: np.ndarray
    y: np.ndarray

    @staticmethod
    def load(path: pathlib.Path) -> Run:
        data = np.genfromtxt(path, delimiter=",", names=True, comments="#")
        h = float(np.median(np.diff(data["t"])))
        return Run(path.name, h, data["u"], np.column_stack([data["theta"], data["alpha"]]))

    def smoothed(self) -> tuple[np.ndarray, np.ndarray]:
        """States and accelerations from local polynomials."""
        speed = savgol_filter(self.y, SMOOTH, 4, deriv=1, delta=self.h, axis=0)
        angle = savgol_filter(self.y, SMOOTH, 4, axis=0)
        return np.hstack([angle, speed]), savgol_filter(self.y, SMOOTH, 4, deriv=2, delta=self.h, axis=0)


@dataclasses.dataclass
class Sheet:
    """The equations of motion of a rig file, five of their coefficients free."""

    arm: float
    swing: float
    coupling: float
    pendulum: float
    weight: float
    drive: float
    arm_damping: float
    pendulum_damping: float

    @staticmethod
    def load(path: pathlib.Path) -> Sheet:
        rig = tomllib.loads(path.read_text())
        a, p, m = rig["arm"], rig["pendulum"], rig["motor"]
        transverse, axial = p.get("inertia_transverse", p["inertia"]), p.get("inertia_axial", 0.0)
        per_volt = m["torque_constant"] * m["gear_ratio"] * m["efficiency"] / m["resistance"]
        return Sheet(
            arm=a["inertia"] + p["mass"] * a["length"] ** 2 + axial,
            swing=p["mass"] * p["com"] ** 2 + transverse - axial,
            coupling=p["mass"] * a["length"] * p["com"],
            pendulum=p["inertia"] + p["mass"] * p["com"] ** 2,
            weight=p["mass"] * p["com"] * rig["environment"]["gravity"],
            drive=m["amplifier_gain"] * per_volt,
            arm_damping=a["viscous"] + per_volt * m["back_emf_constant"] * m["gear_ratio"],
            pendulum_damping=p["viscous"],
        )

    def scaled(self, factors: np.ndarray) -> Sheet:
        """With arm, pendulum, drive and the dampings times these."""
        small = 0.02 * np.sqrt(self.weight * self.pendulum)
        pendulum = self.pendulum * factors[1]
        return dataclasses.replace(
            self, arm=self.arm * factors[0], pendulum=pendulum, swing=self.swing + pendulum - self.pendulum,
            drive=self.drive * factors[2],
            arm_damping=self.arm_damping + (factors[3] - 1) * max(self.arm_damping, small),
            pendulum_damping=self.pendulum_damping + (factors[4] - 1) * max(self.pendulum_damping, small),
        )  # fmt: skip

    def inertia(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        sin, cos = np.sin(x[..., 1]), np.cos(x[..., 1])
        return self.arm + self.swing * sin**2, -self.coupling * cos, self.pendulum

    def torque(self, x: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What motor, damping, weight and velocities leave to accelerate both axes, N m."""
        sin, cos, v, w = np.sin(x[..., 1]), np.cos(x[..., 1]), x[..., 2], x[..., 3]
        arm = self.drive * u - self.arm_damping * v - 2 * self.swing * sin * cos * v * w - self.coupling * sin * w**2
        pendulum = -self.pendulum_damping * w + self.swing * sin * cos * v**2 + self.weight * sin
        return arm, pendulum


Extra = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
# Of the arm's dry friction: Coulomb (N m), what static friction adds (N m), Stribeck's speed (rad/s), share of the
# load, square of the speed (N m s2/rad2).
Friction = tuple[float, float, float, float, float]
FRICTIONLESS: Friction = (0.0, 0.0, 1.0, 0.0, 0.0)


@numba.njit(cache=False)
def rate(c, f, u, h, t, a, v, w):  # noqa: ANN001, ANN202
    """Accelerations; friction stops the arm within half a step as far as it can (c: the sheet's coefficients)."""
    sin, cos = np.sin(a), np.cos(a)
    arm = c[5] * u - c[6] * v - 2 * c[1] * sin * cos * v * w - c[2] * sin * w**2
    pendulum = -c[7] * w + c[1] * sin * cos * v**2 + c[4] * sin
    m11, m12, m22 = c[0] + c[1] * sin**2, -c[2] * cos, c[3]
    det = m11 * m22 - m12**2
    most = f[0] + f[1] * np.exp(-((v / f[2]) ** 2)) + f[3] * abs(arm) + f[4] * v**2
    if most > 0:
        wanted = -(2 * v / h + (m22 * arm - m12 * pendulum) / det) * det / m22
        arm += min(max(wanted, -most), most)
    return (m22 * arm - m12 * pendulum) / det, (m11 * pendulum - m12 * arm) / det


@numba.njit(cache=False)
def rubbing(c, f, x, u, h):  # noqa: ANN001, ANN202
    """Runge-Kutta of windows: x (n, 4), u (n, samples) -> angles (n, samples, 2)."""
    out = np.empty((*u.shape, 2))
    for i in range(u.shape[0]):
        t, a, v, w = x[i]
        for k in range(u.shape[1]):
            out[i, k, 0], out[i, k, 1] = t, a
            n = u[i, k]
            p1, q1 = rate(c, f, n, h, t, a, v, w)
            v2, w2 = v + h / 2 * p1, w + h / 2 * q1
            p2, q2 = rate(c, f, n, h, t + h / 2 * v, a + h / 2 * w, v2, w2)
            v3, w3 = v + h / 2 * p2, w + h / 2 * q2
            p3, q3 = rate(c, f, n, h, t + h / 2 * v2, a + h / 2 * w2, v3, w3)
            v4, w4 = v + h * p3, w + h * q3
            p4, q4 = rate(c, f, n, h, t + h * v3, a + h * w3, v4, w4)
            t += h / 6 * (v + 2 * v2 + 2 * v3 + v4)
            a += h / 6 * (w + 2 * w2 + 2 * w3 + w4)
            v += h / 6 * (p1 + 2 * p2 + 2 * p3 + p4)
            w += h / 6 * (q1 + 2 * q2 + 2 * q3 + q4)
    return out


def simulate(
    sheet: Sheet, x: np.ndarray, u: np.ndarray, h: float, extra: Extra | None = None, friction: Friction = FRICTIONLESS
) -> np.ndarray:
    """Many windows: x (n, 4), u (n, samples) -> angles (n, samples, 2). `extra`: torques by state and command, without
    dry friction."""
    if extra is None:
        return rubbing(dataclasses.astuple(sheet), friction, x, u, h)

    def rates(x: np.ndarray, u: np.ndarray) -> np.ndarray:
        (arm, pendulum), more = sheet.torque(x, u), extra(x, u)
        arm, pendulum = arm + more[0], pendulum + more[1]
        m11, m12, m22 = sheet.inertia(x)
        det = m11 * m22 - m12**2
        return np.stack(
            [x[:, 2], x[:, 3], (m22 * arm - m12 * pendulum) / det, (m11 * pendulum - m12 * arm) / det], axis=1
        )

    out = np.empty((*u.shape, 2))
    with np.errstate(all="ignore"):
        for k in range(u.shape[1]):
            out[:, k] = x[:, :2]
            a = rates(x, u[:, k])
            b = rates(x + h / 2 * a, u[:, k])
            c = rates(x + h / 2 * b, u[:, k])
            d = rates(x + h * c, u[:, k])
            x = x + h / 6 * (a + 2 * b + 2 * c + d)
    return out


@dataclasses.dataclass
class Windows:
    """Windows of some runs, with smoothed states at their starts."""

    x: np.ndarray
    u: np.ndarray
    y: np.ndarray
    h: float

    @staticmethod
    def of(runs: list[Run], seconds: float) -> Windows:
        """One after the other through every run, from smoothed states."""
        x, u, y = [], [], []
        length = round(seconds / runs[0].h)
        for run in runs:
            states, _ = run.smoothed()
            n = len(run.u)
            for k in range(SMOOTH, n - length - SMOOTH, length):
                x.append(states[k])
                u.append(run.u[k : k + length])
                y.append(run.y[k : k + length])
        return Windows(np.array(x), np.array(u), np.array(y), runs[0].h)

    @staticmethod
    def whole(runs: list[Run]) -> Windows:
        """Each run as one, from rest."""
        n = min(len(r.u) for r in runs)
        x = np.array([[r.y[0, 0], r.y[0, 1], 0.0, 0.0] for r in runs])
        return Windows(x, np.array([r.u[:n] for r in runs]), np.array([r.y[:n] for r in runs]), runs[0].h)

    def errors(self, sheet: Sheet, extra: Extra | None = None, friction: Friction = FRICTIONLESS) -> np.ndarray:
        predicted = simulate(sheet, self.x, self.u, self.h, extra, friction)
        return np.nan_to_num(predicted - self.y, nan=10.0, posinf=10.0, neginf=-10.0).clip(-10, 10)


def fitted(
    sheet: Sheet, windows: Windows, whole: Windows, start: list[float], model: Callable[..., Friction]
) -> tuple[Friction, Sheet]:
    """Least squares on five factors of the sheet and the friction's numbers (not negative)."""
    low, high = [0.25] * 3 + [0.0] * 2 + [0.0] * len(start), [4.0] * 3 + [20.0] * 2 + [np.inf] * len(start)
    scale = np.array([1.0] * 5 + [max(s, 1e-9) for s in start])

    def residual(z: np.ndarray, on: Windows) -> np.ndarray:
        return on.errors(sheet.scaled(z[:5]), friction=model(*(z[5:] * scale[5:])))[:, 5::10].ravel()

    z = least_squares(
        residual,
        np.ones(5 + len(start)),
        bounds=(low, high),
        loss="soft_l1",
        f_scale=0.01,
        max_nfev=40,
        args=(windows,),
    ).x
    # Then over whole runs, as BAM does: short windows from noisy states leave a bias.
    longer = least_squares(residual, z, bounds=(low, high), loss="soft_l1", f_scale=0.1, max_nfev=40, args=(whole,)).x
    if (residual(longer, whole) ** 2).sum() < (residual(z, whole) ** 2).sum():
        z = longer
    return model(*(z[5:] * scale[5:])), sheet.scaled(z[:5])


def ladder(stall: float) -> list[tuple[str, list[float], Callable[..., Friction]]]:
    """Name, where its numbers start, and the friction that they make."""
    c, q = 0.02 * stall, 0.002 * stall
    return [
        ("viscous", [], lambda: FRICTIONLESS),
        ("Coulomb", [c], lambda c: (c, 0.0, 1.0, 0.0, 0.0)),
        ("Stribeck", [c, c, 0.5], lambda c, s, v: (c, s, v + 1e-6, 0.0, 0.0)),
        ("load-dependent", [c, 0.05], lambda c, k: (c, 0.0, 1.0, k, 0.0)),
        ("Stribeck, load-dependent", [c, c, 0.5, 0.05], lambda c, s, v, k: (c, s, v + 1e-6, k, 0.0)),
        ("quadratic", [c, q], lambda c, q: (c, 0.0, 1.0, 0.0, q)),
    ]


LIBRARY: dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]] = {
    "1": lambda x, u: 0 * u + 1,
    "theta": lambda x, u: x[..., 0],
    "theta^2": lambda x, u: x[..., 0] ** 2,
    "theta^3": lambda x, u: x[..., 0] ** 3,
    "sin(theta)": lambda x, u: np.sin(x[..., 0]),
    "cos(theta)": lambda x, u: np.cos(x[..., 0]),
    "theta_dot": lambda x, u: x[..., 2],
    "theta_dot|theta_dot|": lambda x, u: x[..., 2] * np.abs(x[..., 2]),
    "sign(theta_dot)": lambda x, u: np.tanh(x[..., 2] / SOFT),
    "alpha_dot": lambda x, u: x[..., 3],
    "alpha_dot|alpha_dot|": lambda x, u: x[..., 3] * np.abs(x[..., 3]),
    "sign(alpha_dot)": lambda x, u: np.tanh(x[..., 3] / SOFT),
    "alpha_dot|theta_dot|": lambda x, u: x[..., 3] * np.abs(x[..., 2]),
    "theta_dot|alpha_dot|": lambda x, u: x[..., 2] * np.abs(x[..., 3]),
    "sin(alpha)": lambda x, u: np.sin(x[..., 1]),
    "sin(2alpha)": lambda x, u: np.sin(2 * x[..., 1]),
    "u": lambda x, u: u,
    "u|u|": lambda x, u: u * np.abs(u),
    "sign(u)": lambda x, u: np.tanh(u / 0.05),
    "u theta": lambda x, u: u * x[..., 0],
    "u sin(theta)": lambda x, u: u * np.sin(x[..., 0]),
    "u cos(theta)": lambda x, u: u * np.cos(x[..., 0]),
    **{
        f"{f.__name__}({k}theta)": (lambda x, u, f=f, k=k: f(k * x[..., 0]))
        for k in range(2, 8)
        for f in (np.sin, np.cos)
    },
}


HARMONICS = 12  # the last of them


def left_over(sheet: Sheet, train: list[Run]) -> tuple[np.ndarray, np.ndarray]:
    """The library's values, and the torques that the sheet leaves unexplained on both axes."""
    features, left = [], []
    for run in train:
        x, acceleration = run.smoothed()
        n = len(run.u) - SMOOTH
        x, acceleration = x[SMOOTH:n], acceleration[SMOOTH:n]
        # The smoothing looks at both sides of a sample, the command is held after it.
        u = 0.5 * (run.u[SMOOTH:n] + run.u[SMOOTH - 1 : n - 1])
        m11, m12, m22 = sheet.inertia(x)
        arm, pendulum = sheet.torque(x, u)
        left.append(
            np.column_stack(
                [
                    m11 * acceleration[:, 0] + m12 * acceleration[:, 1] - arm,
                    m12 * acceleration[:, 0] + m22 * acceleration[:, 1] - pendulum,
                ]
            )
        )
        features.append(np.column_stack([f(x, u) for f in LIBRARY.values()]))
    return np.vstack(features), np.vstack(left)


def sindy(sheets: list[Sheet], train: list[Run], kept: Windows) -> tuple[str, Sheet, Extra]:
    """STLSQ of the torque left on either axis by one of the sheets; sheet, library and threshold are chosen on
    `kept`."""
    path = []
    for sheet in sheets:
        theta, target = left_over(sheet, train)
        size, spread = np.sqrt((theta**2).mean(axis=0)), target.std(axis=0)
        size[size == 0] = 1.0
        # Without and with the harmonics of the arm's angle, which are nearly the same function where the arm stays near
        # zero.
        for columns in (np.arange(len(LIBRARY) - HARMONICS), np.arange(len(LIBRARY))):
            for threshold in (0.02, 0.05, 0.1, 0.2, 0.4, 0.8):
                optimizer = pysindy.STLSQ(threshold=threshold)
                optimizer.fit(theta[:, columns] / size[columns], target / spread)
                coefficients = np.zeros((2, len(LIBRARY)))
                coefficients[:, columns] = optimizer.coef_ * spread[:, None] / size[columns]
                error = float((kept.errors(sheet, torques(coefficients)) ** 2).mean())
                path.append((error, sheet, coefficients))
    # The sparsest of those that predict nearly as well as the best.
    enough = 1.1 * min(error for error, _, _ in path)
    _, sheet, coefficients = min((p for p in path if p[0] <= enough), key=lambda p: np.count_nonzero(p[2]))
    names = []
    for axis, row in zip(("arm", "pendulum"), coefficients, strict=True):
        strongest = sorted(np.flatnonzero(row), key=lambda i: -abs(row[i]) * size[i])
        words = [list(LIBRARY)[i] for i in strongest[:3]]
        if words:
            names.append(
                f"{axis}: {', '.join(words)}" + (f" and {len(strongest) - 3} more" if len(strongest) > 3 else "")
            )
    return "; ".join(names) or "nothing", sheet, torques(coefficients)


def torques(coefficients: np.ndarray) -> Extra:
    used = [(i, f) for i, f in enumerate(LIBRARY.values()) if coefficients[:, i].any()]

    def extra(x: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        arm, pendulum = 0 * u, 0 * u
        for i, f in used:
            value = f(x, u)
            arm, pendulum = arm + coefficients[0, i] * value, pendulum + coefficients[1, i] * value
        return arm, pendulum

    return extra


def whole(run: Run, sheet: Sheet, extra: Extra | None = None, friction: Friction = FRICTIONLESS) -> tuple[float, float]:
    """RMS errors of both angles over the whole run, from rest."""
    x = np.array([[run.y[0, 0], run.y[0, 1], 0.0, 0.0]])
    predicted = simulate(sheet, x, run.u[None], run.h, extra, friction)[0]
    error = np.nan_to_num(predicted - run.y, nan=10.0, posinf=10.0, neginf=-10.0).clip(-10, 10)
    return tuple(np.sqrt((error**2).mean(axis=0)))  # type: ignore[return-value]


@dataclasses.dataclass
class Row:
    case: str
    truth: str
    method: str
    names: str
    rms: tuple[float, float]
    seconds: float


def made(hidden: str, seed: int, folder: pathlib.Path) -> pathlib.Path:
    """The benchmark's first case in which this alone is hidden, at its usual size; written where it is not there."""
    effects = () if hidden == "nothing" else (hidden,)
    case = next(case for case in plan(seed) if case.effects == effects)
    if not (folder / case.name / "truth.json").exists():
        case.write(folder)
    return folder / case.name


def mean_square(rows: list[tuple[float, float]]) -> tuple[float, float]:
    return tuple(np.sqrt((np.array(rows) ** 2).mean(axis=0)))  # type: ignore[return-value]


def compare(
    cli: list[str], case: str, truth: str, rig: pathlib.Path, train: list[pathlib.Path], unseen: list[pathlib.Path]
) -> list[Row]:
    runs, held = [Run.load(p) for p in train], [Run.load(p) for p in unseen]
    begin = time.perf_counter()
    given = Sheet.load(rig)
    hanging = [r for r in runs if np.cos(r.y[:, 1]).max() < 0.8]
    fitting, whole_runs, kept = Windows.of(runs, WINDOW), Windows.whole(hanging), Windows.of(hanging, CHOICE)
    _, sheet = fitted(given, fitting, whole_runs, [], lambda: FRICTIONLESS)
    shared = time.perf_counter() - begin
    rows = [Row(case, truth, "data sheet refitted", "", mean_square([whole(r, sheet) for r in held]), shared)]
    if pysindy is not None:
        begin = time.perf_counter()
        names, under, extra = sindy([given, sheet], runs, kept)
        rows.append(
            Row(
                case,
                truth,
                "discrepancy SINDy",
                names,
                mean_square([whole(r, under, extra) for r in held]),
                shared + time.perf_counter() - begin,
            )
        )
    begin, best = time.perf_counter(), None
    stall = given.drive * max(float(np.abs(r.u).max()) for r in runs)
    for name, start, model in ladder(stall):
        friction, rung = fitted(given, fitting, whole_runs, start, model)
        error = float((kept.errors(rung, friction=friction) ** 2).mean())
        if best is None or error < best[0]:
            best = (error, name, rung, friction)
    assert best is not None
    error = mean_square([whole(r, best[2], friction=best[3]) for r in held])
    rows.append(Row(case, truth, "friction ladder", best[1], error, time.perf_counter() - begin))
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder, "out.json")
        begin = time.perf_counter()
        command = [
            *cli,
            "diagnose",
            *map(str, train),
            "--rig",
            str(rig),
            "--json-file",
            str(out),
            "--verify",
            *map(str, unseen),
        ]
        subprocess.run(command, check=True, capture_output=True)
        seconds, answer = time.perf_counter() - begin, json.loads(out.read_text())
    names = ", ".join(e["id"] for e in answer["effects"])
    if answer["verdict"] == "unexplained":
        names = f"{names} (unexplained)".strip()
    if answer.get("custom"):
        names += "; expression: " + ", ".join(f"{t['on']} {t['expression']}" for t in answer["custom"]["terms"])
    table = {c: [r["repaired"] for r in answer["verification"] if r["channel"] == c] for c in ("theta", "alpha")}
    error = mean_square(list(zip(table["theta"], table["alpha"], strict=True)))
    rows.append(Row(case, truth, "furuta diagnose", names or answer["verdict"].replace("_", " "), error, seconds))
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cli", default="target/release/furuta")
    parser.add_argument("--cases", type=pathlib.Path, help="folder of cases with run-*.csv, rig.toml, truth.json")
    parser.add_argument("--seed", type=int, default=1, help="of the cases")
    parser.add_argument("--real", type=pathlib.Path, help="folder of the QUBE's chirps and rig.toml")
    parser.add_argument("--only", default=",".join(HIDDEN), help="what is hidden")
    parser.add_argument("--markdown", type=pathlib.Path, help="write the table here as well")
    a = parser.parse_args()
    if pysindy is None:
        print("pysindy is not installed: no rows of discrepancy SINDy (pip install pysindy)")
    cases = []
    for hidden in filter(None, a.only.split(",")) if a.cases else ():
        folder = made(hidden, a.seed, a.cases)
        train = [folder / "run-0-multisine.csv", folder / "run-2-balance.csv"]
        cases.append((folder.name, hidden, folder / "rig.toml", train, [folder / "run-1-steps.csv"]))
    if a.real:
        chirps = [[a.real / f"chirp-{way}-{n}.csv" for way in ("plus", "minus")] for n in (1, 5)]
        cases.append(("QUBE", "unknown", a.real / "rig.toml", *chirps))
    lines = ["| case | hidden | method | names | arm [rad] | pendulum [rad] | s |", "|---|---|---|---|---|---|---|"]
    print("\n".join(lines), flush=True)
    for case in cases:
        for r in compare(shlex.split(a.cli), *case):
            lines.append(
                f"| {r.case} | {r.truth} | {r.method} | {r.names} | {r.rms[0]:.4f} | {r.rms[1]:.4f} | {r.seconds:.1f} |"
            )
            print(lines[-1], flush=True)
    if a.markdown:
        a.markdown.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
