"""Measured against predicted, before and after a change of the model, angle by angle."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from furuta.plot._style import AFTER, ANGLES, BEFORE, DASHED, MEASURED


class Prediction(NamedTuple):
    """Angles over time; each series but the time is [theta, alpha], NaN where nothing was predicted."""

    t: np.ndarray
    measured: list[np.ndarray]
    before: list[np.ndarray]
    after: list[np.ndarray]

    @classmethod
    def of(cls, curves: dict[str, Any], before: str, after: str) -> Prediction:
        """That of a recording, by the names of the series in its curves."""
        t = np.array(curves["t"], dtype=float)
        empty = np.full(len(t), np.nan)
        series = (
            [np.array(values, dtype=float) if values else empty for values in curves[name]]
            for name in ("measured", before, after)
        )
        return cls(t, *series)

    def part(self, part: slice) -> Prediction:
        """These samples of it."""
        return Prediction(self.t[part], *([values[part] for values in series] for series in self[1:]))

    def errors(self) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """Predicted less measured, before and after."""
        before, after = (
            [predicted - measured for predicted, measured in zip(series, self.measured)]
            for series in (self.before, self.after)
        )
        return before, after

    def worst(self) -> int:
        """The angle that is predicted worst before: 0 for theta, 1 for alpha."""
        return int(np.argmax([np.nansum(error**2) for error in self.errors()[0]]))


def draw(axes: list[Any], shown: Prediction, before: str, after: str) -> list[int]:
    """Both angles under these labels; in one pair of axes the angle that is predicted worst before.

    Returns which angle each has: 0 for theta, 1 for alpha.
    """
    channels = [shown.worst()] if len(axes) == 1 else [0, 1]
    for ax, c in zip(axes, channels):
        ax.plot(shown.t, shown.measured[c], color=MEASURED, lw=2.2, alpha=0.55, label="measured")
        ax.plot(shown.t, shown.before[c], color=BEFORE, lw=1.3, label=before)
        ax.plot(shown.t, shown.after[c], color=AFTER, lw=1.3, ls=DASHED, label=after)
        ax.set_ylabel(ANGLES[c])
    axes[0].legend(
        loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, fontsize=9, frameon=False, borderaxespad=0.1
    )
    return channels


def called(runs: dict[str, dict[str, Any]], name: str) -> dict[str, Any]:
    """The curves of the recording of this name."""
    if name not in runs:
        raise KeyError(f"no recording is called {name!r}; there are {', '.join(runs)}")
    return runs[name]
