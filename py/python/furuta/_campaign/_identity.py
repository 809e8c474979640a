"""What makes two campaigns the same: digests of the function and of each case, alike in every process."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import inspect
import json
import math
import os
import pathlib
import pickle
import types
from collections.abc import Callable, Mapping, Sequence, Set
from typing import Any

import numpy as np

from furuta._campaign._error import CampaignError
from furuta._furuta import Controller, Rig

# Entries of a case of a built-in kind that may be the path of a file: the file's content counts, not where it lies.
FILES = {"rig", "recordings", "verify", "controller"}


_read: dict[tuple[str, int, int], str] = {}
"""Digests of files by path, time of change and size: each is read once as long as it stays as it is."""


def digest(thing: Any) -> str:
    """16 hexadecimal digits."""
    return hashlib.sha256(json.dumps(thing, sort_keys=True).encode()).hexdigest()[:16]


def _bytes(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:16]


def plain(thing: Any, files: bool = False) -> Any:
    """The thing as JSON can hold it, large parts by their digests.

    Parameters
    ----------
    thing
        Numbers, text, arrays, rigs, controllers, dataclasses, and mappings and sequences of these; of anything else
        the pickled bytes count.
    files : bool
        A path to a file stands for what is in the file.
    """
    if thing is None or isinstance(thing, (bool, str)):
        return _file(thing) if files and isinstance(thing, str) and os.path.isfile(thing) else thing
    if isinstance(thing, (int, np.integer)):
        return int(thing)
    if isinstance(thing, (float, np.floating)):
        return float(thing) if math.isfinite(thing) else {"float": repr(float(thing))}
    if isinstance(thing, os.PathLike):
        path = os.fspath(thing)
        return _file(path) if files and os.path.isfile(path) else {"path": os.fsdecode(path)}
    if isinstance(thing, np.ndarray) and thing.dtype != object:
        content = np.ascontiguousarray(thing).tobytes()
        return {"array": [str(thing.dtype), list(thing.shape), _bytes(content)]}
    if isinstance(thing, Rig):
        return {"rig": thing.name, "digest": _bytes(thing.to_toml().encode())}
    if isinstance(thing, Controller):
        return {"controller": thing.kind, "digest": _bytes(pickle.dumps(thing, 4))}
    if dataclasses.is_dataclass(thing) and not isinstance(thing, type):
        fields = {field.name: plain(getattr(thing, field.name), files) for field in dataclasses.fields(thing)}
        return {type(thing).__qualname__: fields}
    if isinstance(thing, Mapping):
        return {key if isinstance(key, str) else repr(key): plain(value, files) for key, value in thing.items()}
    if isinstance(thing, (Sequence, np.ndarray)) and not isinstance(thing, (bytes, bytearray)):
        return [plain(part, files) for part in thing]
    if isinstance(thing, Set):
        return {"set": sorted((plain(part, files) for part in thing), key=repr)}
    if isinstance(thing, types.ModuleType):
        return {"module": thing.__name__}
    if callable(thing):
        return function(thing)
    try:
        return {type(thing).__qualname__: _bytes(_pickled(thing))}
    except Exception as e:
        raise CampaignError(f"a {type(thing).__qualname__} cannot go to a worker, for it cannot be pickled: {e}") from e


def _pickled(thing: Any) -> bytes:
    try:
        return pickle.dumps(thing, 4)
    except Exception:
        import cloudpickle  # type: ignore

        return cloudpickle.dumps(thing)


def _file(path: str | bytes) -> dict[str, Any]:
    name, about = os.fsdecode(path), os.stat(path)
    as_it_is = (os.path.abspath(name), about.st_mtime_ns, about.st_size)
    if as_it_is not in _read:
        _read[as_it_is] = _bytes(pathlib.Path(name).read_bytes())
    return {"file": os.path.basename(name), "digest": _read[as_it_is]}


def case(thing: Any, kind: str | None) -> Any:
    """A case as JSON; in one of a built-in kind a path stands for the file's content."""
    if kind is None or not isinstance(thing, Mapping):
        return plain(thing)
    return {name: plain(value, files=name in FILES) for name, value in thing.items()}


def function(work: Callable[..., Any]) -> Any:
    """What a function is known by: its name, its source, and what it holds (defaults, enclosed variables).

    Other functions that it calls are not looked at.
    """
    if isinstance(work, functools.partial):
        return {"partial": function(work.func), "args": plain(work.args), "keywords": plain(work.keywords)}
    if isinstance(work, types.MethodType):
        return {"method": function(work.__func__), "of": plain(work.__self__)}
    name = getattr(work, "__qualname__", type(work).__qualname__)
    source: Any = None
    try:
        source = inspect.getsource(work if hasattr(work, "__code__") or isinstance(work, type) else type(work))
    except (OSError, TypeError):
        code = getattr(work, "__code__", None)
        source = None if code is None else _code(code)
    held = None
    if isinstance(work, types.FunctionType):
        # A function that calls itself encloses itself.
        enclosed = dict(zip(work.__code__.co_freevars, work.__closure__ or ()))
        cells = {
            name: cell.cell_contents
            for name, cell in enclosed.items()
            if name != work.__name__ and cell != types.CellType()
        }
        held = plain([work.__defaults__, work.__kwdefaults__, cells])
    elif not isinstance(work, (type, types.BuiltinFunctionType)):
        held = plain(getattr(work, "__dict__", None))
    return {"name": name, "source": None if source is None else digest(source), "holds": held}


def _code(code: types.CodeType) -> list[Any]:
    """The code of a function without source, constants included."""
    parts = [_code(part) if isinstance(part, types.CodeType) else repr(part) for part in code.co_consts]
    return [code.co_code.hex(), list(code.co_names), parts]
