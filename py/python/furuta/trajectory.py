"""`Trajectory`: a simulation with its time and its names."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from furuta._columns import column
from furuta._frame import frame
from furuta._furuta import Rig, simulate
from furuta.recording import Recording

if TYPE_CHECKING:
    import os

    from matplotlib.figure import Figure

STATES = ("theta", "alpha", "theta_dot", "alpha_dot")


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A simulated run: what `furuta.simulate` gives, with the time and under names.

    Examples
    --------
    >>> import numpy as np, furuta
    >>> run = furuta.Trajectory.simulate("qube-servo-2", [0, np.pi, 0, 0], np.full(500, 0.5), 0.002)
    >>> run.t[-1].round(9).item(), run.alpha.shape, bool(run.theta[-1] > 0.1)
    (1.0, (501,), True)
    >>> run["u"].shape, sorted(run.columns())[:3]
    ((501,), ['alpha', 'alpha_dot', 'alpha_measured'])
    """

    t: NDArray[np.float64]
    """Time, s, shape (N + 1,)."""
    x: NDArray[np.float64]
    """True states, shape (N + 1, 4): theta, alpha (rad), theta_dot, alpha_dot (rad/s)."""
    u: NDArray[np.float64]
    """Command, V or `command_unit`, shape (N + 1,): u[k] acts from row k to row k + 1; the last repeats the one before."""
    y: NDArray[np.float64]
    """What the encoders read, shape (N + 1, 2): theta, alpha (rad)."""
    modes: list[str] | None = None
    """Under a controller: its mode in each sample, N entries."""
    name: str = "simulation"
    """The rig's name."""
    rig: Rig | None = field(default=None, repr=False)
    """What was simulated."""

    @classmethod
    def simulate(
        cls, rig: Rig | str | os.PathLike[str], x0: ArrayLike, u: ArrayLike, dt: float, **keywords: Any
    ) -> Trajectory:
        """Simulates as `furuta.simulate` does, with the same arguments, and returns a Trajectory.

        Parameters
        ----------
        rig, x0, u, dt
            As for `furuta.simulate`.
        **keywords
            substeps, run, controller, reference, ideal, estimator as for `furuta.simulate`.

        Returns
        -------
        Trajectory
        """
        known = rig if isinstance(rig, Rig) else Rig.load(rig)
        call: Any = simulate
        found = call(known, x0, u, dt, **(keywords | {"encoders": True}))
        if len(found) == 2:
            x, y, commands, modes = found[0], found[1], np.asarray(u, dtype=float).reshape(-1), None
        else:
            x, commands, modes, y = found
        held = np.append(commands, commands[-1:] if len(commands) else 0.0)
        return cls(
            t=np.arange(len(x), dtype=np.float64) * dt, x=x, u=held, y=y, modes=modes, name=known.name, rig=known
        )

    @property
    def command_unit(self) -> str:
        """Unit of u: the rig's, or V where the rig is not known."""
        return "V" if self.rig is None else self.rig.command_unit

    @property
    def theta(self) -> NDArray[np.float64]:
        """The arm's true angle, rad."""
        return self.x[:, 0]

    @property
    def alpha(self) -> NDArray[np.float64]:
        """The pendulum's true angle, rad, 0 upright."""
        return self.x[:, 1]

    @property
    def theta_dot(self) -> NDArray[np.float64]:
        """The arm's true speed, rad/s."""
        return self.x[:, 2]

    @property
    def alpha_dot(self) -> NDArray[np.float64]:
        """The pendulum's true speed, rad/s."""
        return self.x[:, 3]

    @property
    def dt(self) -> float:
        """Sample period, s; a ValueError of a run of fewer than two samples, which has none."""
        if len(self.t) < 2:
            raise ValueError(f"the run of {self.name!r} is empty: no sample follows the first, and it has no dt")
        return float(self.t[1] - self.t[0])

    def columns(self) -> dict[str, Any]:
        """By name: t, u, theta, alpha, theta_dot, alpha_dot, theta_measured, alpha_measured."""
        measured = {"theta_measured": self.y[:, 0], "alpha_measured": self.y[:, 1]}
        return {"t": self.t, "u": self.u, **dict(zip(STATES, self.x.T)), **measured}

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        """A column by its name."""
        found: NDArray[np.float64] = column(self.columns(), name, "this trajectory")
        return found

    def to_pandas(self) -> Any:
        """The columns as a pandas.DataFrame, one row a sample; pandas must be installed."""
        return frame(self.columns())

    def to_recording(self, *, name: str | None = None) -> Recording:
        """What a rig would have recorded: time, command, and the angles that its encoders read."""
        return Recording(t=self.t, u=self.u, theta=self.y[:, 0], alpha=self.y[:, 1], name=name or self.name)

    def plot(self, *, ax: Any = None) -> Figure:
        """Draws both angles and the command over time with matplotlib; see `furuta.plot.trajectory`."""
        from furuta import plot

        return plot.trajectory(self, ax=ax)

    def animate(self, path: str | os.PathLike[str] | None = None, **keywords: Any) -> Any:
        """Draws arm and pendulum moving; see `furuta.plot.animation`."""
        from furuta import plot

        return plot.animation(self, path, **keywords)

    def __eq__(self, other: object) -> bool:
        """Runs are equal that have the same numbers."""
        if not isinstance(other, Trajectory):
            return NotImplemented
        pairs = [(self.t, other.t), (self.x, other.x), (self.u, other.u), (self.y, other.y)]
        return all(np.array_equal(a, b) for a, b in pairs) and self.modes == other.modes

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"<furuta.Trajectory of {self.name!r}: {len(self.t)} samples, {self.t[-1]:g} s>"

    def _repr_html_(self) -> str:
        from furuta import _cards

        return _cards.trajectory(self)
