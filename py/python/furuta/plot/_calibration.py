"""`Calibration.plot`: intervals, measured against predicted, profiles."""

from __future__ import annotations

from typing import Any

import numpy as np

from furuta.plot._axes import axes as given_axes, new_figure
from furuta.plot._prediction import Prediction, called, draw


def plot(calibration: Any, run: str | None = None, ax: Any = None) -> Any:
    """The figure of a calibration; see `furuta.Calibration.plot`. With axes given, the intervals."""
    if ax is not None:
        figure, (one,) = given_axes(ax, 1, (8, 4), "Calibration.plot")
        _intervals(one, calibration)
        return figure
    chosen = chosen_run(calibration.curves(), run)
    profiles = calibration.profiles
    figure = new_figure((11, 10 if profiles else 8), "Calibration.plot")
    grid = figure.add_gridspec(4 if profiles else 3, max(len(profiles), 1))
    _intervals(figure.add_subplot(grid[0, :]), calibration)
    drawn = [figure.add_subplot(grid[row, :]) for row in (1, 2)]
    angles(drawn, chosen)
    drawn[-1].set_xlabel("time [s]")
    for i, profile in enumerate(profiles):
        _profile(figure.add_subplot(grid[3, i]), profile)
    return figure


def chosen_run(curves: list[dict[str, Any]], run: str | None) -> dict[str, Any]:
    """The curves of the recording of this name; of the first if none is given."""
    runs = {c["run"]: c for c in curves}
    return next(iter(runs.values())) if run is None else called(runs, run)


def angles(axes: list[Any], run: dict[str, Any]) -> None:
    """Measured against predicted: of both angles, or in one pair of axes of the angle that is wrong most."""
    shown = Prediction.of(run, "nominal", "calibrated")
    for ax, c in zip(axes, draw(axes, shown, "rig file", "calibrated")):
        # What the rig file predicts may leave all that was measured far behind.
        low, high = np.min(shown.measured[c]), np.max(shown.measured[c])
        ax.set_ylim(low - 0.15 * (high - low), high + 0.15 * (high - low))


def _intervals(axes: Any, calibration: Any) -> None:
    for row, key in enumerate(calibration.fitted):
        p = calibration.parameters[key]
        # A parameter that is 0 in the rig file is a share of what was found; one that is 0 in both, itself.
        unit = p["nominal"] or p["fitted"] or 1.0
        if p["interval"]:
            axes.plot(np.array(p["interval"]) / unit, [row, row], color="tab:blue", lw=4, solid_capstyle="round")
        axes.plot(p["fitted"] / unit, row, "o", color="tab:blue")
    axes.axvline(1.0, color="gray", lw=0.8)
    axes.set_yticks(range(len(calibration.fitted)), calibration.fitted)
    axes.invert_yaxis()
    axes.set_xlabel("share of the rig file's value, 95 % interval")


def _profile(axes: Any, profile: dict[str, Any]) -> None:
    """How much the cost rises with a parameter held at other values."""
    axes.plot(profile["values"], profile["rise"], "o-", ms=3)
    axes.axhline(3.84, ls=":", color="gray")
    axes.set_ylim(-0.3, 12)
    axes.set_xlabel(f"{profile['key']} [{profile['unit']}]")
    axes.set_ylabel("rise of the cost")
