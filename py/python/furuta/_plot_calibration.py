"""Figures of a calibration and of a validation; see `furuta.Calibration.plot` and `furuta.Validation.plot`."""

from __future__ import annotations

from typing import Any

import numpy as np


from furuta._axes import axes as given_axes, new_figure


def plot(calibration: Any, run: str | None = None, ax: Any = None) -> Any:
    """The figure of a calibration: intervals, measured against predicted, profiles; with axes given, the intervals."""
    if ax is not None:
        figure, (one,) = given_axes(ax, 1, (8, 4), "Calibration.plot")
        _intervals(one, calibration)
        return figure
    curves = {c["run"]: c for c in calibration.curves()}
    if run is None:
        run = next(iter(curves))
    elif run not in curves:
        raise KeyError(f"no recording is called {run!r}; there are {', '.join(curves)}")
    profiles = calibration.profiles
    figure = new_figure((11, 10 if profiles else 8), "Calibration.plot")
    grid = figure.add_gridspec(4 if profiles else 3, max(len(profiles), 1))
    _intervals(figure.add_subplot(grid[0, :]), calibration)
    curve = curves[run]
    angles = [figure.add_subplot(grid[1 + c, :]) for c in (0, 1)]
    for c, (axes, name) in enumerate(zip(angles, ("theta", "alpha"))):
        axes.plot(curve["t"], curve["nominal"][c], "--", color="tab:gray", lw=0.9, label="rig file")
        axes.plot(curve["t"], curve["measured"][c], color="black", lw=1.1, label="measured")
        axes.plot(curve["t"], curve["calibrated"][c], color="tab:blue", lw=0.9, label="calibrated")
        low, high = np.min(curve["measured"][c]), np.max(curve["measured"][c])
        axes.set_ylim(low - 0.15 * (high - low), high + 0.15 * (high - low))
        axes.set_ylabel(f"{name} [rad]")
        axes.legend(loc="upper right", fontsize=8)
    angles[-1].set_xlabel("t [s]")
    for i, profile in enumerate(profiles):
        axes = figure.add_subplot(grid[3, i])
        axes.plot(profile["values"], profile["rise"], "o-", ms=3)
        axes.axhline(3.84, ls=":", color="gray")
        axes.set_ylim(-0.3, 12)
        axes.set_xlabel(f"{profile['key']} [{profile['unit']}]")
        axes.set_ylabel("rise of the cost")
    return figure


def _intervals(axes: Any, calibration: Any) -> None:
    for row, key in enumerate(calibration.fitted):
        p = calibration.parameters[key]
        unit = p["nominal"] or p["fitted"]
        if p["interval"]:
            axes.plot(np.array(p["interval"]) / unit, [row, row], color="tab:blue", lw=4, solid_capstyle="round")
        axes.plot(p["fitted"] / unit, row, "o", color="tab:blue")
    axes.axvline(1.0, color="gray", lw=0.8)
    axes.set_yticks(range(len(calibration.fitted)), calibration.fitted)
    axes.invert_yaxis()
    axes.set_xlabel("share of the rig file's value, 95 % interval")


def plot_validation(validation: Any, ax: Any = None) -> Any:
    """The figure of a validation: the residuals' correlations with their bounds, and errors after fixed times; with axes given, the
    errors."""
    channels = validation.channels
    if ax is not None:
        figure, (one,) = given_axes(ax, 1, (6, 4), "Validation.plot")
        for c in channels:
            one.loglog([s["seconds"] for s in c["steps"]], [s["rms"] for s in c["steps"]], "o-", label=f"{c['run']} {c['channel']}")
        one.set_xlabel("predicted ahead [s]")
        one.set_ylabel("RMS error [rad]")
        one.legend(fontsize=8, frameon=False)
        return figure
    figure = new_figure((12, 2.6 * len(channels)), "Validation.plot")
    axes = figure.subplots(len(channels), 3, squeeze=False)
    for row, c in zip(axes, channels):
        white, cross = c["whiteness"], c["cross"]
        row[0].stem(range(1, len(white["values"]) + 1), white["values"], basefmt=" ", markerfmt=".")
        row[0].axhspan(-white["bound"], white["bound"], color="tab:blue", alpha=0.15)
        row[0].set_title(f"{c['run']} {c['channel']}: {c['fit_percent']:.1f} %", fontsize=9)
        row[0].set_ylabel("autocorrelation")
        row[1].stem(cross["lags"], cross["values"], basefmt=" ", markerfmt=".")
        if cross["bound"] is not None:
            row[1].axhspan(-cross["bound"], cross["bound"], color="tab:blue", alpha=0.15)
        row[1].set_ylabel("correlation with u")
        row[2].loglog([s["seconds"] for s in c["steps"]], [s["rms"] for s in c["steps"]], "o-")
        row[2].axhline(c["noise_floor"], ls=":", color="gray")
        row[2].set_ylabel("RMS error [rad]")
    axes[-1][0].set_xlabel("lag [samples]")
    axes[-1][1].set_xlabel("lag [samples]")
    axes[-1][2].set_xlabel("predicted ahead [s]")
    return figure
