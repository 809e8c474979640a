"""The log of a run as CSV, in the format that `furuta convert` writes: docs/log.md."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from furuta._furuta import Rig, __version__

# As furuta_log::FIELDS.
FIELDS = "t,u,theta,alpha,theta_dot,alpha_dot,reference,command,mode,seq,status,lost,delay,compute"
# Bytes of a rig's name in the protocol.
_NAME = 32


def largest_command(rig: Rig) -> float:
    """The rig's command limit, V, as the protocol holds it: in single precision, and not beyond it."""
    limit = np.float32(rig["motor.command_limit"])
    return float(limit if limit <= rig["motor.command_limit"] else np.nextafter(limit, np.float32(0)))


def metadata(
    rig: Rig, controller_file: str, words: str, io: str, started_ns: int, run_again: Mapping[str, Any] | None
) -> dict[str, str]:
    """What a log says of its run, by key.

    `run_again` holds what a replay needs beside that: task, dt, watchdog (periods); None where nothing can be replayed.
    """
    own = {"rig": rig.name, "controller": words, "software": f"furuta {__version__}", "rig_file": _lines(rig.to_toml())}
    said = {
        "controller_file": _lines(controller_file),
        "effects": ",".join(rig.effects),
        "host": f"{platform.node()}, {platform.system().lower()}, {platform.machine()}",
        "io": io,
        "started_ns": str(started_ns),
    }
    if run_again is not None:
        period_us = round(run_again["dt"] * 1e6)
        hello = {
            "version": 1,
            "rig": rig.name.encode()[:_NAME].decode(errors="ignore"),
            "period_us": period_us,
            **rig.sensors,
            "command_limit": largest_command(rig),
            "limits": rig.limits,
            "watchdog_periods": run_again["watchdog"],
        }
        said |= {
            "format": "2",
            "hello": json.dumps(hello, separators=(",", ":")),
            "period_us": str(period_us),
            "protocol": "1",
            "task": json.dumps(run_again["task"], separators=(",", ":")),
        }
    return own | dict(sorted(said.items()))


def text(said: Mapping[str, str], columns: Mapping[str, Sequence[Any]]) -> str:
    """A log: what it says of its run, and one row a sample."""
    lines = ["# furuta log 1"]
    for key, value in said.items():
        if value.endswith("\n") and "\r" not in value:
            name = "rig" if key == "rig_file" else key
            lines += [f"# {name}| {line}" for line in value[:-1].split("\n")]
        elif value and value.strip() == value and not value.startswith('"') and not {"\n", "\r"} & set(value):
            lines.append(f"# {key}: {value}")
        else:
            lines.append(f"# {key}: {json.dumps(value)}")
    lines.append(FIELDS)
    rows = zip(*(columns[name] for name in FIELDS.split(",")))
    lines += [",".join(map(_field, row)) for row in rows]
    return "\n".join(lines) + "\n"


def _lines(text: str) -> str:
    return text if text.endswith("\n") else text + "\n"


def _field(value: Any) -> str:
    if not isinstance(value, float):
        return str(value)
    if value != value:
        return ""
    shown = repr(value)
    # Without an exponent, as furuta_log writes it.
    return np.format_float_positional(value, trim="-") if "e" in shown else shown.removesuffix(".0")


def check(path: str | os.PathLike[str], force: bool) -> None:
    """Before anything moves: whether a log can be written there."""
    name = os.fspath(path)
    if name.lower().endswith(".mcap"):
        raise ValueError(
            f"log = {name!r}: a run from Python writes a CSV log; `furuta convert run.csv run.mcap` makes MCAP of it"
        )
    if os.path.isdir(name):
        raise IsADirectoryError(f"log = {name!r} is a folder: give a file in it")
    if os.path.lexists(name) and not force:
        raise FileExistsError(f"log = {name!r} exists: give another name, or force=True to replace it")
    folder = os.path.dirname(name) or "."
    if not os.access(folder, os.W_OK):
        raise FileNotFoundError(f"log = {name!r}: there is no folder {folder!r} that can be written to")
