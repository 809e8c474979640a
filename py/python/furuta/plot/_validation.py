"""`Validation.plot`: the residuals' correlations with their bounds, and errors after fixed times."""

from __future__ import annotations

from typing import Any

from furuta.plot._axes import axes as given_axes, new_figure


def plot(validation: Any, ax: Any = None) -> Any:
    """The figure of a validation; see `furuta.Validation.plot`. With axes given, the errors after fixed times."""
    channels = validation.channels
    if ax is not None:
        figure, (one,) = given_axes(ax, 1, (6, 4), "Validation.plot")
        for c in channels:
            one.loglog(*_steps(c), "o-", label=f"{c['run']} {c['channel']}")
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
        row[2].loglog(*_steps(c), "o-")
        row[2].axhline(c["noise_floor"], ls=":", color="gray")
        row[2].set_ylabel("RMS error [rad]")
    axes[-1][0].set_xlabel("lag [samples]")
    axes[-1][1].set_xlabel("lag [samples]")
    axes[-1][2].set_xlabel("predicted ahead [s]")
    return figure


def _steps(channel: dict[str, Any]) -> tuple[list[float], list[float]]:
    """Times predicted ahead, s, and RMS errors after them."""
    return [s["seconds"] for s in channel["steps"]], [s["rms"] for s in channel["steps"]]
