"""Linear-quadratic regulators of the rig, continuous and sampled: gain, cost and poles."""

from __future__ import annotations

from collections.abc import Iterator

import furuta
import numpy as np
from clock import Contender, Work
from plant import RIG
from scipy import linalg

Q, R = np.diag([5.0, 1.0, 0.1, 0.1]), np.array([[0.1]])
A, B = furuta.linearize(RIG)
AD, BD = furuta.zero_order_hold(A, B, 0.002)


def gains(found) -> np.ndarray:
    return np.asarray(found[0]).ravel()


def scipy_lqr():
    s = linalg.solve_continuous_are(A, B, Q, R)
    k = np.linalg.solve(R, B.T @ s)
    return k, s, np.linalg.eigvals(A - B @ k)


def scipy_dlqr():
    s = linalg.solve_discrete_are(AD, BD, Q, R)
    k = np.linalg.solve(R + BD.T @ s @ BD, BD.T @ s @ AD)
    return k, s, np.linalg.eigvals(AD - BD @ k)


def works(missing: list[str]) -> Iterator[Work]:
    others: dict[str, list[Contender]] = {"lqr": [], "dlqr": []}
    try:
        import control
    except ImportError as error:
        missing.append(f"{error.name} is not installed: left out of the regulators.")
    else:
        for method in ("slycot", "scipy"):
            try:
                control.lqr(A, B, Q, R, method=method)
            except Exception as error:  # python-control says it with an error of its own
                missing.append(f"python-control with {method}: {error}")
                continue
            for name, a, b in (("lqr", A, B), ("dlqr", AD, BD)):
                design = getattr(control, name)
                run = lambda design=design, a=a, b=b, method=method: design(a, b, Q, R, method=method)  # noqa: E731
                others[name].append(Contender(f"python-control `{name}`, {method}", run, gains, 1e-8))
    for name, sort, a, b, scipys in (
        ("lqr", "continuous", A, B, scipy_lqr),
        ("dlqr", "sampled at 500 Hz", AD, BD, scipy_dlqr),
    ):
        ours = getattr(furuta, name)
        solver = "solve_continuous_are" if name == "lqr" else "solve_discrete_are"
        yield Work(
            f"A linear-quadratic regulator, {sort}",
            "Gain, cost matrix and poles of the closed loop for the upright rig, four states; gains are compared with "
            "SciPy's, which are right to about 1e-11.",
            gains(scipys()),
            [
                Contender(f"furuta `{name}`", lambda ours=ours, a=a, b=b: ours(a, b, Q, R), gains, 1e-8),
                Contender(f"SciPy `{solver}`, `eigvals`", scipys, gains, 1e-8),
                *others[name],
            ],
        )
    try:
        import control  # noqa: F811

        def contender(method: str) -> Contender:
            run = lambda: control.dare(AD, BD, Q, R, method=method)  # noqa: E731
            return Contender(f"python-control `dare`, {method}", run, lambda found: found[0], 1e-6)

        kept = [method for method in ("slycot", "scipy") if any(method in one.name for one in others["lqr"])]
        with_slycot = [contender(method) for method in kept]
    except ImportError:
        with_slycot = []
    yield Work(
        "The discrete Riccati equation alone",
        "`dare` for the same system: cost matrix, whose largest entry is of the order of 1e3, and gain.",
        linalg.solve_discrete_are(AD, BD, Q, R),
        [
            Contender("furuta `dare`", lambda: furuta.dare(AD, BD, Q, R), lambda f: f[0], 1e-6),
            Contender("SciPy `solve_discrete_are`", lambda: linalg.solve_discrete_are(AD, BD, Q, R), lambda x: x, 1e-6),
            *with_slycot,
        ],
    )
