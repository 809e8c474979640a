"""`Run`: what `furuta.run` measured and commanded."""

from __future__ import annotations

import os
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from furuta import _runlog
from furuta._frame import frame
from furuta._furuta import Rig, _write_data
from furuta.recording import Recording

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Run:
    """A run of a rig by `furuta.run`: one entry a sample in each array.

    It has every column of a log of `furuta run`. `save` writes it as one, which `furuta.diagnose` and the command line
    read.

    Examples
    --------
    >>> import numpy as np, furuta
    >>> class Simulated:
    ...     def __init__(self):
    ...         self.plant = furuta.Simulator("shahzad2022-srv02", [0, np.pi, 0, 0], 0.002)
    ...     def exchange(self, volts):
    ...         reading = self.plant.reading
    ...         self.plant.step(volts)
    ...         return reading
    >>> run = furuta.run("shahzad2022-srv02", io=Simulated(), duration=3, pace="io", any_clock=True)
    >>> run.mode[0], run.mode[-1], run.samples, run.end
    ('swing-up', 'balance', 1501, 'finished')
    >>> bool(np.isfinite(run.lateness).all()), run.to_recording().samples
    (True, 1501)
    """

    t: _Array
    """Time, s, from the first sample: whole periods."""
    u: _Array
    """V, held from this sample to the next."""
    theta: _Array
    """The arm's angle as measured, rad."""
    alpha: _Array
    """The pendulum's angle as measured, rad, 0 upright."""
    theta_dot: _Array
    """The arm's speed as estimated, rad/s."""
    alpha_dot: _Array
    """The pendulum's speed as estimated, rad/s."""
    reference: _Array
    """Where the arm was asked to be, rad."""
    command: _Array
    """V, the answer to this sample, which acts from the next one on."""
    mode: list[str]
    """"swing-up", "balance", "brake" or "off"."""
    seq: NDArray[np.int64]
    """Number of the sample: `t / dt`."""
    lost: NDArray[np.int64]
    """Samples that were lost just before this one, because it was late by whole periods."""
    lateness: _Array
    """How late the sample came, s: after it was due with `pace="ours"`, after the promptest of the last 20 to 40 ms
    with `pace="io"`."""
    compute: _Array
    """From the sample's arrival to the answer, s."""
    exchange: _Array
    """How long `io.exchange` took, s."""
    dt: float
    """Sample period, s."""
    end: str
    """"finished", or why the run ended before its time."""
    name: str
    """The rig's name."""
    rig: Rig = field(repr=False)
    """What the controller was designed for."""
    said: dict[str, str] = field(repr=False)
    """What the log says of the run, by key: docs/log.md."""

    @property
    def samples(self) -> int:
        """Number of samples."""
        return len(self.t)

    @property
    def late(self) -> int:
        """Samples that came more than a period late."""
        return int((self.lateness > self.dt).sum())

    @property
    def replayable(self) -> bool:
        """Whether `furuta.replay` can repeat the log: every angle was a whole number of counts."""
        return "task" in self.said

    def columns(self) -> dict[str, Any]:
        """The columns of the log by name, `lateness` under its name there, `delay`."""
        return {
            "t": self.t,
            "u": self.u,
            "theta": self.theta,
            "alpha": self.alpha,
            "theta_dot": self.theta_dot,
            "alpha_dot": self.alpha_dot,
            "reference": self.reference,
            "command": self.command,
            "mode": self.mode,
            "seq": self.seq,
            "status": np.zeros(self.samples, dtype=np.int64),
            "lost": self.lost,
            "delay": self.lateness,
            "compute": self.compute,
        }

    def to_recording(self, *, name: str | None = None) -> Recording:
        """Time, command and both angles as a `Recording`."""
        return Recording(t=self.t, u=self.u, theta=self.theta, alpha=self.alpha, name=name or self.name)

    def to_pandas(self) -> Any:
        """The columns as a pandas.DataFrame, one row a sample; pandas must be installed."""
        return frame(self.columns())

    def save(self, path: str | os.PathLike[str], *, force: bool = False) -> None:
        """Writes the log as CSV; `furuta convert` makes MCAP of it.

        A file that is there already is replaced only with `force`.
        """
        _runlog.check(path, force)
        columns = {name: list(np.asarray(values).tolist()) for name, values in self.columns().items()}
        _write_data(os.fspath(path), _runlog.text(self.said, columns), force=force)

    def plot(self, *, ax: Any = None) -> Figure:
        """Draws both angles and the command over time with matplotlib; see `furuta.plot.trajectory`."""
        from furuta import plot

        return plot.trajectory(self.to_recording(), ax=ax)

    def summary(self) -> str:
        """How the run went, how late its samples were, in words."""
        lines = [f"{self.name}: {self.samples} samples, {self.end}"]
        for mode in dict.fromkeys(self.mode):
            since = self.t[self.mode.index(mode)]
            lines.append(f"{mode}: from {since:.3f} s, {self.mode.count(mode) * self.dt:.3f} s in all")
        if self.samples:
            for what, times in (("late", self.lateness), ("exchange", self.exchange), ("compute", self.compute)):
                p50, p99, most = np.quantile(times, [0.5, 0.99, 1.0]) * 1e6
                lines.append(f"{what} [us]: p50 {p50:.0f}, p99 {p99:.0f}, max {most:.0f}")
            lines.append(f"{self.late} samples more than a period late, {self.lost.sum()} lost")
        return "\n".join(lines)

    def __len__(self) -> int:
        return self.samples

    def __eq__(self, other: object) -> bool:
        """Runs are equal that have the same numbers and words everywhere."""
        if not isinstance(other, Run):
            return NotImplemented
        return all(_same(getattr(self, one.name), getattr(other, one.name)) for one in fields(self))

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        last = self.t[-1] if self.samples else 0.0
        return f"<furuta.Run of {self.name!r}: {self.samples} samples, {last:g} s, {self.end}>"


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return np.array_equal(a, b, equal_nan=True)
    return bool(a == b)
