"""Where the gap sits."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from furuta.plot._axes import axes
from furuta.plot._style import AFTER, BEFORE, FLOOR, PARTS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from furuta._furuta import Diagnosis


def gap_map(diagnosis: Diagnosis, *, ax: Any = None) -> Figure:
    """Draws where the gap sits: the error of the angle that is wrong most by condition, before and after.

    Conditions are slow, fast, near upright and others; errors are in multiples of the encoders' noise.

    Parameters
    ----------
    diagnosis : Diagnosis
    ax : matplotlib.axes.Axes, optional

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> import numpy as np, furuta
    >>> rig = furuta.Rig.load("qube-servo-2")
    >>> real = rig.with_effect("arm.spring", stiffness=4e-3, rest=0.2)  # unknown to the diagnosis
    >>> u = furuta.signal("chirp", 2, 0.01, amplitude=1.5)
    >>> run = furuta.Trajectory.simulate(real, [0, np.pi, 0, 0], u, 0.01)
    >>> diagnosis = furuta.diagnose(run.to_recording(), rig)
    >>> figure = furuta.plot.gap_map(diagnosis)
    >>> figure.savefig("gap_map.png")
    """
    figure, (one,) = axes(ax, 1, (7, 5), "furuta.plot.gap_map")
    draw(one, diagnosis.curves()["bars"])
    return figure


def draw(ax: Any, bars: list[dict[str, Any]]) -> None:
    """Errors by condition in multiples of the encoders' noise, of the angle that is wrong most."""
    if not bars:
        ax.set_axis_off()
        return
    worst = max(bars, key=lambda b: b["recalibrated"] or 0.0)["channel"]
    shown = [b for b in bars if b["channel"] == worst and b["group"] != "run"]
    y = np.arange(len(shown))[::-1]
    for name, colour, offset in [("recalibrated", BEFORE, 0.2), ("augmented", AFTER, -0.2)]:
        ax.barh(y + offset, [max(b[name] or 0.0, 0.0) ** 0.5 for b in shown], height=0.36, color=colour)
    ax.axvline(1.0, color=FLOOR, lw=1.2)
    ax.set_xscale("log")
    ax.set_yticks(y, [b["condition"] for b in shown], fontsize=8)
    ax.set_title(f"where the {PARTS[worst]}'s error sits", fontsize=10, loc="left")
    ax.set_xlabel("RMS error over the noise of the encoders (green: 1)", fontsize=9)
