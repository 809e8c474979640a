"""Columns of what a recording may be given as: a mapping, a DataFrame, an array."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

REQUIRED = ("t", "u", "theta", "alpha")


def column(columns: Mapping[str, Any], name: str, of: str) -> Any:
    """A column by its name; an unknown name is a KeyError that says which there are."""
    try:
        return columns[name]
    except KeyError:
        raise KeyError(f"{name}: {of} has the columns {', '.join(columns)}") from None


def columns(given: Any) -> dict[str, Any] | None:
    """Columns by name, or None if `given` is none of these.

    A DataFrame may have the time as its index, called "t". An array has one row a sample and the columns t, u, theta,
    alpha, or fields of these names.
    """
    if isinstance(given, np.ndarray):
        return _of_array(given)
    if isinstance(given, Mapping):
        return {str(name): given[name] for name in given}
    # pandas and polars, without importing either.
    if hasattr(given, "columns") and hasattr(given, "to_numpy"):
        found = {str(name): np.asarray(given[name]) for name in given.columns}
        index = getattr(given, "index", None)
        if "t" not in found and getattr(index, "name", None) == "t":
            found["t"] = np.asarray(index)
        return found
    return None


def _of_array(given: np.ndarray[Any, Any]) -> dict[str, Any] | None:
    if given.dtype.names:
        return {name: given[name] for name in given.dtype.names}
    if given.ndim != 2 or given.dtype.kind not in "biuf":
        return None
    if given.shape[1] != len(REQUIRED):
        raise ValueError(
            f"an array as a recording has shape {given.shape}; it must be (n, 4), with the columns t, u, theta, alpha"
        )
    return dict(zip(REQUIRED, given.T))
