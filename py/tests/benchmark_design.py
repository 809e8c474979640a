"""Times furuta's designs against SciPy and python-control on the upright QUBE-Servo 2 and prints the ratios: `python
py/tests/benchmark_design.py`.

Best of seven repeats in one process, so that all are measured on the same machine in the same minute. Both ways of
calling are what a user writes: Python arrays in, Python arrays out. python-control is measured where it is installed,
with SLICOT behind it where slycot is.
"""

import os
import timeit
from collections.abc import Callable

# Before NumPy is loaded: on 4 x 4 matrices threads only wait for each other, to the peers' disadvantage.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import scipy.linalg
import scipy.signal

import furuta


def seconds(call: Callable[[], object]) -> float:
    timer = timeit.Timer(call)
    number, _ = timer.autorange()
    return min(timer.repeat(repeat=7, number=max(1, number // 5))) / max(1, number // 5)


def main() -> None:
    rig = furuta.Rig.load("qube-servo-2")
    a, b = furuta.linearize(rig)
    ad, bd = furuta.zero_order_hold(a, b, 0.002)
    q, r = np.diag([5.0, 1.0, 0.1, 0.1]), np.array([[0.1]])
    c, noise, sensor = np.eye(2, 4), np.eye(4), 0.01 * np.eye(2)
    poles = np.array([-3.0, -20.0, -6.0 + 2.0j, -6.0 - 2.0j])
    rows: list[tuple[str, Callable[[], object], str, Callable[[], object]]] = [
        (
            "lqr",
            lambda: furuta.lqr(a, b, q, r),
            "scipy.linalg.solve_continuous_are",
            lambda: scipy.linalg.solve_continuous_are(a, b, q, r),
        ),
        (
            "dlqr",
            lambda: furuta.dlqr(ad, bd, q, r),
            "scipy.linalg.solve_discrete_are",
            lambda: scipy.linalg.solve_discrete_are(ad, bd, q, r),
        ),
        (
            "place",
            lambda: furuta.place(a, b, poles),
            "scipy.signal.place_poles",
            lambda: scipy.signal.place_poles(a, b, poles),
        ),
    ]
    try:
        import control
    except ImportError:
        print("python-control is not installed: pip install control slycot")
    else:
        rows += [
            ("lqr", lambda: furuta.lqr(a, b, q, r), "control.lqr", lambda: control.lqr(a, b, q, r)),
            ("dlqr", lambda: furuta.dlqr(ad, bd, q, r), "control.dlqr", lambda: control.dlqr(ad, bd, q, r)),
            (
                "dlqe",
                lambda: furuta.dlqe(ad, np.eye(4), c, noise, sensor),
                "control.dlqe",
                lambda: control.dlqe(ad, np.eye(4), c, noise, sensor),
            ),
            ("place", lambda: furuta.place(a, b, poles), "control.place", lambda: control.place(a, b, poles)),
        ]
    print(f"{'furuta':8} {'us':>8}   {'against':34} {'us':>8} {'ratio':>7}")
    for name, ours, other, theirs in rows:
        mine, peer = seconds(ours), seconds(theirs)
        print(f"{name:8} {1e6 * mine:8.1f}   {other:34} {1e6 * peer:8.1f} {peer / mine:7.1f}")


if __name__ == "__main__":
    main()
