"""How far fixed-step RK4 (``furuta.simulate``) is off, by sample period: the table of ``docs/accuracy.md``.

python py/tests/accuracy.py > docs/accuracy.md
"""

from __future__ import annotations

import functools

import furuta
import lagrange
import numpy as np

PERIODS = (1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2)  # s
SECONDS, EVERY = 10.0, 1e-2  # looked at where all periods have a sample
STATES = ("theta", "alpha", "theta_dot", "alpha_dot")
STARTS = {"falling": (0.0, 0.1, 0.0, 0.0), "hanging": (0.3, 2.0, -1.0, 3.0)}

# Differences of this size are rounding: of the reference (relative tolerance 1e-12 a step) and of up to 100,000 steps
# of RK4.
ROUNDING = 2e-11

HEADER = """# Accuracy of fixed-step RK4

Written by `python py/tests/accuracy.py > docs/accuracy.md`; `py/tests/test_accuracy.py` asserts the order and the bound
at 1 ms.

Largest error over 10 s of each state of `furuta.simulate` (rad, rad/s), one RK4 step a sample, against SciPy's DOP853
at a relative tolerance of 1e-12 on equations that SymPy derives from the energies. Free motion without a command from
two starts, [theta, alpha, theta_dot, alpha_dot]: falling from near the upright {falling},
and swinging about hanging {hanging}. The order is that of the largest of the four errors between
this period and the one above; `-` where an error is rounding (below {rounding:.0e}).

A pendulum that falls multiplies every error: from this start, within the 10 s, by
{growth},
measured by moving the start by 1e-6 rad. These motions are damped by the arm's motor and soon stay below the upright,
so the factor is bounded. Where a motion passes the upright again and again, under a strong command for instance, errors
grow without bound and no period is short enough for long.
"""


@functools.cache
def reference(name: str, start: str) -> np.ndarray:
    """States every 10 ms."""
    return derived(furuta.Rig.load(name), STARTS[start])


def derived(rig: furuta.Rig, x0: tuple[float, ...]) -> np.ndarray:
    p = rig.parameters
    (_, damping), viscous = lagrange.motor(p), p["pendulum.viscous"]
    times = EVERY * np.arange(round(SECONDS / EVERY) + 1)
    return lagrange.integrate(
        lagrange.constants(p), lambda t, x: (-damping * x[2], -viscous * x[3]), x0, times, rtol=1e-12, atol=1e-14
    )


def error(name: str, start: str, period: float) -> np.ndarray:
    """Largest error of each state."""
    skip = round(EVERY / period)
    x = furuta.simulate(furuta.Rig.load(name), STARTS[start], np.zeros(round(SECONDS / period)), period)[::skip]
    return np.abs(x - reference(name, start)).max(axis=0)


def order(coarse: float, fine: float, ratio: float) -> float | None:
    """Of the method, from errors at periods that differ by ``ratio``; none where rounding is what is seen."""
    return None if fine < ROUNDING else float(np.log(coarse / fine) / np.log(ratio))


def growth(name: str, start: str) -> float:
    """By how much the motion multiplies a small difference, at most."""
    moved = np.array(STARTS[start]) + [0.0, 1e-6, 0.0, 0.0]
    x = derived(furuta.Rig.load(name), moved) - reference(name, start)
    return float(np.abs(x).max() / 1e-6)


def main() -> None:
    grown = ", ".join(f"{growth(name, 'falling'):.0f} ({name})" for name in furuta.Rig.VOLTAGE)
    print(
        HEADER.format(falling=list(STARTS["falling"]), hanging=list(STARTS["hanging"]), rounding=ROUNDING, growth=grown)
    )
    print("| rig | start | period (ms) | " + " | ".join(STATES) + " | order |\n|---|---|---:|" + "---:|" * 5)
    for name in furuta.Rig.VOLTAGE:
        for start in STARTS:
            above = None
            for period in reversed(PERIODS):
                e = error(name, start, period)
                p = order(above[1], e.max(), above[0] / period) if above else None
                cells = " | ".join(f"{v:.1e}" for v in e)
                print(f"| {name} | {start} | {1e3 * period:g} | {cells} | {'-' if p is None else f'{p:.2f}'} |")
                above = period, e.max()


if __name__ == "__main__":
    main()
