"""`Diagnosis.plot`: measured against predicted, where the gap sits, what was tried."""

from __future__ import annotations

import textwrap
from typing import Any

import numpy as np

from furuta._axes import AFTER, BEFORE, FAINT, FLOOR, MEASURED, axes as given_axes, new_figure

CANDIDATES = 8


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
    theta.set_title(f"{chosen['name']}: starts anew at each faint line ({diagnosis.gap['horizon']:g} s)", fontsize=10, loc="left")
    gap(figure.add_subplot(grid[3, 0]), curves["bars"])
    evidence(figure.add_subplot(grid[3, 1]), curves["evidence"])
    figure.suptitle("\n".join(textwrap.wrap(diagnosis.summary().splitlines()[0], 110)), fontsize=11, fontweight="bold")
    for axes in figure.axes:
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(labelsize=9)
    return figure


def _series(run: dict[str, Any], name: str, channel: int) -> np.ndarray:
    values = run[name][channel]
    return np.array(values, dtype=float) if values else np.full(len(run["t"]), np.nan)


def _largest_error(run: dict[str, Any]) -> float:
    errors = [np.abs(_series(run, "recalibrated", c) - _series(run, "measured", c)) for c in (0, 1)]
    return float(max(np.nanmax(e, initial=0.0) for e in errors))


def chosen_run(curves: dict[str, Any], run: str | None) -> dict[str, Any]:
    """The curves of the recording of this name; of the one with the largest error if none is given."""
    runs = {r["name"]: r for r in curves["runs"]}
    if run is None:
        return max(runs.values(), key=_largest_error)
    if run not in runs:
        raise KeyError(f"no recording is called {run!r}; there are {', '.join(runs)}")
    return runs[run]


def stretch(run: dict[str, Any], seconds: float) -> slice:
    """The samples of the stretch of this length in which most of the error of the refitted model is."""
    t = np.array(run["t"])
    errors = [np.nan_to_num(_series(run, "recalibrated", c) - _series(run, "measured", c)) for c in (0, 1)]
    wrong = errors[0] ** 2 + errors[1] ** 2
    width = min(max(2, int(seconds / (t[1] - t[0]))), len(t))
    first = int(np.argmax(np.convolve(wrong, np.ones(width), mode="valid")))
    return slice(first, first + width)


def _errors(run: dict[str, Any], name: str, part: slice) -> list[np.ndarray]:
    return [(_series(run, name, c) - _series(run, "measured", c))[part] for c in (0, 1)]


def _worst(run: dict[str, Any], part: slice) -> int:
    """The angle that the refitted model predicts worst."""
    return max((0, 1), key=lambda c: float(np.nansum(_errors(run, "recalibrated", part)[c] ** 2)))


def angles(axes: list[Any], run: dict[str, Any], part: slice) -> None:
    """Measured against predicted: of both angles, or in one pair of axes of the angle that is wrong most."""
    t = np.array(run["t"])
    channels = [_worst(run, part)] if len(axes) == 1 else [0, 1]
    for ax, c in zip(axes, channels):
        _starts(ax, run, part)
        ax.plot(t[part], _series(run, "measured", c)[part], color=MEASURED, lw=2.2, alpha=0.55, label="measured")
        ax.plot(t[part], _series(run, "recalibrated", c)[part], color=BEFORE, lw=1.3, label="parameters refitted")
        ax.plot(t[part], _series(run, "augmented", c)[part], color=AFTER, lw=1.3, ls=(0, (4, 2)), label="repaired")
        ax.set_ylabel(("arm, theta [rad]", "pendulum, alpha [rad]")[c])
    axes[0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, fontsize=9, frameon=False, borderaxespad=0.1)


def _error(ax: Any, run: dict[str, Any], part: slice) -> None:
    """The error of the angle that is wrong most, before and after."""
    _starts(ax, run, part)
    t, worst = np.array(run["t"]), _worst(run, part)
    for name, colour in (("recalibrated", BEFORE), ("augmented", AFTER)):
        ax.plot(t[part], _errors(run, name, part)[worst], color=colour, lw=1.1)
    ax.set_ylabel(f"error of {('theta', 'alpha')[worst]} [rad]")


def _starts(ax: Any, run: dict[str, Any], part: slice) -> None:
    """A faint line wherever a prediction starts anew."""
    for restart in run["restarts"]:
        if part.start <= restart < part.stop:
            ax.axvline(run["t"][restart], color=FAINT, lw=0.5, alpha=0.4)


def gap(ax: Any, bars: list[dict[str, Any]]) -> None:
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
    part = {"theta": "arm", "alpha": "pendulum"}[worst]
    ax.set_title(f"where the {part}'s error sits", fontsize=10, loc="left")
    ax.set_xlabel("RMS error over the noise of the encoders (green: 1)", fontsize=9)


def evidence(ax: Any, evidence: list[dict[str, Any]]) -> None:
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
