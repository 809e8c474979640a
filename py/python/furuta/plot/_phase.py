"""Phase portraits."""

from __future__ import annotations

from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np

from furuta.plot._axes import axes
from furuta.plot._names import names
from furuta.plot._style import AFTER, BEFORE, FAINT, MEASURED

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def phase_portrait(*runs: Any, of: str = "alpha", ax: Any = None) -> Figure:
    """Draws the speed of one axis over its angle.

    Parameters
    ----------
    *runs : Trajectory, Recording, DataFrame or mapping of arrays
        Where the speed was not recorded it is the angle's central difference over 20 ms. Of several, the legend
        numbers those of one name.
    of : {"alpha", "theta"}, optional
        The pendulum or the arm.
    ax : matplotlib.axes.Axes, optional

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> import numpy as np, furuta
    >>> run = furuta.Trajectory.simulate("qube-servo-2", [0, 2, 0, 0], np.zeros(500), 0.002)
    >>> furuta.plot.phase_portrait(run).axes[0].get_xlabel()
    'alpha [rad]'
    """
    if of not in ("alpha", "theta"):
        raise ValueError(f'of = {of!r} is none of "alpha", "theta"')
    if not runs:
        raise TypeError("phase_portrait needs something to draw: a Trajectory, a Recording or columns")
    figure, (one,) = axes(ax, 1, (6, 5), "furuta.plot.phase_portrait")
    for run, label, colour in zip(runs, names(runs), cycle((AFTER, BEFORE, MEASURED, FAINT))):
        angle = np.asarray(run[of], dtype=float)
        try:
            speed = np.asarray(run[f"{of}_dot"], dtype=float)
        except KeyError:
            speed = _difference(angle, np.asarray(run["t"], dtype=float))
        one.plot(angle, speed, color=colour, lw=1.0, label=label)
        one.plot(angle[:1], speed[:1], "o", color=colour, ms=5)
    one.set_xlabel(f"{of} [rad]")
    one.set_ylabel(f"{of}_dot [rad/s]")
    if len(runs) > 1:
        one.legend(frameon=False, fontsize=9)
    return figure


def _difference(angle: Any, t: Any) -> Any:
    """Central difference over 20 ms: over one sample it would show the encoder's steps."""
    n = max(1, round(0.01 / float(np.median(np.diff(t)))))
    before, after = np.maximum(np.arange(len(t)) - n, 0), np.minimum(np.arange(len(t)) + n, len(t) - 1)
    return (angle[after] - angle[before]) / (t[after] - t[before])
