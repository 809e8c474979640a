"""The recordings beside the project in which an effect is hidden, scored by the script that comes with them."""

from __future__ import annotations

import pathlib
import re
import subprocess
import sys

import pytest
from command_line import program

SHARED = pathlib.Path(__file__).resolve().parents[3] / "shared/blind"

# Of 29 cases, the effects built so far occur in 13; two are clean, one is outside the catalogue.
LEAST_EXACT = 12


@pytest.mark.skipif(not (SHARED / "score.py").exists(), reason="no ../shared/blind beside the project")
def test_score():
    command = [sys.executable, str(SHARED / "score.py"), "--cli", str(program()), "--jobs", "2", "--limit", "600"]
    printed = subprocess.run(command, capture_output=True, text=True, timeout=3000).stdout
    print(printed)
    assert "clean 2/2" in printed
    assert "outside the catalogue 1/1" in printed
    exact = int(re.search(r"^(\d+) passed, \d+ failed$", printed, re.MULTILINE).group(1))
    assert exact >= LEAST_EXACT
