"""Measured against predicted, of a diagnosis or a calibration."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from furuta._furuta import Calibration, Diagnosis
from furuta.plot._axes import axes
from furuta.plot._calibration import angles as calibrated, chosen_run as chosen_of_calibration
from furuta.plot._diagnosis import angles as diagnosed, chosen_run as chosen_of_diagnosis, stretch

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def before_after(
    result: Diagnosis | Calibration, *, run: str | None = None, seconds: float = 4.0, ax: Any = None
) -> Figure:
    """Draws what was measured and what the model predicts before and after.

    After: of a diagnosis with the effects added, of a calibration with the parameters fitted.

    Parameters
    ----------
    result : Diagnosis or Calibration
    run : str, optional
        Name of the recording; of a diagnosis the one with the largest error, of a calibration the first, if not given.
    seconds : float, optional
        Length of the stretch of a diagnosis, around the largest error.
    ax : matplotlib.axes.Axes or two of them, optional
        One: the angle that is wrong most before. Two: arm and pendulum.

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
    >>> figure = furuta.plot.before_after(diagnosis)
    >>> figure.savefig("before_after.png")
    """
    if not isinstance(result, (Diagnosis, Calibration)):
        raise TypeError(f"before_after draws a Diagnosis or a Calibration; a {type(result).__name__} was given")
    figure, drawn = axes(ax, 2, (10, 5), "furuta.plot.before_after", at_least=1)
    curves = result.curves()
    if isinstance(curves, dict):
        chosen = chosen_of_diagnosis(curves, run)
        diagnosed(drawn, chosen, stretch(chosen, seconds))
    else:
        calibrated(drawn, chosen_of_calibration(curves, run))
    drawn[-1].set_xlabel("time [s]")
    return figure
