"""`Frf.plot`: magnitude, phase and coherence with what is known of them, and models laid over."""

from __future__ import annotations

from itertools import cycle
from typing import Any

import numpy as np

from furuta.plot._axes import axes
from furuta.plot._response import Drawn, curve, grid, label
from furuta.plot._style import AFTER, BEFORE, DASHED, FAINT, FLOOR, MEASURED

MODELS = (BEFORE, AFTER, FLOOR, "#a64ca6")


def plot(frf: Any, models: dict[str, Any], ax: Any = None) -> Any:
    """The Bode plot of a response; see `furuta.Frf.plot`."""
    frequency, response = frf.frequency, frf.response
    models = {name: _laid_over(name, model, frequency) for name, model in models.items()}
    # Beyond a radius as large as the response nothing is known of it.
    share = np.minimum(frf.confidence(0.95) / np.abs(response), 0.999)
    db, phase = frf.magnitude_db(), frf.phase_degrees()
    figure, drawn = axes(ax, 3, (9, 8), "Frf.plot", at_least=1, heights=[2, 2, 1])
    band: dict[str, Any] = {"color": FAINT, "alpha": 0.3, "lw": 0}
    drawn[0].fill_between(frequency, db + 20 * np.log10(1 - share), db + 20 * np.log10(1 + share), **band)
    if len(drawn) > 1:
        width = np.degrees(np.arcsin(share))
        drawn[1].fill_between(frequency, phase - width, phase + width, **band)
    measured = Drawn(frequency, np.abs(response), phase)
    curve(drawn[:2], frequency, response, measured, label="measured", color=MEASURED, lw=1.6)
    for (name, model), colour in zip(models.items(), cycle(MODELS)):
        curve(drawn[:2], frequency, model, measured, label=name, color=colour, lw=1.2, ls=DASHED)
    if len(drawn) > 2:
        drawn[2].semilogx(frequency, frf.coherence, color=MEASURED, lw=1.0)
        drawn[2].set_ylim(0, 1.02)
    span = np.nanmin(db), np.nanmax(db)
    margin = 0.08 * max(span[1] - span[0], 10)
    drawn[0].set_ylim(span[0] - margin, span[1] + margin)
    label(drawn)
    drawn[0].legend(frameon=False, fontsize=9)
    grid(drawn)
    return figure


def _laid_over(name: str, model: Any, frequency: Any) -> Any:
    """The response of a model at these frequencies; `name` is the argument it was given as."""
    if callable(getattr(model, "response", None)):
        return model.response(frequency)
    wanted = f"a TransferFit or an array of numbers of shape {frequency.shape}, one for each frequency"
    try:
        values = np.asarray(model)
    except ValueError:  # rows of different lengths
        values = np.asarray(None)
    if values.dtype.kind not in "biufc":
        raise TypeError(f"{name} must be {wanted}; a {type(model).__name__} was given")
    if values.shape != frequency.shape:
        raise ValueError(f"{name} has shape {values.shape}; it must be {wanted}")
    return values
