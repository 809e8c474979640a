"""Several ways to do the same work: do they agree, and how long does each take, in alternation.

Times are processor time of this process, all its threads: what other programs do meanwhile counts little. In each round
every contender works once; a ratio is the median of the rounds' ratios, so a slow minute of the machine falls on all.
"""

from __future__ import annotations

import dataclasses
import statistics
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

# Each contender works in each round for about this long, s: calls that are shorter are repeated.
ENOUGH = 0.03


class Disagreement(AssertionError):
    """A contender's answer is not the one expected, so its time means nothing."""


@dataclasses.dataclass(frozen=True)
class Contender:
    """One way to do the work.

    `run` does it; `answer` makes an array of what it returned, compared with the work's answer to `tolerance`. `share`
    is how much of the work one call does (rollouts 20 of 10,000: 0.002); its time is divided by it.
    """

    name: str
    run: Callable[[], Any]
    answer: Callable[[Any], Any] | None = None
    tolerance: float = 1e-9
    share: float = 1.0


@dataclasses.dataclass(frozen=True)
class Work:
    """The same work for several contenders, ours first; `answer` is what all have to find."""

    title: str
    about: str
    answer: Any
    contenders: Sequence[Contender]
    # What is said below the table.
    remarks: Sequence[str] = ()
    # How many of them the work has, where the page is to say how many a second.
    count: int | None = None


@dataclasses.dataclass(frozen=True)
class Timed:
    """Of one contender: seconds of processor time for the whole work, over our own, and what it was off by."""

    name: str
    seconds: float
    ratio: float
    error: float | None
    tolerance: float | None


def off(found: Any, answer: Any) -> float:
    """Largest difference; of as many leading rows as were found, where a share of the work was done."""
    found = np.asarray(found)
    expected = np.asarray(answer)[: len(found)] if found.ndim else np.asarray(answer)
    if found.shape != expected.shape:
        raise Disagreement(f"shape {found.shape}, expected {expected.shape}")
    difference = np.abs(found - expected)
    return float(difference.max()) if np.isfinite(difference).all() else float("inf")


def measure(work: Work, rounds: int, clock: Callable[[], float] = time.process_time) -> list[Timed]:
    """Checks that all agree, then times them in alternation."""
    errors: list[float | None] = []
    counts = []
    for contender in work.contenders:
        found = contender.run()
        error = None if contender.answer is None else off(contender.answer(found), work.answer)
        if error is not None and not error <= contender.tolerance:
            raise Disagreement(
                f"{work.title}: {contender.name} is off by {error:.2g}, allowed are {contender.tolerance:.2g}"
            )
        errors.append(error)
        begin = clock()
        contender.run()
        counts.append(max(1, round(ENOUGH / max(clock() - begin, 1e-7))))
    seconds: list[list[float]] = [[] for _ in work.contenders]
    for _ in range(rounds):
        for contender, count, kept in zip(work.contenders, counts, seconds):
            run, repeats = contender.run, range(count)
            begin = clock()
            for _ in repeats:
                run()
            kept.append((clock() - begin) / count / contender.share)
    return [
        Timed(
            contender.name,
            statistics.median(kept),
            statistics.median(one / our for one, our in zip(kept, seconds[0])),
            error,
            None if error is None else contender.tolerance,
        )
        for contender, kept, error in zip(work.contenders, seconds, errors)
    ]
