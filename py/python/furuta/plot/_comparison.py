"""`Comparison.plot`: a measured response and what explains it."""

from __future__ import annotations

from typing import Any

from furuta.plot._axes import axes
from furuta.plot._frf import MODELS
from furuta.plot._response import curve, label
from furuta.plot._style import DASHED, MEASURED


def plot(found: Any, ax: Any = None) -> Any:
    """What was measured and the three best explanations; see `furuta.Comparison.plot`."""
    figure, drawn = axes(ax, 2, (9, 6), "Comparison.plot", at_least=1)
    measured = curve(drawn, found.frequency, found.measured, label="measured", color=MEASURED, lw=1.6)
    for explanation, colour in zip(found.explanations[:3], MODELS):
        name = ", ".join(explanation["effects"]) or "parameters refitted"
        response = explanation["response"]
        curve(drawn, found.frequency, response, measured, label=name, color=colour, lw=1.2, ls=DASHED)
    label(drawn)
    drawn[0].legend(frameon=False, fontsize=9)
    return figure
