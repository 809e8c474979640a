"""Bode plots of responses, fits, rigs and systems."""

from __future__ import annotations

import os
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from furuta._furuta import Frf, Rig, TransferFit, linearize
from furuta.plot._axes import axes
from furuta.plot._response import curve, grid, label
from furuta.plot._style import AFTER, BEFORE, FLOOR, MEASURED

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def _rig(system: Any) -> Any:
    """The rig of a name or a path; anything else as it is."""
    return Rig.load(system) if isinstance(system, (str, os.PathLike)) else system


def bode(
    *systems: Any, frequency: ArrayLike | None = None, output: str = "alpha", ax: Any = None, **named: Any
) -> Figure:
    """Draws magnitude and phase over frequency.

    Parameters
    ----------
    *systems : Frf, TransferFit, Rig (its name or the path of its file will do) or python-control system
        A rig: from u to `output`, hanging at rest, without its effects.
    frequency : array_like, optional
        Hz; that of the first Frf, or 300 points from 0.1 to 30 Hz, if not given.
    output : {"alpha", "theta"}, optional
        Of rigs.
    ax : two matplotlib.axes.Axes, or one, optional
        Magnitude and phase, or magnitude alone.
    **named
        Systems under the names that the legend shows.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> import furuta
    >>> figure = furuta.plot.bode(furuta.Rig.load("qube-servo-2"))
    >>> [a.get_ylabel() for a in figure.axes]
    ['magnitude [dB]', 'phase [deg]']
    """
    shown = [(_name(system), system) for system in map(_rig, systems)]
    shown += [(name, _rig(system)) for name, system in named.items()]
    if not shown:
        raise TypeError("bode needs something to draw: an Frf, a TransferFit, a Rig or a python-control system")
    if frequency is None:
        measured = [system for _, system in shown if isinstance(system, Frf)]
        frequency = measured[0].frequency if measured else np.geomspace(0.1, 30.0, 300)
    f = np.asarray(frequency, dtype=float)
    figure, drawn = axes(ax, 2, (9, 6), "furuta.plot.bode", at_least=1)
    first = None
    for (name, system), colour in zip(shown, cycle((MEASURED, AFTER, BEFORE, FLOOR))):
        if isinstance(system, Frf):
            at, response = system.frequency, system.response
        else:
            at, response = f, _response(system, f, output)
        latest = curve(drawn, at, response, first, label=name, color=colour, lw=1.3)
        first = first or latest
    label(drawn)
    grid(drawn)
    if len(shown) > 1:
        drawn[0].legend(frameon=False, fontsize=9)
    return figure


def _name(system: Any) -> str:
    if isinstance(system, Frf):
        return "measured"
    if isinstance(system, TransferFit):
        return "fit"
    name = getattr(system, "name", None)
    return name if isinstance(name, str) else type(system).__name__


def _response(system: Any, f: Any, output: str) -> Any:
    if isinstance(system, TransferFit):
        return system.response(f)
    if isinstance(system, Rig):
        if output not in ("alpha", "theta"):
            raise ValueError(f'output = {output!r} is none of "alpha", "theta"')
        a, b = linearize(system, [0.0, np.pi, 0.0, 0.0])
        row = ["theta", "alpha"].index(output)
        return np.array([np.linalg.solve(2j * np.pi * at * np.eye(4) - a, b)[row, 0] for at in f])
    if callable(getattr(system, "frequency_response", None)):
        return Frf.from_control(system, f).response
    given = type(system).__name__
    raise TypeError(f"bode draws an Frf, a TransferFit, a Rig or a python-control system; a {given} was given")
