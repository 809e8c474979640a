"""`Frf.plot`: magnitude, phase and coherence over a logarithmic frequency."""

from __future__ import annotations

from typing import Any

import numpy as np

# As in the report.
MEASURED, FAINT, MODELS = "#23282e", "#8d959e", ["#d9730d", "#1f6fd6", "#2f9e6e", "#a64ca6"]


def plot(frf: Any, models: dict[str, Any]) -> Any:
    """The Bode plot of a response; see `furuta.Frf.plot`."""
    try:
        from matplotlib.figure import Figure
    except ImportError as e:
        raise ImportError("Frf.plot draws with matplotlib, which is not installed: pip install matplotlib") from e

    frequency, response = frf.frequency, frf.response
    # Beyond a radius as large as the response nothing is known of it.
    share = np.minimum(frf.confidence(0.95) / np.abs(response), 0.999)
    db, phase = frf.magnitude_db(), frf.phase_degrees()
    figure = Figure(figsize=(9, 8), layout="constrained")
    magnitude, angle, coherence = figure.subplots(3, 1, sharex=True, height_ratios=[2, 2, 1])
    magnitude.fill_between(frequency, db + 20 * np.log10(1 - share), db + 20 * np.log10(1 + share), color=FAINT, alpha=0.3, lw=0)
    angle.fill_between(frequency, phase - np.degrees(np.arcsin(share)), phase + np.degrees(np.arcsin(share)), color=FAINT, alpha=0.3, lw=0)
    magnitude.semilogx(frequency, db, color=MEASURED, lw=1.6, label="measured")
    angle.semilogx(frequency, phase, color=MEASURED, lw=1.6)
    for (name, model), colour in zip(models.items(), MODELS * (1 + len(models) // len(MODELS))):
        curve = np.asarray(model.response(frequency) if hasattr(model, "response") else model)
        turned = np.degrees(np.unwrap(np.angle(curve)))
        middle = len(turned) // 2
        turned += 360 * np.round((phase[middle] - turned[middle]) / 360)
        magnitude.semilogx(frequency, 20 * np.log10(np.abs(curve)), color=colour, lw=1.2, ls=(0, (4, 2)), label=name)
        angle.semilogx(frequency, turned, color=colour, lw=1.2, ls=(0, (4, 2)))
    coherence.semilogx(frequency, frf.coherence, color=MEASURED, lw=1.0)
    coherence.set_ylim(0, 1.02)
    span = np.nanmin(db), np.nanmax(db)
    margin = 0.08 * max(span[1] - span[0], 10)
    magnitude.set_ylim(span[0] - margin, span[1] + margin)
    magnitude.set_ylabel("magnitude [dB]")
    angle.set_ylabel("phase [deg]")
    coherence.set_ylabel("coherence")
    coherence.set_xlabel("frequency [Hz]")
    magnitude.legend(frameon=False, fontsize=9)
    for axes in figure.axes:
        axes.grid(True, which="both", color="#e4e4e4", lw=0.6)
        axes.spines[["top", "right"]].set_visible(False)
    return figure
