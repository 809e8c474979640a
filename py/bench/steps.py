"""RK4 steps of one rig: one called from Python, and 10,000 in one call."""

from __future__ import annotations

from collections.abc import Iterator

import furuta
import numpy as np
from clock import Contender, Work
from plant import RIG, coefficients, jax_equations, mujoco_model, native, numba_equations, plain
from table import NOTHING

H = 1e-3  # s
START = np.array([0.1, 2.9, -0.3, 0.4])
C = coefficients(RIG.parameters)
# Pieces of 0.1 s in which the command is constant: integrators of their own step restart at each.
PIECES, PIECE = 100, 100
LEVELS = 0.5 * np.sin(0.7 * np.arange(PIECES))
COMMANDS = np.repeat(LEVELS, PIECE)
ONE = 0.3  # V


def chained(step) -> np.ndarray:
    """A hundred steps, each from the last."""
    x = START
    for _ in range(100):
        x = step(x)
    return np.asarray(x)


def one_step(missing: list[str]) -> Work:
    answer = np.array(START)
    _, exact = plain()
    for _ in range(100):
        answer = np.array(exact(*answer, ONE, H, C))
    contenders = [Contender("furuta `Simulator.step`", *ours())]

    def add(name, run, check, tolerance=1e-12):
        contenders.append(Contender(name, run, lambda _: check(), tolerance))

    contenders.append(Contender(f"{NOTHING} function of Python", lambda: None))
    for build in (numba_step, mujoco_step, jax_step):
        try:
            add(*build())
        except ImportError as error:
            missing.append(f"{error.name} is not installed: left out of RK4 steps.")
    values = list(C)
    add("plain Python", lambda: exact(*START, ONE, H, values), lambda: chained(lambda x: exact(*x, ONE, H, values)))
    add(*scipy_step(), 1e-8)
    return Work(
        "One RK4 step of 1 ms, called from Python",
        "From the state and the command to the next state, the 100th of which is compared.",
        answer,
        contenders,
    )


def ours():
    plant = furuta.Simulator(RIG, START, H)
    step = plant.step

    def check(_):
        fresh = furuta.Simulator(RIG, START, H)
        return [fresh.step(ONE) for _ in range(100)][-1]

    return lambda: step(ONE), check


def numba_step():
    import numba

    _, step = numba_equations()

    @numba.njit(fastmath=True)
    def one(x, u, h, c):
        out = np.empty(4)
        out[0], out[1], out[2], out[3] = step(x[0], x[1], x[2], x[3], u, h, c)
        return out

    return "numba", lambda: one(START, ONE, H, C), lambda: chained(lambda x: one(x, ONE, H, C))


def mujoco_step():
    import mujoco

    model = mujoco_model(RIG, H)
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], data.ctrl[0] = START[:2], START[2:], ONE
    advance = mujoco.mj_step

    def check():
        fresh = mujoco.MjData(model)
        fresh.qpos[:], fresh.qvel[:], fresh.ctrl[0] = START[:2], START[2:], ONE
        for _ in range(100):
            advance(model, fresh)
        return np.concatenate([fresh.qpos, fresh.qvel])

    return "MuJoCo `mj_step`, RK4", lambda: advance(model, data), check, 1e-8


def jax_step():
    import jax
    import jax.numpy as jnp

    _, step = jax_equations()
    one = jax.jit(lambda x, u: jnp.stack(step(*x, u, H, C)))
    start = jnp.asarray(START)
    return "JAX, jit", lambda: one(start, ONE).block_until_ready(), lambda: chained(lambda x: one(x, ONE))


def scipy_step():
    from scipy.integrate import solve_ivp

    rate, _ = plain()

    def one(x):
        found = solve_ivp(lambda t, x: rate(x[1], x[2], x[3], ONE, C), (0, H), x, rtol=1e-8, atol=1e-10)
        return found.y[:, -1]

    return "SciPy `solve_ivp`, RK45, 1e-8", lambda: one(START), lambda: chained(one)


def many_steps(missing: list[str]) -> Work:
    answer = np.empty((len(COMMANDS) + 1, 4))
    answer[0] = START
    _, exact = plain()
    for k, u in enumerate(COMMANDS):
        answer[k + 1] = exact(*answer[k], u, H, C)
    contenders = [Contender("furuta `simulate`", lambda: furuta.simulate(RIG, START, COMMANDS, H), lambda x: x)]
    machine = native()
    if machine is None:
        missing.append("rustc is not there: the native program is left out.")
    else:
        run = lambda: machine.steps(START, COMMANDS, H, C)  # noqa: E731
        contenders.append(Contender("native, written by hand", run, lambda x: x))
    for build in (numba_many, jax_many, diffrax_many, scipy_many, mujoco_many):
        try:
            contenders.append(build())
        except ImportError as error:
            missing.append(f"{error.name} is not installed: left out of 10,000 steps.")
    return Work(
        "10,000 RK4 steps in one call",
        "10 s of one rig at 1 kHz, all states kept; the command changes every 0.1 s.",
        answer,
        contenders,
        [
            "diffrax takes 10,000 steps of its Tsit5, of order 5 with six stages; SciPy's DOP853 chooses its steps "
            "within each 0.1 s (relative tolerance 1e-9); its right-hand side is numba's."
        ],
    )


def numba_many() -> Contender:
    import numba

    _, step = numba_equations()

    @numba.njit(fastmath=True)
    def many(x, u, h, c):
        out = np.empty((len(u) + 1, 4))
        a, b, v, w = x[0], x[1], x[2], x[3]
        out[0] = x
        for k in range(len(u)):
            a, b, v, w = step(a, b, v, w, u[k], h, c)
            out[k + 1, 0], out[k + 1, 1], out[k + 1, 2], out[k + 1, 3] = a, b, v, w
        return out

    return Contender("numba", lambda: many(START, COMMANDS, H, C), lambda x: x)


def jax_many() -> Contender:
    import jax
    import jax.numpy as jnp

    _, step = jax_equations()

    @jax.jit
    def many(x, u):
        def next(x, u):
            x = step(*x, u, H, C)
            return x, jnp.stack(x)

        return jax.lax.scan(next, tuple(x), u)[1]

    start, commands = jnp.asarray(START), jnp.asarray(COMMANDS)
    return Contender(
        "JAX, jit of a scan", lambda: many(start, commands).block_until_ready(), lambda x: np.vstack([START, x])
    )


def diffrax_many() -> Contender:
    import diffrax
    import jax
    import jax.numpy as jnp

    rate, _ = jax_equations()
    ends = jnp.linspace(0.0, PIECE * H, PIECE + 1)
    term = diffrax.ODETerm(lambda t, x, u: jnp.stack(rate(x[1], x[2], x[3], u, C)))

    @jax.jit
    def many(x, u):
        def piece(x, u):
            kept = diffrax.SaveAt(steps=True)
            found = diffrax.diffeqsolve(
                term, diffrax.Tsit5(), 0.0, PIECE * H, None, x, args=u, saveat=kept, max_steps=PIECE + 1,
                stepsize_controller=diffrax.StepTo(ts=ends),
            )  # fmt: skip
            return found.ys[PIECE - 1], found.ys[:PIECE]

        return jax.lax.scan(piece, x, u)[1]

    start, levels = jnp.asarray(START), jnp.asarray(LEVELS)
    run = lambda: many(start, levels).block_until_ready()  # noqa: E731
    return Contender("diffrax, Tsit5", run, lambda x: np.vstack([START, np.reshape(x, (-1, 4))]), 1e-7)


def scipy_many() -> Contender:
    import numba
    from scipy.integrate import solve_ivp

    rate, _ = numba_equations()

    @numba.njit(fastmath=True)
    def right(t, x, u):
        out = np.empty(4)
        out[0], out[1], out[2], out[3] = rate(x[1], x[2], x[3], u, C)
        return out

    ends = np.linspace(0, PIECE * H, PIECE + 1)
    settings = {"method": "DOP853", "t_eval": ends, "rtol": 1e-9, "atol": 1e-12}

    def many():
        kept = [START[:, None]]
        for u in LEVELS:
            kept.append(solve_ivp(right, (0, ends[-1]), kept[-1][:, -1], args=(u,), **settings).y[:, 1:])
        return np.hstack(kept).T

    return Contender("SciPy `solve_ivp`, DOP853, 1e-9", many, lambda x: x, 1e-7)


def mujoco_many() -> Contender:
    import mujoco
    from mujoco import rollout

    model = mujoco_model(RIG, H)
    data = mujoco.MjData(model)
    state = np.concatenate([[0.0], START])[None]
    commands = COMMANDS[None, :, None]
    return Contender(
        "MuJoCo `rollout`, RK4",
        lambda: rollout.rollout(model, data, state, commands)[0],
        lambda x: np.vstack([START, x[0, :, 1:5]]),
        1e-6,
    )


def works(missing: list[str]) -> Iterator[Work]:
    yield one_step(missing)
    yield many_steps(missing)
