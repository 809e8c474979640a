"""When a run's samples are taken, and how late each of them is.

`Ours` sleeps from one sample to the next on the monotonic clock; `Theirs` counts the samples of an object that waits
for them itself. Both have the methods `wait(k)` and `sample(k, arrived)`.
"""

from __future__ import annotations

import time

# Not time.monotonic: on Windows it went in steps of 15 ms before Python 3.13. This one is as monotonic.
now = time.perf_counter

# A sleep ends this much before its end, s, and the rest is waited for awake: a system may wake a program late.
_AWAKE = 1e-3
# Half of what the promptest sample is looked for in, s.
_HALF_WINDOW = 0.02
# An object's samples may come faster or slower than the clock by this share, and by this time (s) in any case, over
# windows of this length (s): as `furuta run` allows a rig.
_RATE, _SLACK, _WINDOW = 0.25, 0.5, 4.0


class Ours:
    """Samples at whole periods since the first, on this program's clock."""

    name = "ours"

    def __init__(self, dt: float) -> None:
        self._dt = dt
        self._first: float | None = None

    def wait(self, k: int) -> None:
        """Until sample `k` is due; the first is due at once, and in time: what `io` begins with may take long."""
        if self._first is None:
            return
        due = self._first + k * self._dt
        left = due - now()
        if left > _AWAKE:
            time.sleep(left - _AWAKE)
        while now() < due:
            pass

    def sample(self, k: int, arrived: float) -> tuple[int, float]:
        """The number of the sample that was due as number `k`, and how late it came, s.

        One that is late by whole periods has a later number: the samples between are lost.
        """
        if self._first is None:
            self._first = arrived
        late = max(arrived - self._first - k * self._dt, 0.0)
        return k + int(late / self._dt), late

    def rate(self, k: int, arrived: float) -> float | None:
        """How fast the samples come, where that is wrong: never."""
        return None


class Theirs:
    """Samples of an object that waits for each itself, and leaves none out."""

    name = "io"

    def __init__(self, dt: float) -> None:
        self._dt = dt
        self._first: float | None = None
        # How late the promptest sample was, in the window before and in this one.
        self._before, self._current, self._from = float("inf"), float("inf"), 0.0
        # For the comparison of the two times: (host's time, how far the samples are behind it).
        self._base, self._next, self._since = (0.0, 0.0), (0.0, 0.0), 0.0

    def wait(self, k: int) -> None:
        """The object waits."""

    def sample(self, k: int, arrived: float) -> tuple[int, float]:
        """The number `k`, and how much later it came than the promptest of the last 20 to 40 ms, s."""
        if self._first is None:
            self._first = arrived
        host = arrived - self._first
        behind = host - k * self._dt
        if host - self._from > _HALF_WINDOW:
            self._from, self._before, self._current = host, self._current, float("inf")
        self._current = min(self._current, behind)
        return k, behind - min(self._current, self._before)

    def rate(self, k: int, arrived: float) -> float | None:
        """How many samples come in the time of one, where that is not one."""
        host = arrived - (self._first or 0.0)
        behind = host - k * self._dt
        passed = host - self._base[0]
        if abs(behind - self._base[1]) > _SLACK + _RATE * max(passed, 0.0):
            samples = passed - (behind - self._base[1])
            return samples / passed if passed > 0 else float("inf")
        if host - self._since > _WINDOW:
            self._base, self._next, self._since = self._next, (host, behind), host
        elif behind <= self._next[1]:
            self._next = (host, behind)
        return None
