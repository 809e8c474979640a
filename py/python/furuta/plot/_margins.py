"""The loop of a design: Bode plot with its margins, Nyquist plot with the disk that it keeps out of."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from furuta._furuta import Rig, closed_loop
from furuta.plot._axes import axes
from furuta.plot._response import grid
from furuta.plot._style import AFTER, BEFORE, DASHED, FAINT, FLOOR, MEASURED

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LOWEST, HIGHEST = 1e-2, 1e3
"""Frequencies of a picture, rad/s; a sampled loop ends at half its sampling frequency."""


def margins(
    rig: Rig | str | os.PathLike[str],
    K: ArrayLike,
    *,
    rate: float | None = None,
    amplitudes: Sequence[float] | None = None,
    ax: Any = None,
) -> Figure:
    """Draws the Bode plot of a loop broken at the command, with its gain and phase margins.

    Parameters
    ----------
    rig : Rig
        Its name or the path of its file will do.
    K, rate, amplitudes
        As of `furuta.closed_loop`.
    ax : two matplotlib.axes.Axes, optional
        Gain and phase.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> import furuta, numpy as np
    >>> K, _, _ = furuta.lqr("shahzad2022-srv02", np.diag([1, 10, 0, 0]), 0.01)
    >>> figure = furuta.plot.margins("shahzad2022-srv02", K[0], rate=500)
    >>> [a.get_ylabel() for a in figure.axes]
    ['gain [dB]', 'phase [deg]']
    """
    omega, found = _loop(rig, K, rate, amplitudes)
    response, of = found["response"], found["margins"]
    figure, (gain, phase) = axes(ax, 2, (9, 6), "furuta.plot.margins")
    angle = np.degrees(np.unwrap(np.angle(response)))
    gain.semilogx(omega, 20 * np.log10(np.abs(response)), color=MEASURED, lw=1.3)
    phase.semilogx(omega, angle, color=MEASURED, lw=1.3)
    gain.axhline(0, color=FAINT, lw=0.8, ls=DASHED)
    for factor, at, colour in zip(of["gain"], of["frequencies"], (BEFORE, AFTER)):
        if np.isfinite(at) and 0 < factor < np.inf:
            gain.plot([at, at], [-20 * np.log10(factor), 0], color=colour, lw=2.5, label=f"gain margin {factor:.3g}")
    at = of["frequencies"][2]
    if np.isfinite(at) and np.isfinite(of["phase"]):
        drawn = float(np.interp(at, omega, angle))
        edge = 360 * np.round((drawn - 180) / 360) + 180
        phase.axhline(edge, color=FAINT, lw=0.8, ls=DASHED)
        margin = f"phase margin {np.degrees(of['phase']):.3g} deg, {1e3 * of['delay']:.3g} ms"
        phase.plot([at, at], [drawn, edge], color=FLOOR, lw=2.5, label=margin)
    gain.set_ylabel("gain [dB]")
    phase.set_ylabel("phase [deg]")
    phase.set_xlabel("frequency [rad/s]")
    for one in (gain, phase):
        if one.get_legend_handles_labels()[0]:
            one.legend(frameon=False, fontsize=9)
    grid([gain, phase])
    return figure


def nyquist(
    rig: Rig | str | os.PathLike[str],
    K: ArrayLike,
    *,
    rate: float | None = None,
    amplitudes: Sequence[float] | None = None,
    ax: Any = None,
) -> Figure:
    """Draws a loop, broken at the command, in the complex plane, with -1 and the disk of its disk margin.

    Parameters
    ----------
    rig : Rig
        Its name or the path of its file will do.
    K, rate, amplitudes
        As of `furuta.closed_loop`.
    ax : matplotlib.axes.Axes, optional

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> import furuta, numpy as np
    >>> K, _, _ = furuta.lqr("shahzad2022-srv02", np.diag([1, 10, 0, 0]), 0.01)
    >>> figure = furuta.plot.nyquist("shahzad2022-srv02", K[0], rate=500)
    >>> figure.axes[0].get_xlabel()
    'Re L'
    """
    _, found = _loop(rig, K, rate, amplitudes)
    response, of = found["response"], found["margins"]
    figure, (plane,) = axes(ax, 1, (6, 6), "furuta.plot.nyquist")
    plane.plot(response.real, response.imag, color=MEASURED, lw=1.3, label="frequencies above 0")
    plane.plot(response.real, -response.imag, color=FAINT, lw=1.0, label="below 0")
    turn: Any = np.exp(1j * np.linspace(0, 2 * np.pi, 361))
    plane.plot(turn.real, turn.imag, color=FAINT, lw=0.8, ls=DASHED)
    half = 0.5 * of["disk"]
    if of["stable"] and half < 1:
        # |1 + L| = c |1 - L| is this circle.
        centre, radius = (half**2 + 1) / (half**2 - 1), 2 * half / (1 - half**2)
        disk = centre + radius * turn
        plane.fill(disk.real, disk.imag, color=FLOOR, alpha=0.2, lw=0)
        plane.plot(disk.real, disk.imag, color=FLOOR, lw=1.3, label=f"disk margin {of['disk']:.3g}")
    plane.plot(-1, 0, "+", color=BEFORE, ms=10, mew=2, label="-1")
    plane.set(xlim=(-3, 3), ylim=(-3, 3), aspect="equal", xlabel="Re L", ylabel="Im L")
    plane.legend(frameon=False, fontsize=9)
    plane.grid(True, color="#e4e4e4", lw=0.6)
    return figure


def _loop(rig: Any, K: ArrayLike, rate: float | None, amplitudes: Sequence[float] | None) -> tuple[np.ndarray, Any]:
    """Frequencies (rad/s), and `closed_loop` with its response there."""
    highest = HIGHEST if rate is None else np.pi * rate
    omega = np.geomspace(LOWEST, highest, 2000)
    return omega, closed_loop(rig, K, rate=rate, amplitudes=amplitudes, omega=omega)
