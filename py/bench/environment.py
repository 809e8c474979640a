"""Steps of Gymnasium environments: another plant each, so that only the cost of a step is compared."""

from __future__ import annotations

from collections.abc import Iterator

from clock import Contender, Work

STEPS, MANY = 1000, 64


def works(missing: list[str]) -> Iterator[Work]:
    try:
        import furuta.gym  # noqa: F401
        import gymnasium
    except ImportError as error:
        missing.append(f"{error.name} is not installed: the environments are left out.")
        return
    single = [
        Contender("furuta `RotaryPendulum-v0`, 5 steps of 2 ms", episode(gymnasium, "furuta/RotaryPendulum-v0")),
        Contender("gymnasium `Pendulum-v1`, a step of Euler's", episode(gymnasium, "Pendulum-v1")),
    ]
    try:
        single.append(
            Contender("MuJoCo `InvertedPendulum-v5`, 2 steps", episode(gymnasium, "InvertedPendulum-v5"))
        )
    except Exception as error:  # gymnasium has an error of its own for packages that are not there
        missing.append(f"InvertedPendulum-v5: {error}")
    yield Work(
        f"{STEPS:,} steps of a Gymnasium environment",
        "Each with its own plant, actions at random, episodes begun anew where they end; with gymnasium's wrappers. No "
        "answers are compared: the plants differ.",
        None,
        single,
        count=STEPS,
    )
    yield Work(
        f"{STEPS:,} steps of {MANY} environments at once",
        "Made by `gymnasium.make_vec`; the others step them one after the other.",
        None,
        [
            Contender("furuta `RotaryPendulum-v0`", episodes(gymnasium, "furuta/RotaryPendulum-v0", {}), share=0.1),
            Contender(
                "gymnasium `Pendulum-v1`, sync",
                episodes(gymnasium, "Pendulum-v1", {"vectorization_mode": "sync"}),
                share=0.1,
            ),
            Contender(
                "gymnasium `CartPole-v1`, its own arrays",
                episodes(gymnasium, "CartPole-v1", {"vectorization_mode": "vector_entry_point"}),
                share=0.1,
            ),
        ],
        count=STEPS * MANY,
    )


def actions(space, count: int) -> list:
    space.seed(1)
    return [space.sample() for _ in range(count)]


def episode(gymnasium, name: str):
    env = gymnasium.make(name)
    env.reset(seed=1)
    chosen = actions(env.action_space, STEPS)

    def run():
        for action in chosen:
            _, _, ended, over, _ = env.step(action)
            if ended or over:
                env.reset()

    return run


def episodes(gymnasium, name: str, how: dict[str, str]):
    env = gymnasium.make_vec(name, num_envs=MANY, **how)
    env.reset(seed=1)
    chosen = actions(env.action_space, STEPS // 10)

    def run():
        for action in chosen:
            env.step(action)

    return run
