"""Angles and command over time."""

from __future__ import annotations

import os
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np

from furuta.plot._axes import axes
from furuta.plot._names import names
from furuta.plot._style import AFTER, ANGLES, BEFORE, FAINT, MEASURED
from furuta.recording import Recording

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ROWS = [("theta", ANGLES[0]), ("alpha", ANGLES[1]), ("u", "command, u [{unit}]")]


def trajectory(*runs: Any, ax: Any = None) -> Figure:
    """Draws both angles and the command over time.

    Parameters
    ----------
    *runs : Trajectory, Recording, DataFrame, mapping of arrays, or path of a recording
        With t, and theta, alpha, u as far as there are axes. Several are laid over each other; the legend numbers
        those of one name.
    ax : matplotlib.axes.Axes or up to three of them, optional
        One: the pendulum. Two: arm and pendulum. Three: the command as well. A figure of its own if not given.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> import numpy as np, furuta
    >>> run = furuta.Trajectory.simulate("qube-servo-2", [0, 3, 0, 0], np.zeros(100), 0.002)
    >>> [a.get_ylabel() for a in furuta.plot.trajectory(run).axes]
    ['arm, theta [rad]', 'pendulum, alpha [rad]', 'command, u [V]']
    """
    if not runs:
        raise TypeError("trajectory needs something to draw: a Trajectory, a Recording or columns")
    figure, drawn = axes(ax, 3, (9, 7), "furuta.plot.trajectory", at_least=1)
    rows = ROWS[1:2] if len(drawn) == 1 else ROWS[: len(drawn)]
    shown = [Recording(run) if isinstance(run, (str, os.PathLike)) else run for run in runs]
    for run, label, colour in zip(shown, names(shown), cycle((MEASURED, AFTER, BEFORE, FAINT))):
        for one, (column, _) in zip(drawn, rows):
            # The command is held from one sample to the next.
            style = "steps-post" if column == "u" else "default"
            one.plot(np.asarray(run["t"]), np.asarray(run[column]), color=colour, lw=1.2, drawstyle=style, label=label)
    units = dict.fromkeys(getattr(run, "command_unit", "V") for run in runs)
    for one, (_, label) in zip(drawn, rows):
        one.set_ylabel(label.format(unit=" or ".join(units)))
    drawn[-1].set_xlabel("time [s]")
    if len(runs) > 1:
        drawn[0].legend(frameon=False, fontsize=9)
    return figure
