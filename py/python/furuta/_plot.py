"""`Diagnosis.plot`: measured against predicted, where the gap sits, what was tried."""

from __future__ import annotations

import textwrap
from typing import Any

import numpy as np

# As in the report.
MEASURED, BEFORE, AFTER, FLOOR, FAINT = "#23282e", "#d9730d", "#1f6fd6", "#2f9e6e", "#8d959e"
CANDIDATES = 8


def plot(diagnosis: Any, run: str | None = None, seconds: float = 4.0) -> Any:
    """The figure of a diagnosis; see `furuta.Diagnosis.plot`."""
    try:
        from matplotlib.figure import Figure
    except ImportError as e:
        raise ImportError("Diagnosis.plot draws with matplotlib, which is not installed: pip install matplotlib") from e

    curves = diagnosis.curves()
    runs = {r["name"]: r for r in curves["runs"]}
    if run is None:
        run = max(runs, key=lambda name: _largest_error(runs[name]))
    elif run not in runs:
        raise KeyError(f"no recording is called {run!r}; there are {', '.join(runs)}")

    # The object-oriented face: no window opens, no global state changes, a notebook shows what is returned once.
    figure = Figure(figsize=(11, 10), layout="constrained")
    grid = figure.add_gridspec(4, 2, height_ratios=[1, 1, 0.8, 1.4])
    theta = figure.add_subplot(grid[0, :])
    alpha, error = (figure.add_subplot(grid[row, :], sharex=theta) for row in (1, 2))
    _time_series([theta, alpha, error], runs[run], seconds, diagnosis.gap)
    _gap(figure.add_subplot(grid[3, 0]), curves["bars"])
    _evidence(figure.add_subplot(grid[3, 1]), curves["evidence"])
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


def _time_series(axes: list[Any], run: dict[str, Any], seconds: float, gap: dict[str, Any]) -> None:
    """A stretch around the largest error of the refitted model: both angles, and the error of the one that is wrong most."""
    t = np.array(run["t"])
    wrong = sum(np.nan_to_num(_series(run, "recalibrated", c) - _series(run, "measured", c)) ** 2 for c in (0, 1))
    # Where most of the error is within one stretch.
    width = min(max(2, int(seconds / (t[1] - t[0]))), len(t))
    sums = np.convolve(wrong, np.ones(width), mode="valid")
    first = int(np.argmax(sums))
    stretch = slice(first, first + width)
    for ax in axes:
        for restart in run["restarts"]:
            if first <= restart < first + width:
                ax.axvline(t[restart], color=FAINT, lw=0.5, alpha=0.4)
    for c, (ax, part) in enumerate(zip(axes, ["arm, theta [rad]", "pendulum, alpha [rad]"])):
        ax.plot(t[stretch], _series(run, "measured", c)[stretch], color=MEASURED, lw=2.2, alpha=0.55, label="measured")
        ax.plot(t[stretch], _series(run, "recalibrated", c)[stretch], color=BEFORE, lw=1.3, label="parameters refitted")
        ax.plot(t[stretch], _series(run, "augmented", c)[stretch], color=AFTER, lw=1.3, ls=(0, (4, 2)), label="repaired")
        ax.set_ylabel(part)
    errors = {
        (name, c): (_series(run, name, c) - _series(run, "measured", c))[stretch] for name in ("recalibrated", "augmented") for c in (0, 1)
    }
    worst = max((0, 1), key=lambda c: np.nansum(errors["recalibrated", c] ** 2))
    axes[2].plot(t[stretch], errors["recalibrated", worst], color=BEFORE, lw=1.1)
    axes[2].plot(t[stretch], errors["augmented", worst], color=AFTER, lw=1.1)
    axes[2].set_ylabel(f"error of {('theta', 'alpha')[worst]} [rad]")
    axes[0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, fontsize=9, frameon=False, borderaxespad=0.1)
    axes[0].set_title(f"{run['name']}: starts anew at each faint line ({gap['horizon']:g} s)", fontsize=10, loc="left")
    axes[0].tick_params(labelbottom=False)
    axes[1].tick_params(labelbottom=False)
    axes[2].set_xlabel("time [s]")


def _gap(ax: Any, bars: list[dict[str, Any]]) -> None:
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


def _evidence(ax: Any, evidence: list[dict[str, Any]]) -> None:
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
