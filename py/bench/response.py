"""Frequency responses of three minutes at 1 kHz by Welch's method."""

from __future__ import annotations

from collections.abc import Iterator

import furuta
import numpy as np
from clock import Contender, Work
from scipy import signal

H, SAMPLES, SEGMENT = 1e-3, 180_000, 2000


def works(missing: list[str]) -> Iterator[Work]:
    u = np.random.default_rng(1).normal(size=SAMPLES)
    y = signal.lfilter([0.0, 1e-3], [1.0, -1.98, 0.981], u)
    recording = {"t": H * np.arange(SAMPLES), "u": u, "theta": np.zeros(SAMPLES), "alpha": y}
    settings = {"fs": 1 / H, "nperseg": SEGMENT, "detrend": "constant"}

    def theirs():
        _, uy = signal.csd(u, y, **settings)
        _, uu = signal.welch(u, **settings)
        _, yy = signal.welch(y, **settings)
        return uu, yy, uy

    uu, _, uy = theirs()
    yield Work(
        "Spectra of 180 s at 1 kHz, segments of 2 s",
        "Both densities and the cross spectrum of two arrays, Hann's window, half overlapping; the estimate H1 is "
        "compared.",
        (uy / uu)[1:-1],
        [
            Contender(
                "furuta `spectra`",
                lambda: furuta.spectra(u, y, H, SEGMENT),
                lambda s: h1(s["frequency"], s["uy"] / s["uu"]),
            ),
            Contender("SciPy `csd`, `welch`, `welch`", theirs, lambda s: (s[2] / s[0])[1:-1]),
        ],
    )
    yield Work(
        "A frequency response with coherence and deviations, from a recording",
        "The same, from a recording of four columns that is checked first.",
        (uy / uu)[1:-1],
        [
            Contender(
                "furuta `frf`",
                lambda: furuta.frf(recording, resolution=1 / (H * SEGMENT), accept_suspicious=True),
                lambda found: h1(found.frequency, found.response),
            ),
            Contender("SciPy `csd`, `welch`, `welch`", theirs, lambda s: (s[2] / s[0])[1:-1]),
        ],
        ["SciPy's is the three spectra alone, of arrays that are not checked."],
    )
    checked = furuta.Recording(recording)
    yield Work(
        "A frequency response by averaged spectra, from a `furuta.Recording`",
        "Of a recording that was checked when it was made, and has not been written to since; H1 on both sides.",
        (uy / uu)[1:-1],
        [
            Contender(
                "furuta `frf` of a `Recording`",
                lambda: furuta.frf(checked, estimator="H1", resolution=1 / (H * SEGMENT), accept_suspicious=True),
                lambda found: h1(found.frequency, found.response),
            ),
            Contender("SciPy `csd`, `welch`, `welch`", theirs, lambda s: (s[2] / s[0])[1:-1]),
        ],
        ["SciPy's is the three spectra alone, of arrays that are not checked."],
    )


def h1(frequency, response) -> np.ndarray:
    """Without the ends: furuta leaves the mean and Nyquist's frequency out."""
    kept = (frequency > 0) & (frequency < 0.5 / H * (1 - 1e-9))
    return np.asarray(response)[kept]
