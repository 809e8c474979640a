"""The command `furuta`, also as `python -m furuta`."""

from __future__ import annotations

import signal
import sys

from furuta._furuta import _main


def main() -> int:
    """Runs the command with the arguments of this process."""
    # The command answers Ctrl-C itself; where a shell has this process ignore it, it stays so.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _main(["furuta", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
