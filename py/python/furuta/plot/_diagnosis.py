"""The parts of a diagnosis, each alone."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from furuta import _plot
from furuta._axes import AFTER, BEFORE, FAINT, MEASURED, axes

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from furuta._furuta import Calibration, Diagnosis


def before_after(result: Diagnosis | Calibration, *, run: str | None = None, seconds: float = 4.0, ax: Any = None) -> Figure:
    """Draws what was measured and what the model predicts before and after: of a diagnosis with the effects added, of a calibration with
    the parameters fitted.

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
    >>> import furuta
    >>> diagnosis = furuta.diagnose(["run-1.csv", "run-2.csv"], "rig.toml")  # doctest: +SKIP
    >>> furuta.plot.before_after(diagnosis).savefig("before_after.png")  # doctest: +SKIP
    """
    figure, drawn = axes(ax, 2, (10, 5), "furuta.plot.before_after", at_least=1)
    curves = result.curves()
    if isinstance(curves, dict):
        chosen = _plot.chosen_run(curves, run)
        _plot.angles(drawn, chosen, _plot.stretch(chosen, seconds))
        drawn[-1].set_xlabel("time [s]")
        return figure
    runs = {c["run"]: c for c in curves}
    if run is not None and run not in runs:
        raise KeyError(f"no recording is called {run!r}; there are {', '.join(runs)}")
    curve = runs[run] if run is not None else next(iter(runs.values()))
    of = {name: [np.array(c, dtype=float) for c in curve[name]] for name in ("nominal", "measured", "calibrated")}
    wrong = [float(np.nansum((of["nominal"][c] - of["measured"][c]) ** 2)) for c in (0, 1)]
    channels = [int(np.argmax(wrong))] if len(drawn) == 1 else [0, 1]
    for one, c in zip(drawn, channels):
        one.plot(curve["t"], of["measured"][c], color=MEASURED, lw=2.2, alpha=0.55, label="measured")
        one.plot(curve["t"], of["nominal"][c], color=BEFORE, lw=1.2, label="rig file")
        one.plot(curve["t"], of["calibrated"][c], color=AFTER, lw=1.2, ls=(0, (4, 2)), label="calibrated")
        one.set_ylabel(("arm, theta [rad]", "pendulum, alpha [rad]")[c])
    drawn[0].legend(frameon=False, fontsize=9)
    drawn[-1].set_xlabel("time [s]")
    return figure


def gap_map(diagnosis: Diagnosis, *, ax: Any = None) -> Figure:
    """Draws where the gap sits: the error of the angle that is wrong most by condition (slow, fast, near upright, ...), in multiples of
    the encoders' noise, before and after.

    Parameters
    ----------
    diagnosis : Diagnosis
    ax : matplotlib.axes.Axes, optional

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> import furuta
    >>> diagnosis = furuta.diagnose(["run-1.csv", "run-2.csv"], "rig.toml")  # doctest: +SKIP
    >>> furuta.plot.gap_map(diagnosis).savefig("gap_map.png")  # doctest: +SKIP
    """
    figure, (one,) = axes(ax, 1, (7, 5), "furuta.plot.gap_map")
    _plot.gap(one, diagnosis.curves()["bars"])
    return figure


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
    >>> import furuta
    >>> diagnosis = furuta.diagnose(["run-1.csv", "run-2.csv"], "rig.toml")  # doctest: +SKIP
    >>> furuta.plot.evidence(diagnosis).savefig("evidence.png")  # doctest: +SKIP
    """
    figure, (one,) = axes(ax, 1, (7, 4), "furuta.plot.evidence")
    _plot.evidence(one, diagnosis.curves()["evidence"])
    return figure


def missing_torque(diagnosis: Diagnosis, *, axis: str | None = None, state: str | None = None, ax: Any = None) -> Figure:
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
    >>> import furuta
    >>> diagnosis = furuta.diagnose(["run-1.csv", "run-2.csv"], "rig.toml")  # doctest: +SKIP
    >>> furuta.plot.missing_torque(diagnosis).savefig("missing_torque.png")  # doctest: +SKIP
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
    part = {"theta": "arm", "alpha": "pendulum"}[curve["axis"]]
    one.set_ylabel(f"torque missing on the {part} [N m]")
    one.legend(frameon=False, fontsize=9, title="band: one standard deviation", title_fontsize=8)
    return figure
