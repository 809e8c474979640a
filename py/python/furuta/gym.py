"""The rotary pendulum as a Gymnasium environment, `furuta/RotaryPendulum-v0`.

It needs gymnasium: `pip install "furuta[gym]"`.

>>> import gymnasium, furuta.gym
>>> env = gymnasium.make("furuta/RotaryPendulum-v0", rig="qube-servo-2", task="balance")
>>> observation, info = env.reset(seed=1)
>>> observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Sequence
from typing import Any, Literal

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from furuta._draws import Randomize as _Randomize
from furuta._draws import draws_of
from furuta._furuta import BatchSimulator, Rig, Simulator

__all__ = ["RotaryPendulum", "RotaryPendulumVector", "draws_of", "register"]

ID = "furuta/RotaryPendulum-v0"
_Array = NDArray[np.float64]
# The rig is simulated in steps of at most this, s.
STEP = 0.002


@dataclasses.dataclass(frozen=True)
class _Game:
    """What is observed, wanted and rewarded, for one rig or an array of them."""

    task: Literal["swing-up", "balance"]
    rate: float
    seconds: float
    arm_angle: float
    references: Sequence[float]
    hold: float

    SPEEDS = np.array([100.0, 200.0])

    def __post_init__(self) -> None:
        if self.task not in ("swing-up", "balance"):
            raise ValueError(f'task = {self.task!r} is none of "swing-up", "balance"')
        for name in ("rate", "seconds", "arm_angle", "hold"):
            value = getattr(self, name)
            if not (value > 0 and np.isfinite(value)):
                raise ValueError(f"{name} = {value} must be above 0 and finite")
        if not len(self.references):
            raise ValueError("references is empty: give at least one angle of the arm, rad")
        for k, reference in enumerate(self.references):
            # Written so that a NaN fails.
            if not abs(reference) < self.arm_angle:
                raise ValueError(f"references[{k}] = {reference} rad is beyond arm_angle = {self.arm_angle} rad")

    @property
    def period(self) -> float:
        """Of the commands, s."""
        return 1 / self.rate

    @property
    def substeps(self) -> int:
        """Steps of the simulation within a period."""
        return max(1, int(np.ceil(self.period / STEP - 1e-9)))

    @property
    def step(self) -> float:
        """Of the simulation, s."""
        return self.period / self.substeps

    @property
    def length(self) -> int:
        """Of an episode, in periods."""
        return max(1, round(self.seconds * self.rate))

    @property
    def held(self) -> int:
        """How long a reference stays, in periods."""
        return max(1, round(self.hold * self.rate))

    @functools.cached_property
    def observations(self) -> gymnasium.spaces.Box:
        high = np.array([2 * self.arm_angle, 1, 1, *self.SPEEDS, 2 * self.arm_angle], dtype=np.float32)
        return gymnasium.spaces.Box(-high, high, dtype=np.float32)

    @functools.cached_property
    def _high(self) -> _Array:
        return self.observations.high.astype(float)

    def start(self, rng: np.random.Generator) -> list[float]:
        alpha = rng.uniform(-0.1, 0.1) + (np.pi if self.task == "swing-up" else 0)
        return [rng.uniform(-0.1, 0.1), alpha, 0.0, 0.0]

    def observe(self, x: _Array, reference: Any) -> NDArray[np.float32]:
        seen = np.empty((*x.shape[:-1], 6))
        seen[..., 0], alpha = x[..., 0], x[..., 1]
        seen[..., 1], seen[..., 2] = np.sin(alpha), np.cos(alpha)
        seen[..., 3:5], seen[..., 5] = x[..., 2:], reference
        if not np.isfinite(seen).all():
            seen = np.nan_to_num(seen)
        high = self._high
        return np.minimum(np.maximum(seen, -high), high).astype(np.float32)

    def judge(self, x: _Array, action: Any, reference: Any) -> tuple[Any, Any]:
        """Reward, at most 1, and whether the episode has failed."""
        theta, up = x[..., 0], np.cos(x[..., 1])
        error = np.minimum(np.abs(theta - reference), self.arm_angle)
        reward = (1 + up) / 2 - 0.1 * (error * error) - 0.01 * (action * action)
        failed = ~(np.abs(theta) <= self.arm_angle) | ~np.isfinite(x).all(axis=-1)
        if self.task == "balance":
            failed = failed | (up < np.cos(0.5))
        return np.where(failed, -10.0, reward), failed

    def rendering(self, render_mode: str | None) -> dict[str, Any]:
        """What an environment says of its pictures: one a command."""
        if render_mode not in (None, "rgb_array"):
            raise ValueError(
                f"render_mode = {render_mode!r} is none of None, \"rgb_array\"; for a window: "
                'gymnasium.wrappers.HumanRendering(gymnasium.make(..., render_mode="rgb_array"))'
            )
        return {"render_modes": ["rgb_array"], "render_fps": round(self.rate)}


def _sees_encoders(observe: str) -> bool:
    if observe not in ("state", "encoders"):
        raise ValueError(f'observe = {observe!r} is none of "state", "encoders"')
    return observe == "encoders"


def _scene() -> Any:
    try:
        from furuta._scene import Scene

        return Scene()
    except ImportError as missing:
        raise gymnasium.error.DependencyNotInstalled(
            f'{missing.name} is not installed, which draws: pip install "furuta[plot]"'
        ) from missing


def _shares(name: str, given: Any, shape: tuple[int, ...]) -> _Array:
    """Commands as shares of the limit, within -1 and 1, of an action or actions of this shape."""
    try:
        found = np.asarray(given, dtype=float)
    except (TypeError, ValueError) as e:
        raise ValueError(f"{name} must be numbers of shape {shape}; a {type(given).__name__} was given: {e}") from e
    if found.shape != shape:
        was = f"{found.item():g}, a single number," if found.ndim == 0 else f"an array of shape {found.shape}"
        raise ValueError(f"{name} must have shape {shape}, as the action_space has; {was} was given")
    if not np.isfinite(found).all():
        at = tuple(int(k) for k in np.argwhere(~np.isfinite(found))[0])
        where = ", ".join(map(str, at))
        raise ValueError(f"{name}[{where}] = {found[at]} must be finite: a share of the command limit, -1 to 1")
    return np.minimum(np.maximum(found, -1.0), 1.0)


def _mask(options: dict[str, Any] | None, num_envs: int) -> NDArray[np.bool_] | None:
    """Which rigs `options["reset_mask"]` chooses; None where it is not given. As gymnasium's own environments."""
    if options is None or "reset_mask" not in options:
        return None
    mask, name = options["reset_mask"], 'options["reset_mask"]'
    if not isinstance(mask, np.ndarray):
        raise TypeError(f"{name} must be a NumPy array of {num_envs} booleans; a {type(mask).__name__} was given")
    if mask.dtype != np.bool_:
        raise TypeError(f"{name} must be an array of {num_envs} booleans; one of {mask.dtype} was given")
    if mask.shape != (num_envs,):
        raise ValueError(f"{name} has shape {mask.shape}; it must be ({num_envs},), one boolean for each rig")
    if not mask.any():
        raise ValueError(f"{name} chooses no rig: at least one entry must be True")
    return mask


def _begun(plant: Any, what: str) -> Any:
    """The rig, or the rigs, of an environment that was reset."""
    if plant is None:
        raise gymnasium.error.ResetNeeded(f"{what}() comes after reset(): call reset() first")
    return plant


class RotaryPendulum(gymnasium.Env[Any, Any]):
    """One rig.

    Observation: theta, sin(alpha), cos(alpha), theta_dot, alpha_dot, reference of the arm (rad, rad/s). Action: the
    command as a share of the rig's command limit. Reward: (1 + cos(alpha))/2 less costs of the arm's error and of the
    command; -10, and the end, where the arm leaves +-arm_angle or, in the task "balance", the pendulum falls.

    Parameters
    ----------
    rig : Rig or str
        With its effects.
    task : {"swing-up", "balance"}
        Where an episode begins: hanging or upright, within 0.1 rad.
    rate : float
        Commands per second; the rig is simulated in steps of at most 2 ms.
    seconds : float
        Length of an episode, after which it is truncated.
    arm_angle : float
        Largest angle of the arm, rad.
    references : sequence of float
        Where the arm is to be, rad: one of them, drawn anew every `hold` seconds.
    hold : float
        See `references`, s.
    observe : {"state", "encoders"}
        The true state, or the encoders' readings (effects of the sensors included) and their differences over a period.
    randomize : optional
        What varies from episode to episode: see `draws_of`.
    render_mode : {"rgb_array"}, optional
        `render` gives a picture of the rig, shape (400, 400, 3), the arm's reference marked in green; it needs
        matplotlib. A window: `gymnasium.wrappers.HumanRendering(env)`.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 100}

    def __init__(
        self,
        rig: Rig | str = "qube-servo-2",
        task: Literal["swing-up", "balance"] = "swing-up",
        *,
        rate: float = 100.0,
        seconds: float = 10.0,
        arm_angle: float = 2.5,
        references: Sequence[float] = (0.0,),
        hold: float = 2.5,
        observe: Literal["state", "encoders"] = "state",
        randomize: _Randomize | None = None,
        render_mode: Literal["rgb_array"] | None = None,
    ) -> None:
        self.rig = rig if isinstance(rig, Rig) else Rig.load(rig)
        self.render_mode = render_mode
        self.game = _Game(task, rate, seconds, arm_angle, references, hold)
        self.metadata = self.game.rendering(render_mode)
        self.scene: Any = None
        self.draw = draws_of(randomize, self.rig)
        self.encoders = _sees_encoders(observe)
        self.plant: Any = None
        self.observation_space = self.game.observations
        self.action_space = gymnasium.spaces.Box(-1, 1, (1,), dtype=np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begins an episode: the first observation, and `info["rig"]`, the rig that was drawn for it."""
        super().reset(seed=seed)
        rng = self.np_random
        self.drawn = self.draw(rng)
        self.limit = self.drawn["motor.command_limit"]
        self.plant = Simulator(self.drawn, self.game.start(rng), self.game.step)
        self.samples = 0
        self.before = self.plant.reading
        self.reference = float(rng.choice(self.game.references))
        return self._observation(), {"rig": self.drawn}

    def step(self, action: NDArray[np.float32]) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """One period of the command: observation, reward, terminated (failed), truncated (`seconds` are over), info."""
        plant = _begun(self.plant, "step")
        share = float(_shares("action", action, (1,))[0])
        if self.encoders:
            self.before = plant.reading
        x = plant.steps(np.full(self.game.substeps, share * self.limit))[-1]
        reward, failed = self.game.judge(x, share, self.reference)
        self.samples += 1
        if self.samples % self.game.held == 0:
            self.reference = float(self.np_random.choice(self.game.references))
        return self._observation(), float(reward), bool(failed), self.samples >= self.game.length, {}

    def _observation(self) -> NDArray[np.float32]:
        x = self.plant.x
        if self.encoders:
            now = self.plant.reading
            x = np.concatenate([now, (now - self.before) / self.game.period])
        return self.game.observe(x, self.reference)

    def render(self) -> NDArray[np.uint8] | None:  # type: ignore[override]
        """The rig as it is, its true state, in pixels; None without a render_mode."""
        if self.render_mode is None:
            gymnasium.logger.warn('render() has no render_mode: gymnasium.make(..., render_mode="rgb_array")')
            return None
        self.scene = self.scene or _scene()
        plant = _begun(self.plant, "render")
        pixels: NDArray[np.uint8] = self.scene.draw(self.drawn, plant.x, self.reference)
        return pixels


class RotaryPendulumVector(gymnasium.vector.VectorEnv[Any, Any, Any]):
    """Many rigs at once: the same game as `RotaryPendulum`, on a `furuta.BatchSimulator`.

    An episode that has ended begins anew at the next step. Rigs whose effects all follow the state alone
    (`follows_state` in `furuta.catalogue()`) are the fastest.

    Parameters
    ----------
    num_envs : int
        How many rigs.
    rig, task, rate, seconds, arm_angle, references, hold, observe, randomize
        As of `RotaryPendulum`.
    render_mode : {"rgb_array"}, optional
        `render` gives a tuple of pictures, one of each rig.
    """

    metadata: dict[str, Any] = {
        "render_modes": ["rgb_array"],
        "render_fps": 100,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        num_envs: int = 64,
        rig: Rig | str = "qube-servo-2",
        task: Literal["swing-up", "balance"] = "swing-up",
        *,
        rate: float = 100.0,
        seconds: float = 10.0,
        arm_angle: float = 2.5,
        references: Sequence[float] = (0.0,),
        hold: float = 2.5,
        observe: Literal["state", "encoders"] = "state",
        randomize: _Randomize | None = None,
        render_mode: Literal["rgb_array"] | None = None,
    ) -> None:
        self.rig = rig if isinstance(rig, Rig) else Rig.load(rig)
        if num_envs < 1:
            raise ValueError(f"num_envs = {num_envs} must be at least 1")
        self.num_envs, self.render_mode = num_envs, render_mode
        self.game = _Game(task, rate, seconds, arm_angle, references, hold)
        self.encoders = _sees_encoders(observe)
        self.plants: Any = None
        self.metadata = {**self.metadata, **self.game.rendering(render_mode)}
        self.scene: Any = None
        self.draw = draws_of(randomize, self.rig)
        self.single_observation_space = self.game.observations
        self.single_action_space = gymnasium.spaces.Box(-1, 1, (1,), dtype=np.float32)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def reset(
        self, *, seed: Any = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begins an episode of each rig: the first observations, shape (num_envs, 6).

        With `options={"reset_mask": mask}`, an array of num_envs booleans, only of the rigs where it is True; the
        others stay where they are, and their observations are those of their last step.
        """
        mask = _mask(options, self.num_envs)
        if mask is not None and self.plants is None:
            raise gymnasium.error.ResetNeeded('options["reset_mask"] comes after a reset() of all rigs: call it first')
        super().reset(seed=seed)
        if mask is not None:
            self._begin_anew(mask)
            return self._observation(self.plants.x), {}
        rng, all_of_them = self.np_random, range(self.num_envs)
        rigs, starts = [self.draw(rng) for _ in all_of_them], [self.game.start(rng) for _ in all_of_them]
        self.plants = BatchSimulator(rigs, starts, self.game.step)
        self.limits = np.array([rig["motor.command_limit"] for rig in rigs])
        self.reference = rng.choice(self.game.references, self.num_envs).astype(float)
        self.samples, self.ended = np.zeros(self.num_envs, dtype=int), np.zeros(self.num_envs, dtype=bool)
        self.before = self.plants.reading
        return self._observation(self.plants.x), {}

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """One period of every rig, each output of `RotaryPendulum.step` an array; what ended before begins anew."""
        plants = _begun(self.plants, "step")
        shares = _shares("actions", actions, (self.num_envs, 1))[:, 0]
        if self.encoders:
            self.before = plants.reading
        x = plants.step(shares * self.limits, self.game.substeps)
        reward, failed = self.game.judge(x, shares, self.reference)
        self.samples += 1
        rng, again = self.np_random, self.ended
        anew = np.flatnonzero(self.samples % self.game.held == 0)
        self.reference[anew] = rng.choice(self.game.references, len(anew))
        if again.any():
            self._begin_anew(again)
            x = self.plants.x
            reward, failed = np.where(again, 0.0, reward), failed & ~again
        truncated = self.samples >= self.game.length
        self.ended = failed | truncated
        return self._observation(x), reward, failed, truncated, {}

    def _begin_anew(self, mask: NDArray[np.bool_]) -> None:
        """An episode of each of these rigs."""
        rng = self.np_random
        for k in np.flatnonzero(mask):
            rig = self.draw(rng)
            self.plants.reset(int(k), self.game.start(rng), rig)
            self.limits[k], self.samples[k] = rig["motor.command_limit"], 0
            self.reference[k] = rng.choice(self.game.references)
        self.ended = self.ended & ~mask
        if self.encoders:
            self.before[mask] = self.plants.reading[mask]

    def _observation(self, x: _Array) -> NDArray[np.float32]:
        if self.encoders:
            now = self.plants.reading
            x = np.concatenate([now, (now - self.before) / self.game.period], axis=1)
        return self.game.observe(x, self.reference)

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """A picture of each rig; None without a render_mode."""
        if self.render_mode is None:
            gymnasium.logger.warn('render() has no render_mode: gymnasium.make_vec(..., render_mode="rgb_array")')
            return None
        self.scene = self.scene or _scene()
        plants = _begun(self.plants, "render")
        rigs = zip(plants.rigs, plants.x, self.reference)
        return tuple(self.scene.draw(rig, x, float(reference)) for rig, x, reference in rigs)


def register() -> None:
    """Registers `furuta/RotaryPendulum-v0`, once. Importing `furuta.gym` does it.

    Where the package is installed, importing gymnasium does it as well.
    """
    if ID not in gymnasium.registry:
        gymnasium.register(
            ID, entry_point="furuta.gym:RotaryPendulum", vector_entry_point="furuta.gym:RotaryPendulumVector"
        )


register()
