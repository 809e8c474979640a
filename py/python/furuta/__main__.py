"""`python -m furuta`: the command `furuta` where it is installed, and otherwise how it is."""

from __future__ import annotations

import os
import pathlib
import shutil
import subprocess
import sys

from furuta import __version__

HELP = f"""furuta {__version__}: this is its Python package (import furuta; help(furuta)).

The command `furuta` is a program of its own and was not found beside this Python or on the PATH. From the sources:

    cargo install --locked --path crates/furuta-cli    # into ~/.cargo/bin, which is to be on the PATH

or, without installing it:

    cargo run --release -- --help
"""


def program() -> str | None:
    """The program: where FURUTA_CLI says, beside this Python, or on the PATH."""
    said = os.environ.get("FURUTA_CLI")
    if said:
        return said
    beside = pathlib.Path(sys.executable).with_name("furuta.exe" if os.name == "nt" else "furuta")
    return str(beside) if beside.is_file() else shutil.which("furuta")


def main() -> int:
    """Runs the program with the arguments of this one."""
    found = program()
    if found is None:
        print(HELP, end="", file=sys.stderr if len(sys.argv) > 1 else sys.stdout)
        return 1 if len(sys.argv) > 1 else 0
    try:
        return subprocess.run([found, *sys.argv[1:]], check=False).returncode
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(main())
