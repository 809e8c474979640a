"""What a new user does with a wheel or an sdist: installs it into an empty environment and tries it.

python py/tests/wheel.py dist/furuta-*.whl dist/furuta-*.tar.gz
"""

from __future__ import annotations

import argparse
import doctest
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import venv
import zipfile

TOUR = pathlib.Path(__file__).resolve().parents[2] / "docs/tour.md"

# In the empty environment: the package, its command, a diagnosis, and what a wheel has to carry for editors.
TRIED = """
import pathlib, subprocess, sys
import numpy as np
import furuta

assert pathlib.Path(furuta.__file__).is_relative_to(sys.prefix), furuta.__file__
assert pathlib.Path(furuta.__file__).with_name("py.typed").exists()
sheet, dt = furuta.Rig.load("qube-servo-2"), 0.002
u = furuta.signal("multisine", 4, dt, amplitude=1.2)
hidden = sheet.with_effect("arm.spring", stiffness=2e-3, rest=0.2)
_, y = furuta.simulate(hidden, [0, np.pi, 0, 0], u[:-1], dt, encoders=True)
recording = {"t": dt * np.arange(len(u)), "u": u, "theta": y[:, 0], "alpha": y[:, 1]}
found = furuta.diagnose(recording, sheet, time_limit=None)
assert [effect["id"] for effect in found.effects] == ["arm.spring"], found
command = pathlib.Path(sys.executable).with_name("furuta")
said = subprocess.run([command, "--version"], capture_output=True, text=True, check=True).stdout
assert said == f"furuta {furuta.__version__}\\n", said
rigs = subprocess.run([command, "rigs"], capture_output=True, text=True, check=True).stdout
assert "qube-servo-2" in rigs
print(f"furuta {furuta.__version__}: names what is hidden, and brings its command")
"""


def check_contents(wheel: pathlib.Path) -> None:
    """One wheel serves every Python from 3.10 on, and has the types and the command."""
    assert "-cp310-abi3-" in wheel.name, wheel.name
    held = zipfile.ZipFile(wheel)
    missing = {"furuta/py.typed", "furuta/_furuta.pyi", "furuta/_furuta.abi3.so"} - set(held.namelist())
    assert not missing, missing
    (points,) = (name for name in held.namelist() if name.endswith("entry_points.txt"))
    assert "furuta=furuta.__main__:main" in held.read(points).decode().replace(" ", "")


def try_out(package: pathlib.Path) -> str:
    """Installs the package into an empty environment, tries it there, and copies the tour's first block.

    Returns what was printed. Raises ``subprocess.CalledProcessError`` where something fails.
    """
    with tempfile.TemporaryDirectory() as folder:
        venv.create(folder, with_pip=True)
        python = pathlib.Path(folder) / "bin" / "python"
        # Nothing of this environment, and no folder of the sources.
        clean = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
        install = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        subprocess.run([*install, f"furuta[plot] @ {package.resolve().as_uri()}"], check=True, env=clean, cwd=folder)

        def run(code: str) -> str:
            call = [python, "-c", code]
            return subprocess.run(call, check=True, env=clean, cwd=folder, stdout=subprocess.PIPE, text=True).stdout

        said = run(TRIED)
        block = re.search(r"^```python\n(.*?)^```\n\n```text\n(.*?)^```", TOUR.read_text(), re.MULTILINE | re.DOTALL)
        assert block, f"{TOUR} has no block of Python with what it prints"
        printed = run(block[1])
        assert doctest.OutputChecker().check_output(block[2], printed, doctest.ELLIPSIS), printed
        pictures = [path.name for path in pathlib.Path(folder).glob("*.png") if path.stat().st_size > 10_000]
        assert pictures, "the tour's first block drew nothing"
    return f"{said.strip()}; the tour's first block: {printed.strip()}, {', '.join(pictures)}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("packages", nargs="+", type=pathlib.Path)
    for package in parser.parse_args().packages:
        if package.suffix == ".whl":
            check_contents(package)
        print(f"{package.name}: {try_out(package)}")


if __name__ == "__main__":
    sys.exit(main())
