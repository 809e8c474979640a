"""Rows and their columns: what a worker may give, and of which type each column is."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

OWN = {"case": "int", "input": "json", "error": "text", "traceback": "text", "seconds": "float"}
"""The columns that every campaign has; a function cannot give them."""
SCALARS = ("bool", "int", "float", "text")
LARGEST = 2**63 - 1


def row_of(given: Any) -> dict[str, Any]:
    """What a function gave, as a row of plain Python values; `TypeError` where it cannot be one."""
    given = {} if given is None else given
    if not isinstance(given, Mapping):
        given = {"value": given}
    row = {}
    for name, value in given.items():
        if not isinstance(name, str) or name in OWN:
            raise TypeError(f"a row cannot have the column {name!r}: take another name")
        row[name] = _plain(value, name)
    return row


def _plain(value: Any, column: str) -> Any:
    if isinstance(value, (np.ndarray, np.generic)):
        value = value.tolist()
    if value is None or isinstance(value, (bool, float, str)):
        return value
    if isinstance(value, int):
        if abs(value) > LARGEST:
            raise TypeError(f"column {column!r}: {value} needs more than 64 bits: give a float or text")
        return value
    if isinstance(value, (list, tuple)):
        return [_plain(part, column) for part in value]
    if isinstance(value, Mapping):
        return {str(key): _plain(part, column) for key, part in value.items()}
    raise TypeError(
        f"column {column!r} holds a {type(value).__qualname__}; "
        "a row holds None, numbers, text, and lists, arrays and dicts of these"
    )


def kind_of(value: Any) -> str:
    """The type of a plain value: null, bool, int, float, text, `list of` one of these, or json."""
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "bool"
    if isinstance(value, int):
        return "int"
    if isinstance(value, float):
        return "float"
    if isinstance(value, str):
        return "text"
    if isinstance(value, list):
        kind = "null"
        for part in value:
            of = kind_of(part)
            together = wider(kind, of) if of in ("null", *SCALARS) else None
            if together is None:
                return "json"
            kind = together
        return f"list of {kind}"
    return "json"


def wider(a: str, b: str) -> str | None:
    """The type that holds values of both; None if none does."""
    if a == b or b == "null":
        return a
    if a == "null":
        return b
    if {a, b} == {"int", "float"}:
        return "float"
    if a.startswith("list of ") and b.startswith("list of "):
        of = wider(a.removeprefix("list of "), b.removeprefix("list of "))
        return None if of is None else f"list of {of}"
    return None


def stored(value: Any, kind: str) -> Any:
    """A plain value as it goes into a column of this type."""
    if kind == "json":
        return None if value is None else json.dumps(_finite(value), ensure_ascii=False)
    if value is not None and kind == "float":
        return float(value)
    if value is not None and kind == "list of float":
        return [None if part is None else float(part) for part in value]
    return value


def _finite(value: Any) -> Any:
    """With null for what JSON has no number for."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, list):
        return [_finite(part) for part in value]
    if isinstance(value, dict):
        return {name: _finite(part) for name, part in value.items()}
    return value


class Columns:
    """The type of each column, as the rows so far have shown it, or as given from the start.

    A column whose rows were all empty takes the type of the first value; whole numbers become floats with the first
    float. `changes` counts how often a type has changed.
    """

    def __init__(self, kinds: Mapping[str, str] = {}, fixed: bool = False) -> None:
        self.kinds = dict(OWN) | dict(kinds)
        self.fixed = fixed
        self.first: dict[str, int] = {}
        self.changes = 0

    def take(self, case: int, row: Mapping[str, Any]) -> str | None:
        """Takes up the types of a case's row; what does not fit, if anything, and then nothing is taken up."""
        found = {}
        for name, value in row.items():
            before, now = self.kinds.get(name), kind_of(value)
            if before == "json":
                continue
            if before is None and self.fixed:
                return f"the schema has no column {name!r}"
            together = now if before is None else wider(before, now)
            if together is None or (self.fixed and together != before):
                first = self.first.get(name)
                shown = "in the rows before" if first is None else f"in case {first}"
                whence = "by the schema" if self.fixed else shown
                return f"column {name!r} is {now} here and {before} {whence}: a column has one type"
            found[name] = together
        for name, kind in found.items():
            if self.kinds.get(name) != kind:
                self.changes += 1
                self.kinds[name] = kind
            if kind != "null":
                self.first.setdefault(name, case)
        return None
