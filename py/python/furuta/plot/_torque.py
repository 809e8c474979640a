"""The torque that a model lacks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from furuta.plot._axes import axes
from furuta.plot._style import AFTER, BEFORE, FAINT, PARTS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from furuta._furuta import Diagnosis


def missing_torque(
    diagnosis: Diagnosis, *, axis: str | None = None, state: str | None = None, ax: Any = None
) -> Figure:
    """Draws the torque that the model lacks over a state, before and after, with one standard deviation either way.

    Parameters
    ----------
    diagnosis : Diagnosis
    axis : {"theta", "alpha"}, optional
        The axis on which it acts; with `state`: what explains most of the gap if neither is given.
    state : {"theta", "theta_dot", "alpha", "alpha_dot", "u"}, optional
    ax : matplotlib.axes.Axes, optional

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        The diagnosis has no such torque: it names those that it has.

    Examples
    --------
    >>> import numpy as np, furuta
    >>> rig = furuta.Rig.load("qube-servo-2")
    >>> real = rig.with_effect("arm.spring", stiffness=4e-3, rest=0.2)  # unknown to the diagnosis
    >>> u = furuta.signal("chirp", 2, 0.01, amplitude=1.5)
    >>> run = furuta.Trajectory.simulate(real, [0, np.pi, 0, 0], u, 0.01)
    >>> diagnosis = furuta.diagnose(run.to_recording(), rig)
    >>> figure = furuta.plot.missing_torque(diagnosis)
    >>> figure.savefig("missing_torque.png")
    """
    figure, (one,) = axes(ax, 1, (7, 4.5), "furuta.plot.missing_torque")
    curves = diagnosis.curves()["torque_by_state"]
    if axis is None and state is None and diagnosis.missing_torque:
        most = diagnosis.missing_torque[0]
        axis, state = most["axis"], most["state"]
    fitting = [c for c in curves if axis in (None, c["axis"]) and state in (None, c["state"])]
    if not fitting:
        known = ", ".join(f"{c['axis']} over {c['state']}" for c in curves) or "none"
        raise ValueError(f"no missing torque on {axis} over {state}; there are: {known}")
    curve = fitting[0]
    for name, label, colour in [("recalibrated", "parameters refitted", BEFORE), ("augmented", "repaired", AFTER)]:
        value, std = (np.array(curve[key], dtype=float) for key in (name, f"{name}_std"))
        if len(value) == 0:
            continue
        one.fill_between(curve["at"], value - std, value + std, color=colour, alpha=0.2, lw=0)
        one.plot(curve["at"], value, color=colour, lw=1.4, label=label)
    one.axhline(0.0, color=FAINT, lw=0.8)
    one.set_xlabel(f"{curve['state']} [{curve['unit']}]")
    one.set_ylabel(f"torque missing on the {PARTS[curve['axis']]} [N m]")
    one.legend(frameon=False, fontsize=9, title="band: one standard deviation", title_fontsize=8)
    return figure
