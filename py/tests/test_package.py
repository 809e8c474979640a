"""What a user and an editor see: examples that run, types that are true."""

from __future__ import annotations

import doctest
import subprocess
import sys

import furuta
import pytest


@pytest.mark.parametrize("name", ["furuta", *furuta.__all__])
def test_examples(name):
    thing = furuta if name == "furuta" else getattr(furuta, name)
    # examples of a class are those of its methods, too
    found = doctest.DocTestFinder(exclude_empty=True).find(thing, name, globs={})
    runner = doctest.DocTestRunner()
    for examples in found:
        runner.run(examples)
    assert runner.summarize(verbose=False).failed == 0


@pytest.mark.parametrize("name", [n for n in furuta.__all__ if n != "__version__"])
def test_everything_is_documented(name):
    text = getattr(furuta, name).__doc__
    assert text and len(text.splitlines()[0]) > 10
    if callable(thing := getattr(furuta, name)) and not isinstance(thing, type):
        assert "Returns" in text and ">>> " in text


def test_stubs_are_true():
    done = subprocess.run([sys.executable, "-m", "mypy.stubtest", "furuta", "--concise"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
