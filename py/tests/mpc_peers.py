"""Model predictive control beside other solvers of quadratic programs, in one run: `docs/mpc.md`.

    pip install numpy daqp osqp clarabel piqp tinympc
    python py/tests/mpc_peers.py [--rig qube-servo-2] [--rate 100] [--problems problems.json]

A run of the closed loop is made and solved by this project's controller (`cargo run --release -p furuta-design
--example mpc_problems`), and by what it had before, 30 steps of ADMM. Each other solver then gets the same quadratic
programs in the same order: 12 variables, hard limits. Samples in which a limit cannot be kept are left out, for these
have a price of its own. Solvers that can start from the sample before do.

Times are those inside of the solver where it says so (daqp, OSQP, Clarabel: theirs, without Python, without the update
of the limits), else those of the call; ours is the whole update, from the state to the command, by the system's clock.
Each is the shortest of several runs. Errors are those of the first move in V, against the solution of the linear
equations of the active limits, whose signs are checked here.
"""

import argparse
import contextlib
import json
import os
import pathlib
import subprocess
import sys
import time

import numpy as np

RUNS = 7


def exact(rows: np.ndarray, lower: np.ndarray, upper: np.ndarray, w: np.ndarray, y: np.ndarray) -> np.ndarray | None:
    """The solution for the limits active in (w, y), by linear equations; None where it is not the optimum."""
    active = np.flatnonzero(y)
    if not active.size:
        return np.zeros(rows.shape[1]) if (lower <= 1e-9).all() and (upper >= -1e-9).all() else None
    c, b = rows[active], np.where(y > 0, upper, lower)[active]
    size = active.size
    matrix = np.block([[np.eye(rows.shape[1]), c.T], [c, np.zeros((size, size))]])
    solution = np.linalg.solve(matrix, np.concatenate([np.zeros(rows.shape[1]), b]))
    # One step of refinement.
    rest = np.concatenate([np.zeros(rows.shape[1]), b]) - matrix @ solution
    solution += np.linalg.solve(matrix, rest)
    found, multipliers = solution[: rows.shape[1]], solution[rows.shape[1] :]
    value = rows @ found
    sound = (multipliers * np.sign(y[active]) >= -1e-9).all() and (value <= upper + 1e-9).all()
    return found if sound and (value >= lower - 1e-9).all() else None


def daqp_warm(rows, lower, upper):
    import daqp

    n = rows.shape[1]
    model = daqp.Model()
    model.setup(np.eye(n), np.zeros(n), rows, upper[0].copy(), lower[0].copy())
    for low, high in zip(lower, upper, strict=True):
        model.update(bupper=high, blower=low)
        x, _, flag, info = model.solve()
        yield (x if flag == 1 else None), info["solve_time"]


def daqp_cold(rows, lower, upper):
    import daqp

    n = rows.shape[1]
    square, zero = np.eye(n), np.zeros(n)
    for low, high in zip(lower, upper, strict=True):
        x, _, flag, info = daqp.solve(square, zero, rows, high, low)
        yield (x if flag == 1 else None), info["solve_time"] + info["setup_time"]


def osqp_warm(rows, lower, upper):
    import osqp
    from scipy import sparse

    n = rows.shape[1]
    solver = osqp.OSQP()
    solver.setup(
        P=sparse.eye(n, format="csc"),
        q=np.zeros(n),
        A=sparse.csc_matrix(rows),
        l=lower[0],
        u=upper[0],
        verbose=False,
        eps_abs=1e-5,
        eps_rel=1e-5,
    )
    for low, high in zip(lower, upper, strict=True):
        solver.update(l=low, u=high)
        result = solver.solve()
        # 1: solved.
        yield (result.x if result.info.status_val == 1 else None), result.info.solve_time + result.info.update_time


def clarabel_cold(rows, lower, upper):
    import clarabel
    from scipy import sparse

    n, m = rows.shape[1], rows.shape[0]
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-12
    square, both = sparse.eye(n, format="csc"), sparse.csc_matrix(np.vstack([rows, -rows]))
    cones = [clarabel.NonnegativeConeT(2 * m)]
    for low, high in zip(lower, upper, strict=True):
        solver = clarabel.DefaultSolver(square, np.zeros(n), both, np.concatenate([high, -low]), cones, settings)
        solution = solver.solve()
        yield np.array(solution.x), solution.solve_time


def piqp_warm(rows, lower, upper):
    import piqp

    n = rows.shape[1]
    solver = piqp.DenseSolver()
    solver.settings.verbose = False
    solver.settings.compute_timings = True
    solver.setup(np.eye(n), np.zeros(n), None, None, rows, lower[0], upper[0])
    for low, high in zip(lower, upper, strict=True):
        solver.update(h_l=low, h_u=high)
        solver.solve()
        yield np.array(solver.result.x), solver.result.info.run_time


@contextlib.contextmanager
def silent():
    """Without what a library writes to the standard output of the process."""
    kept, nothing = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 1)
    try:
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nothing)


def tinympc_warm(problems, horizon=100):
    """Its own problem: a move in each sample, a fifth of a second ahead, to its own tolerance of 1e-3."""
    import tinympc

    a, b = np.array(problems["a"]).reshape(4, 4), np.array(problems["b"]).reshape(4, 1)
    solver = tinympc.TinyMPC()
    lean = problems["pendulum_limit"]
    # It takes no zeros in Q.
    q = np.diag(np.maximum(problems["q"], 1e-6))
    far = np.array([1e3, lean, 1e3, 1e3])
    solver.setup(a, b, q, np.array([[problems["r"]]]), horizon, rho=1.0, verbose=False, max_iter=100)
    limit = np.array([problems["command_limit"]])
    solver.set_bound_constraints(-far, far, -limit, limit)
    for sample in problems["samples"]:
        error = np.array(sample["x"]) - np.array(sample["reference"])
        solver.set_x0(error)
        begin = time.perf_counter()
        solver._solver.solve()
        yield None, time.perf_counter() - begin


def row(name: str, seconds: np.ndarray, errors: np.ndarray | None, failed: int, ours: np.ndarray) -> str:
    micro, own = 1e6 * seconds, 1e6 * ours
    median, late = np.median(micro), np.percentile(micro, 99)
    worst = "own problem" if errors is None else f"{errors.max():.1e}"
    return (
        f"| {name} | {median:.3f} | {late:.3f} | {micro.max():.2f} | {median / np.median(own):.1f} "
        f"| {late / np.percentile(own, 99):.1f} | {worst} | {failed} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rig", default="qube-servo-2")
    parser.add_argument("--rate", type=float, help="limit of the command's rate, V/s; none if left out")
    parser.add_argument("--problems", type=pathlib.Path, help="JSON of the example, made before")
    a = parser.parse_args()
    if a.problems:
        text = a.problems.read_text()
    else:
        command = ["cargo", "run", "--release", "-q", "-p", "furuta-design", "--example", "mpc_problems", "--", a.rig]
        command += [] if a.rate is None else [str(a.rate)]
        text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    problems = json.loads(text)
    rows, prices = np.array(problems["rows"]), np.array(problems["prices"])
    every = problems["samples"]
    inside = [s for s in every if (np.abs(s["y"]) < np.where(prices < 0, np.inf, prices)).all()]
    lower, upper = (np.array([s[side] for s in inside]) for side in ("lower", "upper"))
    answers = [exact(rows, *(np.array(s[k]) for k in ("lower", "upper", "w", "y"))) for s in inside]
    wrong = sum(x is None for x in answers)
    first = problems["first"]
    true = np.array([np.nan if x is None else first * x[0] for x in answers])
    active = np.array([bool(np.any(s["y"])) for s in inside])
    sys.stdout.flush()
    print(f"{problems['rig']}: {len(every)} samples, {len(inside)} in which all limits can be kept, {active.sum()} with")
    print(f"active limits, at most {max(s['active'] for s in inside)}; {wrong} solutions that are not optimal; the clock")
    print(f"itself takes {1e6 * problems['floor']:.3f} us", flush=True)
    ours = np.array([s["s"] for s in inside])
    measured = {"furuta": (ours, np.array([first * s["w"][0] for s in inside]) - true, 0)}
    command_limit = problems["command_limit"]
    admm = np.array([s["admm_u"] - s["u"] for s in inside])
    measured["furuta before, 30 steps of ADMM"] = (np.array([s["admm_s"] for s in inside]), admm, 0)
    solvers = {
        "daqp, warm": daqp_warm,
        "daqp, cold": daqp_cold,
        "OSQP, warm, 1e-5": osqp_warm,
        "PIQP, warm": piqp_warm,
        "Clarabel, 1e-12": clarabel_cold,
    }
    for name, solver in solvers.items():
        runs = RUNS if "daqp" in name else 2
        try:
            results = [list(solver(rows, lower, upper)) for _ in range(runs)]
        except ImportError as missing:
            print(f"{name}: {missing}")
            continue
        seconds = np.min([[t for _, t in result] for result in results], axis=0)
        found = np.array([np.nan if x is None else first * x[0] for x, _ in results[0]])
        measured[name] = (seconds, found - true, int(np.isnan(found).sum()))
    try:
        with silent():
            results = [[t for _, t in tinympc_warm(problems)] for _ in range(2)]
        kept = np.array([(np.abs(s["y"]) < np.where(prices < 0, np.inf, prices)).all() for s in every])
        measured["TinyMPC, 100 samples ahead"] = (np.min(results, axis=0)[kept], None, 0)
    except ImportError as missing:
        print(f"TinyMPC: {missing}")
    for title, chosen in (("all samples", np.full(active.shape, True)), ("samples with active limits", active)):
        print(f"\n{title} ({chosen.sum()}), command limit {command_limit} V")
        print("| solver | median, us | 99 % within, us | most, us | median / ours | 99 % / ours | error, V | failed |")
        print("|---|---|---|---|---|---|---|---|")
        for name, (seconds, errors, failed) in measured.items():
            error = None if errors is None else np.abs(errors[chosen][~np.isnan(errors[chosen])])
            print(row(name, seconds[chosen], error, failed, ours[chosen]))


if __name__ == "__main__":
    main()
