"""What tests of several files share."""

import signal

import pytest


@pytest.fixture
def interruptible():
    """Ctrl-C raises KeyboardInterrupt, also where SIGINT was ignored when Python began, as it is in a shell's
    background jobs."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, signal.SIG_DFL if before is None else before)
