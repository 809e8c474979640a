"""What a user and an editor see: examples that run, types that are true."""

from __future__ import annotations

import doctest
import operator
import subprocess
import sys

import furuta
import pytest
from command_line import ROOT


PUBLIC = [
    *furuta.__all__,
    *(f"papers.{name}" for name in furuta.papers.__all__),
    *(f"plot.{name}" for name in furuta.plot.__all__),
]


def public(name):
    return operator.attrgetter(name)(furuta)


@pytest.mark.parametrize("name", ["furuta", *PUBLIC])
def test_examples(name, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)  # for the files that examples write
    thing = furuta if name == "furuta" else public(name)
    # examples of a class are those of its methods, too
    found = doctest.DocTestFinder(exclude_empty=True).find(thing, name, globs={})
    runner = doctest.DocTestRunner()
    for examples in found:
        runner.run(examples)
    assert runner.summarize(verbose=False).failed == 0


@pytest.mark.parametrize("name", [n for n in PUBLIC if n != "__version__"])
def test_everything_is_documented(name):
    text = public(name).__doc__
    assert text and len(text.splitlines()[0]) > 10
    if callable(thing := public(name)) and not isinstance(thing, type):
        assert "Returns" in text and ">>> " in text


def test_the_page_about_the_package_is_true():
    found = doctest.testfile(str(ROOT / "docs/python.md"), module_relative=False)
    assert found.attempted > 10 and found.failed == 0


def test_types_are_right():
    """pyright, which editors use, where it is installed."""
    pytest.importorskip("pyright")
    done = subprocess.run(
        [sys.executable, "-m", "pyright", "--pythonpath", sys.executable], capture_output=True, text=True, cwd=ROOT
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_stubs_are_true():
    done = subprocess.run(
        [sys.executable, "-m", "mypy.stubtest", "furuta", "--concise"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
