"""`Frf.plot`: magnitude, phase and coherence over a logarithmic frequency."""

from __future__ import annotations

from typing import Any

import numpy as np

from furuta._axes import AFTER, BEFORE, FAINT, FLOOR, MEASURED, axes

MODELS = [BEFORE, AFTER, FLOOR, "#a64ca6"]


def plot(frf: Any, models: dict[str, Any], ax: Any = None) -> Any:
    """The Bode plot of a response; see `furuta.Frf.plot`."""
    frequency, response = frf.frequency, frf.response
    # Beyond a radius as large as the response nothing is known of it.
    share = np.minimum(frf.confidence(0.95) / np.abs(response), 0.999)
    db, phase = frf.magnitude_db(), frf.phase_degrees()
    figure, drawn = axes(ax, 3, (9, 8), "Frf.plot", at_least=1, heights=[2, 2, 1])
    magnitude, angle, coherence = drawn + [None] * (3 - len(drawn))
    magnitude.fill_between(frequency, db + 20 * np.log10(1 - share), db + 20 * np.log10(1 + share), color=FAINT, alpha=0.3, lw=0)
    magnitude.semilogx(frequency, db, color=MEASURED, lw=1.6, label="measured")
    if angle is not None:
        width = np.degrees(np.arcsin(share))
        angle.fill_between(frequency, phase - width, phase + width, color=FAINT, alpha=0.3, lw=0)
        angle.semilogx(frequency, phase, color=MEASURED, lw=1.6)
        angle.set_ylabel("phase [deg]")
    for (name, model), colour in zip(models.items(), MODELS * (1 + len(models) // len(MODELS))):
        curve = np.asarray(model.response(frequency) if hasattr(model, "response") else model)
        _model(magnitude, angle, frequency, curve, phase, name, colour)
    if coherence is not None:
        coherence.semilogx(frequency, frf.coherence, color=MEASURED, lw=1.0)
        coherence.set_ylim(0, 1.02)
        coherence.set_ylabel("coherence")
    span = np.nanmin(db), np.nanmax(db)
    margin = 0.08 * max(span[1] - span[0], 10)
    magnitude.set_ylim(span[0] - margin, span[1] + margin)
    magnitude.set_ylabel("magnitude [dB]")
    drawn[-1].set_xlabel("frequency [Hz]")
    magnitude.legend(frameon=False, fontsize=9)
    for one in drawn:
        one.grid(True, which="both", color="#e4e4e4", lw=0.6)
    return figure


def _model(magnitude: Any, angle: Any, frequency: Any, curve: Any, phase: Any, name: str, colour: str) -> None:
    """A curve laid over, its phase turned by whole turns to the measured one."""
    magnitude.semilogx(frequency, 20 * np.log10(np.abs(curve)), color=colour, lw=1.2, ls=(0, (4, 2)), label=name)
    if angle is None:
        return
    turned = np.degrees(np.unwrap(np.angle(curve)))
    middle = len(turned) // 2
    turned += 360 * np.round((phase[middle] - turned[middle]) / 360)
    angle.semilogx(frequency, turned, color=colour, lw=1.2, ls=(0, (4, 2)))


def comparison(found: Any, ax: Any = None) -> Any:
    """What was measured and the three best explanations; see `furuta.Comparison.plot`."""
    figure, drawn = axes(ax, 2, (9, 6), "Comparison.plot", at_least=1)
    magnitude, angle = drawn + [None] * (2 - len(drawn))
    frequency, measured = found.frequency, found.measured
    phase = np.degrees(np.unwrap(np.angle(measured)))
    magnitude.semilogx(frequency, 20 * np.log10(np.abs(measured)), color=MEASURED, lw=1.6, label="measured")
    if angle is not None:
        angle.semilogx(frequency, phase, color=MEASURED, lw=1.6)
        angle.set_ylabel("phase [deg]")
    for explanation, colour in zip(found.explanations[:3], MODELS):
        name = ", ".join(explanation["effects"]) or "parameters refitted"
        _model(magnitude, angle, frequency, explanation["response"], phase, name, colour)
    magnitude.set_ylabel("magnitude [dB]")
    drawn[-1].set_xlabel("frequency [Hz]")
    magnitude.legend(frameon=False, fontsize=9)
    return figure
