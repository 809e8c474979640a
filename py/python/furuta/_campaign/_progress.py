"""How far a campaign is, and Ctrl-C only where nothing is half done."""

from __future__ import annotations

import contextlib
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from types import FrameType, TracebackType
from typing import Any


class Shield:
    """Keeps Ctrl-C waiting while rows are taken in and written, as it would leave them half taken.

    It comes through in `open()` and in `check()`. Elsewhere than in the main thread there is no Ctrl-C.
    """

    def __init__(self) -> None:
        self.before: Any = None
        self.missed: tuple[int, FrameType | None] | None = None
        self.is_open = False

    def __enter__(self) -> Shield:
        if threading.current_thread() is threading.main_thread():
            before = signal.getsignal(signal.SIGINT)
            if callable(before):
                self.before = before
                signal.signal(signal.SIGINT, self._heard)
        return self

    def __exit__(self, kind: type[BaseException] | None, e: BaseException | None, at: TracebackType | None) -> None:
        if self.before is not None:
            signal.signal(signal.SIGINT, self.before)
        if e is None:
            self.check()

    def _heard(self, number: int, frame: FrameType | None) -> None:
        if self.is_open:
            self.before(number, frame)
        else:
            self.missed = (number, frame)

    def check(self) -> None:
        """Lets a Ctrl-C through that came meanwhile."""
        if self.missed is not None:
            missed, self.missed = self.missed, None
            self.before(*missed)

    @contextlib.contextmanager
    def open(self, really: bool = True) -> Iterator[None]:
        """Within it, Ctrl-C comes at once."""
        self.is_open = really
        try:
            if really:
                self.check()
            yield
        finally:
            self.is_open = False


@contextlib.contextmanager
def teller(progress: bool | Callable[[int, int], object] | None, of: int) -> Iterator[Callable[[int], None]]:
    """What to call with how many rows are there."""
    if progress is True:
        bar = _Bar(of)
        try:
            yield bar.tell
        finally:
            bar.end()
    elif callable(progress):
        yield lambda done: (progress(done, of), None)[1]
    else:
        yield lambda done: None


class _Bar:
    """A line on standard error: drawn over itself on a terminal, else a new one every ten seconds."""

    def __init__(self, of: int) -> None:
        self.of, self.begin, self.done = of, time.monotonic(), 0
        self.first: int | None = None
        self.terminal = sys.stderr.isatty()
        self.drawn = -1e9

    def tell(self, done: int) -> None:
        self.first = done if self.first is None else self.first
        self.done = done
        if time.monotonic() - self.drawn > (0.1 if self.terminal else 10.0):
            self.draw()

    def draw(self) -> None:
        now = time.monotonic()
        new, seconds = self.done - (self.first or 0), max(now - self.begin, 1e-9)
        left = (self.of - self.done) * seconds / new if new else None
        share = self.done / self.of if self.of else 1.0
        bar = "#" * int(30 * share)
        rest = "" if left is None else f", {new / seconds:.3g}/s, {left:.0f} s left"
        line = f"{bar:30} {self.done}/{self.of}{rest}"
        sys.stderr.write(f"\r{line:78}" if self.terminal else f"{line}\n")
        sys.stderr.flush()
        self.drawn = now

    def end(self) -> None:
        self.draw()
        if self.terminal:
            sys.stderr.write("\n")
