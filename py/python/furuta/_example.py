"""`example`: recordings of a real rig that the package carries."""

from __future__ import annotations

import io
from dataclasses import dataclass

import numpy as np

from furuta._furuta import Rig, _example
from furuta.recording import Recording


@dataclass(frozen=True)
class Example:
    """A real rig: what its maker says of it, and what was recorded.

    Attributes
    ----------
    rig : Rig
        The data sheet's values.
    runs : dict of str to Recording
        By name.
    about : str
        What was recorded, by whom, where it comes from.
    licence : str
        Under which the recordings may be passed on.
    """

    rig: Rig
    runs: dict[str, Recording]
    about: str
    licence: str


def example(name: str = "qube-servo-2") -> Example:
    """A real rig to try things on: its data sheet and its recordings, which the package carries.

    Parameters
    ----------
    name : {"qube-servo-2"}, optional
        A Quanser QUBE-Servo 2 (TU Darmstadt and Honda Research Institute Europe; BSD-3-Clause): four chirps of 10 s,
        two swing-ups of 5 s, at 250 Hz.

    Returns
    -------
    Example
        `rig`, `runs` (by name), `about`, `licence`.

    Raises
    ------
    RecordingError
        There is no such example.

    Examples
    --------
    >>> import furuta
    >>> qube = furuta.example("qube-servo-2")
    >>> sorted(qube.runs)
    ['chirp-minus-1', 'chirp-minus-5', 'chirp-plus-1', 'chirp-plus-5', 'swing-up-1', 'swing-up-2']
    >>> qube.runs["chirp-plus-1"]
    <furuta.Recording 'chirp-plus-1.csv': 2500 samples, 9.996 s at 250 Hz; t, u, theta, alpha>
    """
    files = dict(_example(name))
    runs = {}
    for file, text in files.items():
        if file.endswith(".csv"):
            header, _, rows = text.partition("\n")
            columns = np.loadtxt(io.StringIO(rows), delimiter=",").T
            runs[file.removesuffix(".csv")] = Recording(dict(zip(header.strip().split(","), columns)), name=file)
    return Example(Rig.from_toml(files["rig.toml"]), runs, files["README.md"], files["LICENSE.txt"])
