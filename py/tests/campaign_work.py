"""Functions that campaigns of the tests run: workers import them from here."""

from __future__ import annotations

import os
import pathlib
import signal
import threading
import time

VICTIM = "begun-70"


def draw(case, rng):
    """A number that depends on case and seed alone, and who drew it."""
    return {"drawn": float(rng.normal()), "twice": 2 * case}


def slowly(case, rng):
    """The same, and who drew it. Each beginning is a line in the file `case`; the first of VICTIM lasts too long."""
    with open(case, "a") as file:
        file.write(f"{os.getpid()}\n")
    waits = case.endswith(VICTIM) and len(pathlib.Path(case).read_text().split()) == 1
    time.sleep(600 if waits else 0.02)
    return {"drawn": float(rng.normal()), "pid": os.getpid()}


class Killer(threading.Thread):
    """Kills the worker that has begun VICTIM, from outside, amid the case."""

    def __init__(self, folder: pathlib.Path, count: int):
        super().__init__(daemon=True)
        self.marks = [str(folder / f"begun-{case}") for case in range(count)]
        self.victim, self.killed = folder / VICTIM, 0
        self.start()

    def run(self):
        while not (self.victim.exists() and (pid := self.victim.read_text().strip())):
            time.sleep(0.01)
        time.sleep(0.05)
        self.killed = int(pid)
        os.kill(self.killed, signal.SIGKILL)

    def judge(self, table):
        """Each case is there once, by its last beginning; only the cases of the dead worker were begun twice."""
        begun = [pathlib.Path(mark).read_text().split() for mark in self.marks]
        assert self.killed and table["error"].null_count == len(begun)
        assert table["case"].to_pylist() == list(range(len(begun)))
        assert table["pid"].to_pylist() == [int(of[-1]) for of in begun]
        again = [pids for pids in begun if len(pids) > 1]
        assert again and all(len(pids) == 2 and int(pids[0]) == self.killed for pids in again)


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
