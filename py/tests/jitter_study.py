"""How far samples scatter about their time stamps, by what both angles have in common: the statistic of
``crates/furuta-ident/src/diagnose/jitter.rs``, computed apart from it.

    python py/tests/jitter_study.py RECORDING.csv...

prints for each recording the spread (ms, negative where the angles' remainders go against each other) and its standard
deviations from none, as recorded and with a jitter of a tenth of a sample added.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

SPAN, ORDER = 13, 6
PLACE = (np.arange(SPAN) - 6) / 6
BASIS = np.vander(PLACE, ORDER, increasing=True)
FIT = np.linalg.pinv(BASIS)
LEFT = np.eye(SPAN) - BASIS @ FIT
SPEED = np.column_stack([j * PLACE ** max(j - 1, 0) for j in range(ORDER)]) @ FIT / 6


def spread(angles: np.ndarray, h: float, counts: np.ndarray) -> tuple[float, float]:
    """Spread (s) and standard deviations from none; NaN where too little moves. ``angles`` is (2, n)."""
    stretches = angles[:, : angles.shape[1] // SPAN * SPAN].reshape(2, -1, SPAN)
    moves = np.abs(np.diff(stretches, axis=2)).sum(2) >= SPAN * counts[:, None]
    stretches = stretches[:, moves.all(0)]
    if stretches.shape[1] < 20:
        return np.nan, np.nan
    theta, alpha = stretches @ LEFT.T
    w, v = stretches @ SPEED.T / h
    common, unit = (theta * alpha).sum(1), (np.diag(LEFT) * w * v).sum(1)
    square = (common * unit).sum() / (unit**2).sum()
    deviations = (common * unit).sum() / np.sqrt(((common * unit) ** 2).sum())
    return float(np.sign(square) * np.sqrt(abs(square))), float(deviations)


def main(paths: list[str]) -> None:
    rng = np.random.default_rng(1)
    for path in paths:
        lines = [line for line in Path(path).read_text().splitlines() if not line.startswith("#")]
        names = lines[0].split(",")
        rows = np.array([[float(x or "nan") for x in line.split(",")[: len(names)]] for line in lines[1:]])
        t, theta, alpha = (rows[:, names.index(name)] for name in ("t", "theta", "alpha"))
        angles, h = np.stack([theta, np.unwrap(alpha)]), float(np.median(np.diff(t)))
        counts = np.array([np.diff(np.unique(a)).min() if np.ptp(a) else 1.0 for a in angles])
        smooth = np.stack([np.convolve(np.gradient(a, h), np.ones(7) / 7, "same") for a in angles])
        late = 0.1 * h * rng.standard_normal(len(t))
        jittered = np.round((angles + late * smooth) / counts[:, None]) * counts[:, None]
        said = [f"{1e3 * s:+.2f} ms ({z:+.1f})" for s, z in (spread(a, h, counts) for a in (angles, jittered))]
        print(f"{Path(path).name:24s} {said[0]}, with {0.1e3 * h:.2f} ms added {said[1]}")


if __name__ == "__main__":
    main(sys.argv[1:])
