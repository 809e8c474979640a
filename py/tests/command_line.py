"""The `furuta` program, for tests that look at it from outside. `make test` says where it is."""

from __future__ import annotations

import os
import pathlib
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]


def program() -> pathlib.Path:
    """The program; skips the test where it has not been built."""
    path = pathlib.Path(os.environ.get("FURUTA_CLI", ROOT / "target/release/furuta"))
    if not path.exists():
        pytest.skip(f"no program {path}: build it with `cargo build --release`, or set FURUTA_CLI")
    return path


def furuta(*arguments: object, timeout: float = 120) -> subprocess.CompletedProcess[str]:
    """Runs the program; its exit code is for the caller to judge."""
    return subprocess.run(
        [str(program()), *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=timeout,
        stdin=subprocess.DEVNULL,
    )
