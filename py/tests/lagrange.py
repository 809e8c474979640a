"""Equations of motion of the Furuta pendulum from its energies alone: SymPy differentiates, SciPy integrates.

Written from the picture (where the masses are, which way is down), not from the project's formulas, so that agreement
means something.
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np
import sympy as sp
from scipy.integrate import solve_ivp

# Arm inertia, pendulum mass, arm length, centre of mass, inertias (hinge, transverse, axial), gravity; the base leans
# by `lean` (0 unless given) towards the arm's direction theta = `towards`.
ARGUMENTS = "J m L c I It Ia g lean towards".split()


@functools.cache
def equations() -> Callable[..., tuple[float, float, float, float, float]]:
    """Function of (theta, alpha, theta_dot, alpha_dot, J, m, L, c, I, It, Ia, g, lean, towards): the mass matrix's M11,
    M12, M22, and the two of M q'' - torques at q'' = 0."""
    time = sp.Symbol("t")
    J, m, L, c, I, It, Ia, g, lean, towards = values = sp.symbols(ARGUMENTS)
    theta, alpha = (sp.Function(name)(time) for name in ("theta", "alpha"))

    arm = sp.rot_axis3(-theta)  # turns the arm about the vertical; SymPy's rot_axis* turn the frame, hence the sign
    pendulum = arm * sp.rot_axis1(-alpha)  # and the pendulum about the arm
    centre = arm * sp.Matrix([L, 0, 0]) + pendulum * sp.Matrix([0, 0, c])
    velocity = centre.diff(time)
    # angular velocity of the pendulum in its own frame, where its inertia is diag(I, It, Ia)
    spin = pendulum.T * pendulum.diff(time)
    omega = sp.Matrix([spin[2, 1], spin[0, 2], spin[1, 0]])
    kinetic = (J * theta.diff() ** 2 + m * velocity.dot(velocity) + omega.dot(sp.diag(I, It, Ia) * omega)) / 2
    # the base's axis leans towards `towards`: its own z is up by cos(lean) only, and a point out in that direction is
    # down by sin(lean)
    down = sp.Matrix([sp.sin(lean) * sp.cos(towards), sp.sin(lean) * sp.sin(towards), -sp.cos(lean)])
    lagrangian = kinetic + m * g * down.dot(centre)

    q = (theta, alpha)
    rates = sp.symbols("theta_dot alpha_dot")
    accelerations = sp.symbols("theta_ddot alpha_ddot")
    angles = sp.symbols("theta alpha")
    known = (
        [(x.diff(time, 2), a) for x, a in zip(q, accelerations)]
        + [(x.diff(time), r) for x, r in zip(q, rates)]
        + list(zip(q, angles))
    )
    left = sp.Matrix([lagrangian.diff(x.diff(time)).diff(time) - lagrangian.diff(x) for x in q]).subs(known)
    left = sp.expand(left)
    mass = sp.simplify(left.jacobian(accelerations))
    rest = sp.simplify(left.subs(dict.fromkeys(accelerations, 0)))
    outputs = [mass[0, 0], mass[0, 1], mass[1, 1], rest[0], rest[1]]
    return sp.lambdify((*angles, *rates, *values), outputs, modules="math", cse=True)


def constants(parameters: dict[str, float]) -> dict[str, float]:
    """Values of ``ARGUMENTS`` from a rig file's numbers."""
    keys = {
        "J": "arm.inertia", "m": "pendulum.mass", "L": "arm.length", "c": "pendulum.com", "I": "pendulum.inertia",
        "It": "pendulum.inertia_transverse", "Ia": "pendulum.inertia_axial", "g": "environment.gravity",
    }  # fmt: skip
    return {symbol: parameters[key] for symbol, key in keys.items()}


def motor(parameters: dict[str, float]) -> tuple[float, float]:
    """Torque per volt and damping of the arm, N m/V and N m s/rad, from a rig file's numbers."""
    p = {key.split(".")[1]: value for key, value in parameters.items() if key.startswith("motor")}
    shaft = p["torque_constant"] * p["gear_ratio"] * p["efficiency"] / p["resistance"]
    return p["amplifier_gain"] * shaft, shaft * p["back_emf_constant"] * p["gear_ratio"] + parameters["arm.viscous"]


def accelerations(values: dict[str, float], x: np.ndarray, torque: tuple[float, float]) -> tuple[float, float]:
    """[theta'', alpha''] of [theta, alpha, theta_dot, alpha_dot] under generalized torques."""
    m11, m12, m22, r1, r2 = equations()(*x, *(values.get(name, 0.0) for name in ARGUMENTS))
    a, b = torque[0] - r1, torque[1] - r2
    determinant = m11 * m22 - m12 * m12
    return (m22 * a - m12 * b) / determinant, (m11 * b - m12 * a) / determinant


def integrate(
    values: dict[str, float],
    torque: Callable[[float, list[float]], tuple[float, ...]],
    x0: np.ndarray,
    times: np.ndarray,
    **options: object,
) -> np.ndarray:
    """States at ``times``; the integrator starts anew at each of them, where commands may jump.

    ``torque(t, x)`` gives the generalized torques on arm and pendulum. ``x`` is [theta, alpha, theta_dot, alpha_dot],
    and behind it whatever else moves: its rates follow the two torques.
    """

    def derivative(t: float, x: np.ndarray) -> list[float]:
        x = x.tolist()
        arm, pendulum, *rates = torque(t, x)
        return [*x[2:4], *accelerations(values, x[:4], (arm, pendulum)), *rates]

    settings = {"method": "DOP853", "rtol": 1e-10, "atol": 1e-12} | options
    states = [np.asarray(x0, float)]
    for begin, end in zip(times[:-1], times[1:]):
        states.append(solve_ivp(derivative, (begin, end), states[-1], **settings).y[:, -1])
    return np.array(states)
