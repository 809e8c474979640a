"""10,000 rollouts of 2 s at 1 kHz from different starts, of rigs whose pendulums differ in mass."""

from __future__ import annotations

from collections.abc import Iterator

import furuta
import numpy as np
from clock import Contender, Work
from plant import RIG, coefficients, jax_equations, mujoco_model, native, numba_equations

H, SAMPLES = 1e-3, 2000
COMMANDS = 0.5 * np.sin(2e-3 * np.arange(SAMPLES))
# MuJoCo's share of them: it takes minutes for all.
FEW = 16


def works(missing: list[str], count: int = 10_000) -> Iterator[Work]:
    start = np.zeros((count, 4))
    start[:, 1] = 3.0 - np.arange(count) / count
    masses = RIG["pendulum.mass"] * np.linspace(0.9, 1.1, count)
    c = coefficients({**RIG.parameters, "pendulum.mass": masses})
    varied = {"pendulum.mass": masses}

    def ours():
        return furuta.simulate_batch(RIG, start, COMMANDS, H, parameters=varied)

    few = [k * count // FEW for k in range(FEW)]
    # One by one, by the other function of this package, is what the batch is compared with; a few of them.
    answer = [
        furuta.simulate(RIG.with_parameters({"pendulum.mass": masses[k]}), start[k], COMMANDS, H)[-1] for k in few
    ]
    contenders = [Contender("furuta `simulate_batch`", ours, lambda x: x[few])]
    machine = native()
    if machine is not None:
        run = lambda: machine.rollouts(start, COMMANDS, H, c)  # noqa: E731
        contenders.append(Contender("native, written by hand, one thread", run, lambda x: x[few]))
    for build in (numba_batch, jax_batch):
        try:
            name, run = build(start, c)
            contenders.append(Contender(name, run, lambda x: np.asarray(x)[few]))
        except ImportError as error:
            missing.append(f"{error.name} is not installed: left out of the rollouts.")
    try:
        contenders.append(mujoco_batch(start[few], masses[few], count))
    except ImportError as error:
        missing.append(f"{error.name} is not installed: left out of the rollouts.")
    yield Work(
        f"{count:,} rollouts of 2 s at 1 kHz",
        f"From different angles of the pendulum, whose mass differs by up to 10 %; the last states. {FEW} are compared "
        "with `furuta.simulate`.",
        answer,
        contenders,
        [f"MuJoCo simulates {FEW} of them, each with its own model; its time is multiplied."],
    )


def numba_batch(start, c):
    import numba

    _, step = numba_equations()

    @numba.njit(parallel=True, fastmath=True)
    def batch(start, u, h, c):
        out = np.empty_like(start)
        for i in numba.prange(len(start)):
            a, b, v, w = start[i, 0], start[i, 1], start[i, 2], start[i, 3]
            own = c[i]
            for k in range(len(u)):
                a, b, v, w = step(a, b, v, w, u[k], h, own)
            out[i, 0], out[i, 1], out[i, 2], out[i, 3] = a, b, v, w
        return out

    return "numba, prange", lambda: batch(start, COMMANDS, H, c)


def jax_batch(start, c):
    import jax
    import jax.numpy as jnp

    _, step = jax_equations()

    def one(x, c):
        return jnp.stack(jax.lax.scan(lambda x, u: (step(*x, u, H, c), None), tuple(x), jnp.asarray(COMMANDS))[0])

    batch = jax.jit(jax.vmap(one))
    x, values = jnp.asarray(start), jnp.asarray(c)
    return "JAX, vmap", lambda: batch(x, values).block_until_ready()


def mujoco_batch(start, masses, count) -> Contender:
    import mujoco
    from mujoco import rollout

    models = [mujoco_model(RIG.with_parameters({"pendulum.mass": mass}), H) for mass in masses]
    data = mujoco.MjData(models[0])
    states = np.column_stack([np.zeros(FEW), start])
    commands = np.broadcast_to(COMMANDS[None, :, None], (FEW, SAMPLES, 1)).copy()
    return Contender(
        "MuJoCo `rollout`, RK4",
        lambda: rollout.rollout(models, data, states, commands)[0],
        lambda x: x[:, -1, 1:5],
        1e-6,
        FEW / count,
    )
