"""Equations of motion of the Furuta pendulum from its energies alone: SymPy differentiates, SciPy integrates.

Written from the picture (where the masses are), not from the project's formulas, so that agreement means something.
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np
import sympy as sp
from scipy.integrate import solve_ivp

ARGUMENTS = "J m L c I It Ia g".split()  # arm inertia, pendulum mass, arm length, centre of mass, inertias, gravity


@functools.cache
def equations() -> tuple[Callable[..., np.ndarray], Callable[..., np.ndarray]]:
    """Functions of (theta, alpha, theta_dot, alpha_dot, J, m, L, c, I, It, Ia, g): mass matrix, and M q'' - torques at q'' = 0."""
    time = sp.Symbol("t")
    J, m, L, c, I, It, Ia, g = values = sp.symbols(ARGUMENTS)
    theta, alpha = (sp.Function(name)(time) for name in ("theta", "alpha"))

    arm = sp.rot_axis3(-theta)  # turns the arm about the vertical; SymPy's rot_axis* turn the frame, hence the sign
    pendulum = arm * sp.rot_axis1(-alpha)  # and the pendulum about the arm
    centre = arm * sp.Matrix([L, 0, 0]) + pendulum * sp.Matrix([0, 0, c])
    velocity = centre.diff(time)
    # angular velocity of the pendulum in its own frame, where its inertia is diag(I, It, Ia)
    spin = pendulum.T * pendulum.diff(time)
    omega = sp.Matrix([spin[2, 1], spin[0, 2], spin[1, 0]])
    kinetic = (J * theta.diff() ** 2 + m * velocity.dot(velocity) + omega.dot(sp.diag(I, It, Ia) * omega)) / 2
    lagrangian = kinetic - m * g * centre[2]

    q = (theta, alpha)
    rates = sp.symbols("theta_dot alpha_dot")
    accelerations = sp.symbols("theta_ddot alpha_ddot")
    angles = sp.symbols("theta alpha")
    known = [(x.diff(time, 2), a) for x, a in zip(q, accelerations)] + [(x.diff(time), r) for x, r in zip(q, rates)] + list(zip(q, angles))
    left = sp.Matrix([lagrangian.diff(x.diff(time)).diff(time) - lagrangian.diff(x) for x in q]).subs(known)
    left = sp.simplify(left)
    mass = left.jacobian(accelerations)
    rest = left.subs(dict.fromkeys(accelerations, 0))
    inputs = (*angles, *rates, *values)
    return sp.lambdify(inputs, mass, "numpy"), sp.lambdify(inputs, rest, "numpy")


def integrate(
    values: dict[str, float],
    torque: Callable[[float, np.ndarray], tuple[float, float]],
    x0: np.ndarray,
    times: np.ndarray,
    **options: object,
) -> np.ndarray:
    """States (N, 4) at ``times`` under generalized torques ``torque(t, x)``; starts anew at every time, where commands may jump."""
    mass, rest = equations()
    constants = [values[name] for name in ARGUMENTS]

    def derivative(t: float, x: np.ndarray) -> np.ndarray:
        acceleration = np.linalg.solve(mass(*x, *constants), np.asarray(torque(t, x)) - np.ravel(rest(*x, *constants)))
        return np.concatenate([x[2:], acceleration])

    settings = {"method": "DOP853", "rtol": 1e-10, "atol": 1e-12} | options
    states = [np.asarray(x0, float)]
    for begin, end in zip(times[:-1], times[1:]):
        states.append(solve_ivp(derivative, (begin, end), states[-1], **settings).y[:, -1])
    return np.array(states)
