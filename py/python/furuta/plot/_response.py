"""A frequency response in one or two axes: magnitude in dB, phase in degrees, over a logarithmic frequency."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np


class Drawn(NamedTuple):
    """A curve as it was drawn: Hz, absolute, degrees."""

    frequency: Any
    magnitude: Any
    phase: Any

    def whole_turns(self, other: Drawn) -> float:
        """The whole turns, degrees, that bring another curve close to this one where this one is largest.

        A small response may be noise, whose phase says nothing.
        """
        common = (self.frequency >= np.min(other.frequency)) & (self.frequency <= np.max(other.frequency))
        known = np.where(np.isfinite(self.magnitude) & (common | ~common.any()), self.magnitude, -1.0)
        largest = int(np.argmax(known))
        there = np.interp(self.frequency[largest], other.frequency, other.phase)
        apart = self.phase[largest] - there
        return float(360 * np.round(apart / 360)) if np.isfinite(apart) else 0.0


def curve(
    drawn: list[Any], frequency: Any, response: Any, near: Drawn | None = None, *, label: str, **style: Any
) -> Drawn:
    """Draws a response into one or two axes, magnitude first.

    Whole turns are added to the phase so that it is as close as it comes to that of the curve `near`; the curve is
    returned, for those that follow.
    """
    magnitude = np.abs(response)
    drawn[0].semilogx(frequency, 20 * np.log10(magnitude), label=label, **style)
    found = Drawn(np.asarray(frequency), magnitude, np.degrees(np.unwrap(np.angle(response))))
    if near is not None:
        found = found._replace(phase=found.phase + near.whole_turns(found))
    if len(drawn) > 1:
        drawn[1].semilogx(frequency, found.phase, **style)
    return found


def label(drawn: list[Any]) -> None:
    """Names the axes: magnitude, phase and, below the last of them, the frequency."""
    for one, name in zip(drawn, ("magnitude [dB]", "phase [deg]", "coherence")):
        one.set_ylabel(name)
    drawn[-1].set_xlabel("frequency [Hz]")


def grid(drawn: list[Any]) -> None:
    """Lines for the decades and between them."""
    for one in drawn:
        one.grid(True, which="both", color="#e4e4e4", lw=0.6)
