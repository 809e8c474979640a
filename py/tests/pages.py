"""Runs the code of a documentation page, and compares what it prints with what the page says.

A block marked `python` or `sh` is run; the names of a page's Python blocks are those of one session. Where a block
marked `text` follows, it is what was printed, `...` standing for anything. `python py/tests/pages.py docs/tour.md`
runs a page, and prints what differs. What takes long stands behind the comment `<!-- long -->`. With `--pictures` it
puts the pictures that the page saves beside it, with `--write` it also writes what was printed into the page.
"""

from __future__ import annotations

import contextlib
import doctest
import io
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from typing import NamedTuple

from command_line import ROOT, program

BLOCK = re.compile(r"^```(python|sh)\n(.*?)^```\n(?:\n```text\n(.*?)^```\n)?", re.MULTILINE | re.DOTALL)
LONG = "<!-- long -->"
PICTURES = (".png", ".svg", ".gif")


class Done(NamedTuple):
    """A block that was run."""

    code: str
    expected: str
    printed: str
    span: tuple[int, int]

    def as_said(self) -> bool:
        return doctest.OutputChecker().check_output(self.expected, self.printed, doctest.ELLIPSIS)


def is_long(text: str, block: re.Match[str]) -> bool:
    """Whether the page says that a block takes long: the comment stands before it."""
    return text[: block.start()].rstrip().endswith(LONG)


def without_blanks(text: str) -> str:
    """The text without blanks at the ends of its lines."""
    return re.sub(r"[ \t]+$", "", text, flags=re.MULTILINE)


@contextlib.contextmanager
def inside(folder: pathlib.Path) -> Iterator[None]:
    before = pathlib.Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def shell(code: str, folder: pathlib.Path) -> str:
    (folder / "bin").mkdir(exist_ok=True)
    with contextlib.suppress(FileExistsError):
        (folder / "bin/furuta").symlink_to(program())
    paths = f"{folder / 'bin'}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        ["bash", "-euc", code],
        cwd=folder,
        env=os.environ | {"PATH": paths},
        stdout=subprocess.PIPE,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, code
    return done.stdout


def run(text: str, folder: pathlib.Path, *, long: bool = True) -> Iterator[Done]:
    """Runs a page's blocks, those that take long only where asked, in an empty folder to which examples is linked."""
    import matplotlib

    matplotlib.use("agg")
    (folder / "examples").symlink_to(ROOT / "examples")
    session = {"__name__": "__page__"}
    for block in BLOCK.finditer(text):
        if not long and is_long(text, block):
            continue
        language, code, expected = block.groups()
        if language == "sh":
            printed = shell(code, folder)
        else:
            with inside(folder), contextlib.redirect_stdout(io.StringIO()) as out:
                exec(compile(code, "page", "exec"), session)
            printed = out.getvalue()
        yield Done(code, expected or "", without_blanks(printed), block.span(3))


def main(options: set[str], pages: list[str]) -> int:
    wrong = 0
    for page in map(pathlib.Path, pages):
        text = page.read_text()
        with tempfile.TemporaryDirectory() as folder:
            for done in reversed(list(run(text, pathlib.Path(folder)))):
                if not done.as_said():
                    wrong += 1
                    print(f"{page}\n{done.code}prints\n{done.printed}")
                    if done.span != (-1, -1):
                        text = text[: done.span[0]] + done.printed + text[done.span[1] :]
            if "--write" in options:
                page.write_text(text)
            if options & {"--write", "--pictures"}:
                for picture in pathlib.Path(folder).iterdir():
                    if picture.suffix in PICTURES:
                        shutil.copy(picture, page.parent)
    return min(wrong, 1)


if __name__ == "__main__":
    options = {word for word in sys.argv[1:] if word.startswith("--")}
    sys.exit(main(options, [word for word in sys.argv[1:] if word not in options]))
