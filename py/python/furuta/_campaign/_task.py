"""What a worker does: cases in, rows out. It never writes a file of the campaign."""

from __future__ import annotations

import inspect
import pickle
import time
import traceback
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from furuta._campaign._rows import row_of


class Task:
    """Some cases of a campaign, on their way to a worker."""

    def __init__(self, cases: Sequence[int], given: Sequence[Any], seed: int) -> None:
        self.cases, self.given, self.seed = list(cases), list(given), seed

    def __len__(self) -> int:
        return len(self.cases)


def generator(seed: int, case: int) -> np.random.Generator:
    """The generator of a case: that of child number `case` of `numpy.random.SeedSequence(seed).spawn(...)`."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(case,)))


def wants_generator(work: Callable[..., Any]) -> bool:
    """Whether a function has a parameter `rng`."""
    try:
        return "rng" in inspect.signature(work).parameters
    except (TypeError, ValueError):
        return False


def run(work: Callable[..., Any], task: Task) -> list[dict[str, Any]]:
    """The rows of the task's cases, in their order; one that raised has its error."""
    together = getattr(work, "together", None)
    if together is not None:
        return together(task, single)
    return [single(work, case, given, task.seed) for case, given in zip(task.cases, task.given)]


def single(work: Callable[..., Any], case: int, given: Any, seed: int) -> dict[str, Any]:
    """The row of one case."""
    begin = time.perf_counter()
    failed: dict[str, Any] = {"error": None, "traceback": None}
    try:
        found = work(given, rng=generator(seed, case)) if wants_generator(work) else work(given)
        row = row_of(found)
    except KeyboardInterrupt:
        raise
    except BaseException as e:  # a panic of an extension is no Exception
        row, failed = {}, failure(e)
    return {"case": case, **failed, "seconds": time.perf_counter() - begin, **row}


def failure(e: BaseException) -> dict[str, str]:
    """The error of a row."""
    text = "".join(traceback.format_exception(type(e), e, e.__traceback__))
    return {"error": f"{type(e).__name__}: {e}", "traceback": text}


def load_and_run(work: bytes, task: Task) -> list[dict[str, Any]] | str:
    """`run` with a pickled function, as clusters call it; text says why the function cannot be loaded."""
    try:
        loaded = pickle.loads(work)  # cloudpickle wrote it
    except Exception as e:
        return f"{type(e).__name__}: {e}"
    return run(loaded, task)
