"""A frequency response in one or two axes: magnitude in dB, phase in degrees, over a logarithmic frequency."""

from __future__ import annotations

from typing import Any

import numpy as np


def curve(
    drawn: list[Any], frequency: Any, response: Any, near: float | None = None, *, label: str, **style: Any
) -> float:
    """Draws a response into one or two axes, magnitude first.

    Whole turns are added to the phase so that in the middle it is as close as it comes to `near`, degrees; the phase
    there is returned, for the curves that follow.
    """
    drawn[0].semilogx(frequency, 20 * np.log10(np.abs(response)), label=label, **style)
    phase = np.degrees(np.unwrap(np.angle(response)))
    middle = len(phase) // 2
    if near is not None:
        phase += 360 * np.round((near - phase[middle]) / 360)
    if len(drawn) > 1:
        drawn[1].semilogx(frequency, phase, **style)
    return float(phase[middle])


def label(drawn: list[Any]) -> None:
    """Names the axes: magnitude, phase and, below the last of them, the frequency."""
    for one, name in zip(drawn, ("magnitude [dB]", "phase [deg]", "coherence")):
        one.set_ylabel(name)
    drawn[-1].set_xlabel("frequency [Hz]")


def grid(drawn: list[Any]) -> None:
    """Lines for the decades and between them."""
    for one in drawn:
        one.grid(True, which="both", color="#e4e4e4", lw=0.6)
