"""`Diagnosis.plot`: measured against predicted, where the gap sits, what was tried."""

from __future__ import annotations

import textwrap
from typing import Any

import numpy as np

from furuta.plot._axes import axes as given_axes, new_figure
from furuta.plot._evidence import draw as draw_evidence
from furuta.plot._gap import draw as draw_gap
from furuta.plot._prediction import Prediction, called, draw
from furuta.plot._style import AFTER, BEFORE, FAINT


def plot(diagnosis: Any, run: str | None = None, seconds: float = 4.0, ax: Any = None) -> Any:
    """The figure of a diagnosis; see `furuta.Diagnosis.plot`."""
    curves = diagnosis.curves()
    chosen = chosen_run(curves, run)
    part = stretch(chosen, seconds)
    if ax is not None:
        figure, drawn = given_axes(ax, 3, (11, 10), "Diagnosis.plot", at_least=1)
        angles(drawn[:2], chosen, part)
        if len(drawn) == 3:
            _error(drawn[2], chosen, part)
        drawn[-1].set_xlabel("time [s]")
        return figure
    figure = new_figure((11, 10), "Diagnosis.plot")
    grid = figure.add_gridspec(4, 2, height_ratios=[1, 1, 0.8, 1.4])
    theta = figure.add_subplot(grid[0, :])
    alpha, error = (figure.add_subplot(grid[row, :], sharex=theta) for row in (1, 2))
    angles([theta, alpha], chosen, part)
    _error(error, chosen, part)
    for one in (theta, alpha):
        one.tick_params(labelbottom=False)
    error.set_xlabel("time [s]")
    anew = f"starts anew at each faint line ({diagnosis.gap['horizon']:g} s)"
    theta.set_title(f"{chosen['name']}: {anew}", fontsize=10, loc="left")
    draw_gap(figure.add_subplot(grid[3, 0]), curves["bars"])
    draw_evidence(figure.add_subplot(grid[3, 1]), curves["evidence"])
    found = textwrap.wrap(diagnosis.summary().splitlines()[0], 110)
    figure.suptitle("\n".join(found), fontsize=11, fontweight="bold")
    for axes in figure.axes:
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(labelsize=9)
    return figure


def prediction(run: dict[str, Any]) -> Prediction:
    """Of a recording: before the model with the parameters refitted, after the repaired one."""
    return Prediction.of(run, "recalibrated", "augmented")


def chosen_run(curves: dict[str, Any], run: str | None) -> dict[str, Any]:
    """The curves of the recording of this name; of the one with the largest error if none is given."""
    runs = {r["name"]: r for r in curves["runs"]}
    return max(runs.values(), key=_largest_error) if run is None else called(runs, run)


def _largest_error(run: dict[str, Any]) -> float:
    return float(max(np.nanmax(np.abs(error), initial=0.0) for error in prediction(run).errors()[0]))


def stretch(run: dict[str, Any], seconds: float) -> slice:
    """The samples of the stretch of this length in which most of the error of the refitted model is."""
    if not (seconds > 0 and np.isfinite(seconds)):
        raise ValueError(f"seconds = {seconds:g} must be a finite number above 0")
    t = np.array(run["t"])
    theta, alpha = (np.nan_to_num(error) for error in prediction(run).errors()[0])
    width = min(max(2, int(seconds / (t[1] - t[0]))), len(t))
    first = int(np.argmax(np.convolve(theta**2 + alpha**2, np.ones(width), mode="valid")))
    return slice(first, first + width)


def angles(axes: list[Any], run: dict[str, Any], part: slice) -> None:
    """Measured against predicted: of both angles, or in one pair of axes of the angle that is wrong most."""
    for ax in axes:
        _starts(ax, run, part)
    draw(axes, prediction(run).part(part), "parameters refitted", "repaired")


def _error(ax: Any, run: dict[str, Any], part: slice) -> None:
    """The error of the angle that is wrong most, before and after."""
    _starts(ax, run, part)
    shown = prediction(run).part(part)
    worst = shown.worst()
    for error, colour in zip(shown.errors(), (BEFORE, AFTER)):
        ax.plot(shown.t, error[worst], color=colour, lw=1.1)
    ax.set_ylabel(f"error of {('theta', 'alpha')[worst]} [rad]")


def _starts(ax: Any, run: dict[str, Any], part: slice) -> None:
    """A faint line wherever a prediction starts anew."""
    for restart in run["restarts"]:
        if part.start <= restart < part.stop:
            ax.axvline(run["t"][restart], color=FAINT, lw=0.5, alpha=0.4)
