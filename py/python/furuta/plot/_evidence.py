"""What was tried, and how far it improves the model."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from furuta.plot._axes import axes
from furuta.plot._style import AFTER, FAINT, FLOOR

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from furuta._furuta import Diagnosis

CANDIDATES = 8


def evidence(diagnosis: Diagnosis, *, ax: Any = None) -> Figure:
    """Draws how far each candidate alone lowers the Bayesian information criterion, the best first.

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
    >>> figure = furuta.plot.evidence(diagnosis)
    >>> figure.savefig("evidence.png")
    """
    figure, (one,) = axes(ax, 1, (7, 4), "furuta.plot.evidence")
    draw(one, diagnosis.curves()["evidence"])
    return figure


def draw(ax: Any, evidence: list[dict[str, Any]]) -> None:
    """How far each candidate alone lowers the information criterion, the best first."""
    best = sorted((e for e in evidence if (e["delta_bic"] or 0.0) > 0.0), key=lambda e: -e["delta_bic"])[:CANDIDATES]
    if not best:
        ax.text(0.5, 0.5, "no effect improves the model", ha="center", va="center", color=FAINT)
        ax.set_axis_off()
        return
    y = np.arange(len(best))[::-1]
    ax.barh(y, [e["delta_bic"] for e in best], height=0.6, color=[AFTER if e["named"] else FAINT for e in best])
    ax.set_xscale("log")
    ax.set_xlim(left=min(10.0, best[-1]["delta_bic"] / 2))
    ax.axvline(10.0, color=FLOOR, lw=1.2)
    ax.set_yticks(y, [e["id"] for e in best], fontsize=8)
    ax.set_title("evidence, each alone (blue: named)", fontsize=10, loc="left")
    ax.set_xlabel("fall of BIC (green: 10, very strong)", fontsize=9)
