"""Axes to draw into: those that were given, or new ones."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any


def new_figure(size: tuple[float, float], what: str = "this") -> Any:
    """An empty figure of `size` inches."""
    try:
        from matplotlib.figure import Figure
    except ImportError as e:
        raise ImportError(f"{what} draws with matplotlib, which is not installed: pip install matplotlib") from e
    # The object-oriented face: no window opens, no global state changes, a notebook shows what is returned once.
    return Figure(figsize=size, layout="constrained")


def axes(
    ax: Any,
    rows: int,
    size: tuple[float, float],
    what: str,
    *,
    at_least: int | None = None,
    heights: Sequence[float] | None = None,
) -> tuple[Any, list[Any]]:
    """A figure and its axes, one below the other with a common x axis.

    Or those that were given: `at_least` to `rows` of them.
    """
    if ax is None:
        figure = new_figure(size, what)
        made = figure.subplots(rows, 1, sharex=rows > 1, squeeze=False, height_ratios=heights)[:, 0]
        for one in made:
            one.spines[["top", "right"]].set_visible(False)
        return figure, list(made)
    given = list(ax.ravel()) if hasattr(ax, "ravel") else list(ax) if isinstance(ax, Sequence) else [ax]
    least = rows if at_least is None else at_least
    if not least <= len(given) <= rows:
        wanted = f"{rows}" if least == rows else f"{least} to {rows}"
        raise ValueError(f"{what}: ax holds {len(given)} axes; {wanted} are needed")
    return given[0].get_figure(), given
