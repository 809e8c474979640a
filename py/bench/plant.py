"""The rig's equations of motion and a step of RK4, written once for plain Python, numba and JAX; a hand-written native
program of the same; MuJoCo's model of the rig.

Independent of furuta's own code: coefficients come from the rig's parameters, the equations are those of docs/model.md.
"""

from __future__ import annotations

import ctypes
import functools
import math
import pathlib
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from typing import Any

import furuta
import numpy as np

RIG = furuta.Rig.load("fong2014-emecs")
NATIVE = pathlib.Path(__file__).with_name("native.rs")


def coefficients(p: dict[str, Any]) -> np.ndarray:
    """Of the equations: arm, swing, coupling, pendulum, weight, drive, both dampings; of numbers or arrays."""
    m, length, com = p["pendulum.mass"], p["arm.length"], p["pendulum.com"]
    per_volt = p["motor.torque_constant"] * p["motor.gear_ratio"] * p["motor.efficiency"] / p["motor.resistance"]
    values = (
        p["arm.inertia"] + m * length**2 + p["pendulum.inertia_axial"],
        m * com**2 + p["pendulum.inertia_transverse"] - p["pendulum.inertia_axial"],
        m * length * com,
        p["pendulum.inertia"] + m * com**2,
        m * com * p["environment.gravity"],
        p["motor.amplifier_gain"] * per_volt,
        p["arm.viscous"] + per_volt * p["motor.back_emf_constant"] * p["motor.gear_ratio"],
        p["pendulum.viscous"],
    )
    return np.ascontiguousarray(np.stack(np.broadcast_arrays(*values), axis=-1), dtype=float)


def equations(sin: Any, cos: Any, compiled: Callable[[Any], Any] = lambda f: f) -> tuple[Any, Any]:
    """The derivative of the state and a step of RK4, for these functions."""

    @compiled
    def rate(alpha, v, w, u, c):
        s, k = sin(alpha), cos(alpha)
        m11, m12 = c[0] + c[1] * s * s, -c[2] * k
        twist = c[1] * s * k * v
        a = c[5] * u - c[6] * v - 2.0 * twist * w - c[2] * s * w * w
        b = c[4] * s - c[7] * w + twist * v
        over = 1.0 / (m11 * c[3] - m12 * m12)
        return v, w, (c[3] * a - m12 * b) * over, (m11 * b - m12 * a) * over

    @compiled
    def step(x0, x1, x2, x3, u, h, c):
        a0, a1, a2, a3 = rate(x1, x2, x3, u, c)
        g = 0.5 * h
        b0, b1, b2, b3 = rate(x1 + g * a1, x2 + g * a2, x3 + g * a3, u, c)
        c0, c1, c2, c3 = rate(x1 + g * b1, x2 + g * b2, x3 + g * b3, u, c)
        d0, d1, d2, d3 = rate(x1 + h * c1, x2 + h * c2, x3 + h * c3, u, c)
        s = h / 6.0
        return (
            x0 + s * (a0 + 2.0 * (b0 + c0) + d0),
            x1 + s * (a1 + 2.0 * (b1 + c1) + d1),
            x2 + s * (a2 + 2.0 * (b2 + c2) + d2),
            x3 + s * (a3 + 2.0 * (b3 + c3) + d3),
        )

    return rate, step


@functools.cache
def plain() -> tuple[Any, Any]:
    """`equations` in plain Python."""
    return equations(math.sin, math.cos)


@functools.cache
def numba_equations() -> tuple[Any, Any]:
    """`equations` compiled by numba, which may reorder sums."""
    import numba

    return equations(math.sin, math.cos, numba.njit(fastmath=True))


@functools.cache
def jax_equations() -> tuple[Any, Any]:
    """`equations` of arrays, in double precision."""
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    return equations(jnp.sin, jnp.cos)


def mujoco_model(rig: furuta.Rig, h: float) -> Any:
    """MuJoCo's model of the rig with RK4 steps of `h` s."""
    import mujoco

    return mujoco.MjModel.from_xml_string(rig.to_mjcf(timestep=h))


class Native:
    """`native.rs` as a library: what this machine can do."""

    def __init__(self, path: pathlib.Path) -> None:
        library = ctypes.CDLL(str(path))
        self._steps, self._rollouts = library.steps, library.rollouts
        for function in (self._steps, self._rollouts):
            function.restype = None

    def steps(self, x: np.ndarray, u: np.ndarray, h: float, c: np.ndarray) -> np.ndarray:
        """Every state, shape (len(u) + 1, 4)."""
        out = np.empty((len(u) + 1, 4))
        out[0] = x
        self._steps(_pointer(c), _pointer(out), _pointer(u), ctypes.c_size_t(len(u)), ctypes.c_double(h))
        return out

    def rollouts(self, x: np.ndarray, u: np.ndarray, h: float, c: np.ndarray) -> np.ndarray:
        """The last state of each, shape (N, 4)."""
        out = x.copy()
        sizes = ctypes.c_size_t(len(x)), ctypes.c_size_t(len(u))
        self._rollouts(_pointer(c), _pointer(out), _pointer(u), *sizes, ctypes.c_double(h))
        return out


def _pointer(values: np.ndarray) -> ctypes.c_void_p:
    return ctypes.c_void_p(values.ctypes.data)


@functools.cache
def native() -> Native | None:
    """None where there is no Rust compiler."""
    if shutil.which("rustc") is None:
        return None
    folder = pathlib.Path(tempfile.mkdtemp())
    library = folder / "native.so"
    options = ["-C", "opt-level=3", "-C", "target-cpu=native", "--crate-type", "cdylib", "--edition", "2021"]
    subprocess.run(["rustc", *options, "-o", library, NATIVE], check=True)
    return Native(library)
