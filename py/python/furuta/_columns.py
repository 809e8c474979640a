"""Columns of what a recording may be given as: a mapping, a DataFrame, an array."""

from __future__ import annotations

import os
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
    alpha, or fields of these names. Times and moments become seconds.
    """
    if isinstance(given, np.ndarray):
        found = _of_array(given)
    elif isinstance(given, Mapping):
        found = {str(name): given[name] for name in given}
    elif _is_frame(given):
        found = _of_frame(given)
    else:
        found = None
    return found and {name: _seconds(values) for name, values in found.items()}


def recordings(given: Any) -> dict[str, Any] | None:
    """Recordings by name, or None if `given` is no mapping of names to recordings."""
    if not isinstance(given, Mapping) or not given or any(name in given for name in REQUIRED):
        return None
    if not all(isinstance(one, (str, os.PathLike, Mapping)) or _is_frame(one) for one in given.values()):
        return None
    return {str(name): one for name, one in given.items()}


def text(values: Any) -> list[str] | None:
    """A column's values as texts, an empty one for None and NaN; or None if they are neither texts nor numbers."""
    try:
        array = np.asarray(values)
    except ValueError:  # rows of different lengths
        return None
    if np.ma.is_masked(values) or array.ndim != 1 or array.dtype.kind not in "OSU":
        return None
    found = []
    for value in array.tolist():
        if isinstance(value, bytes):
            value = value.decode(errors="replace")
        if value is None or (isinstance(value, float) and value != value):
            value = ""
        if not isinstance(value, (str, bool, int, float)):
            return None
        found.append(str(value))
    return found


def _is_frame(given: Any) -> bool:
    """Whether it is a DataFrame of pandas or polars, without importing either."""
    return hasattr(given, "columns") and hasattr(given, "to_numpy")


def _seconds(values: Any) -> Any:
    """Times as seconds, moments as seconds since the first of them; anything else as it is."""
    kind = getattr(getattr(values, "dtype", None), "kind", "")
    if kind not in ("m", "M"):
        return values
    array = np.asarray(values)
    if kind == "M":
        if array.dtype.kind != "M":
            # Moments of a time zone.
            array = np.asarray(values, dtype="datetime64[ns]")
        array = array - array[:1]
    return array / np.timedelta64(1, "s")


def _with_none(values: Any) -> Any:
    """A series of pandas with a type of pandas' own, with None for what is missing; anything else as it is."""
    if isinstance(getattr(values, "dtype", None), np.dtype) or not hasattr(values, "isna"):
        return values
    return values.astype(object).where(values.notna(), None)


def _of_frame(given: Any) -> dict[str, Any]:
    found = {str(name): given[name] for name in given.columns}
    index = getattr(given, "index", None)
    if "t" not in found and getattr(index, "name", None) == "t":
        found["t"] = index
    # Moments of a time zone are seconds before NumPy would make objects of them.
    return {name: np.asarray(_with_none(_seconds(values))) for name, values in found.items()}


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
