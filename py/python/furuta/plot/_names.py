"""What a legend calls recordings and trajectories."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any


def names(runs: Sequence[Any]) -> list[str]:
    """The names of runs, "run" for what has none; equal ones are numbered."""
    given = [name if isinstance(name := getattr(run, "name", None), str) else "run" for run in runs]
    total, seen = Counter(given), Counter[str]()
    found = []
    for name in given:
        seen[name] += 1
        found.append(f"{name} ({seen[name]})" if total[name] > 1 else name)
    return found
