"""The wheel that `make test` builds, in an empty environment."""

from __future__ import annotations

import os
import pathlib
import zipfile

import pytest
from wheel import try_out


@pytest.fixture
def wheel() -> pathlib.Path:
    folder = os.environ.get("FURUTA_WHEELS")
    if folder is None:
        pytest.skip("no wheel: `make test` builds one, or set FURUTA_WHEELS to its folder")
    (found,) = pathlib.Path(folder).glob("furuta-*.whl")
    return found


def test_a_wheel_is_all_that_a_new_user_needs(wheel):
    assert "names what is hidden" in try_out(wheel)


def test_one_wheel_serves_every_python(wheel):
    assert "-cp310-abi3-" in wheel.name
    names = zipfile.ZipFile(wheel).namelist()
    assert {"furuta/py.typed", "furuta/_furuta.pyi", "furuta/_furuta.abi3.so"} <= set(names)
    (points,) = (name for name in names if name.endswith("entry_points.txt"))
    assert "furuta=furuta.__main__:main" in zipfile.ZipFile(wheel).read(points).decode().replace(" ", "")
