"""A worker process: reads tasks from its standard input, writes rows to its standard output.

Each message is its length in 8 bytes, little-endian, and its pickled content. The first message is the function; the
answer to it is None, or why it cannot be loaded. What the function prints goes to standard error.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
from typing import IO

from furuta._campaign._task import run


def send(stream: IO[bytes], content: bytes) -> None:
    """Writes one message."""
    stream.write(len(content).to_bytes(8, "little"))
    stream.write(content)
    stream.flush()


def receive(stream: IO[bytes]) -> bytes | None:
    """The next message; None where the other side is gone."""
    head = stream.read(8)
    if len(head) < 8:
        return None
    length = int.from_bytes(head, "little")
    content = stream.read(length)
    return content if len(content) == length else None


def main() -> None:
    """Works until the driver closes the pipe."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the driver decides when a campaign ends
    tasks, rows = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.dup2(2, 1)
    function = receive(tasks)
    if function is None:
        return
    try:
        try:
            work = pickle.loads(function)
        except BaseException as e:
            send(rows, pickle.dumps(f"{type(e).__name__}: {e}"))
            return
        send(rows, pickle.dumps(None))
        while (content := receive(tasks)) is not None:
            found = run(work, pickle.loads(content))
            sys.stdout.flush()
            send(rows, pickle.dumps(found))
    except BrokenPipeError:  # the driver is gone
        pass
