"""Functions that campaigns of the tests run: workers import them from here."""

from __future__ import annotations

import os
import pathlib
import signal
import time


def draw(case, rng):
    """A number that depends on case and seed alone, and who drew it."""
    return {"drawn": float(rng.normal()), "twice": 2 * case}


def slowly(case, rng):
    """The same, slow enough that a worker can be killed meanwhile; a line in the file `case` for each beginning."""
    with open(case, "a") as file:
        file.write(f"{os.getpid()}\n")
    time.sleep(0.02)
    return {"drawn": float(rng.normal()), "pid": os.getpid()}


def note(case):
    """Writes down that it was called: (folder, name)."""
    folder, name = case
    with open(pathlib.Path(folder) / str(name), "a") as file:
        file.write("x")
    return {"name": name}


def deadly(case):
    """Case 3 kills its worker, always."""
    if case == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return {"value": case}


def raising(case):
    if case % 5 == 2:
        raise ValueError(f"not case {case}")
    return {"value": case}


def long(case):
    """Longer than any test waits, but for the first few."""
    time.sleep(0.01 if case < 4 else 600)
    return {"value": case}
