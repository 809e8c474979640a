"""What a run exchanges with an object: volts out, angles or counts in, checked."""

from __future__ import annotations

import contextlib
import math
import numbers
import threading
from collections.abc import Iterator
from typing import Any, Protocol

from furuta._furuta import FurutaError, Rig
from furuta._pace import now

# One 0 V can be lost on its way.
_OFF_REPEATS = 3
# An encoder that stands still for so long, s, although its axis must move, is frozen.
_FROZEN = 0.5
# The arm must move where the mean command is beyond this share of the limit.
_DRIVEN = 0.3
# The pendulum must move where the arm has moved so far, rad.
_TRAVEL = 1.0


class IO(Protocol):
    """An object that `furuta.run` can run."""

    def exchange(self, volts: float, /) -> Any:
        """Sets the motor to `volts`, and returns the two angles, or counts, of the sample."""


class RunError(FurutaError):
    """A run of `furuta.run` that ended before its time, the motor off.

    Attributes
    ----------
    run : Run or None
        What was measured up to then.
    """

    run: Any = None


class Stop(Exception):
    """What ends a run before its time, in words, and what to do about it."""

    def __init__(self, what: str, advice: str) -> None:
        super().__init__(what)
        self.what, self.advice = what, advice


class Angles:
    """From what `exchange` returned to angles in rad."""

    def __init__(self, rig: Rig, counts: bool) -> None:
        sensors = rig.sensors
        self._per_turn = (sensors["arm_counts_per_rev"], sensors["pendulum_counts_per_rev"])
        self._counts = counts
        self.whole = True
        """Whether every angle so far was a whole number of counts."""

    def read(self, given: Any) -> tuple[float, float]:
        """Both angles; `Stop` where there are none in what was given."""
        try:
            theta, alpha = given
        except (TypeError, ValueError):
            raise Stop(f"io.exchange returned {_shown(given)}", self._wanted()) from None
        return self._angle("theta", theta, 0), self._angle("alpha", alpha, 1)

    def _angle(self, name: str, value: Any, axis: int) -> float:
        try:
            number = float(value)
        except (TypeError, ValueError):
            number = math.nan
        if not math.isfinite(number):
            said = f"io.exchange returned {name} = {_shown(value)}, which is not a finite number"
            raise Stop(said, self._wanted())
        middle, per_turn = (0.0, math.pi)[axis], self._per_turn[axis]
        if self._counts:
            if not (isinstance(value, numbers.Integral) or number.is_integer()):
                said = f"io.exchange returned {name} = {_shown(value)}, which is not a whole number"
                raise Stop(said, self._wanted())
            return middle + number * math.tau / per_turn
        # To the last bit what the encoder's count is: other programs compute it in another order.
        turns = (number - middle) * per_turn / math.tau
        count = round(turns)
        if abs(turns - count) < 1e-6:
            return middle + count * math.tau / per_turn
        self.whole = False
        return number

    def _wanted(self) -> str:
        if self._counts:
            return "return both encoders' counts, (arm, pendulum), whole numbers, 0 at the middle and hanging"
        return "return both angles in rad, (theta, alpha), alpha = pi hanging; or encoder counts with counts=True"


class Frozen:
    """Looks for an encoder that stands still although its axis must move."""

    def __init__(self, limit: float, dt: float) -> None:
        self._limit = limit
        self._most = max(round(_FROZEN / dt), 1)
        self._theta = self._alpha = math.nan
        self._still = self._samples = 0
        self._volts = 0.0
        self._range = (0.0, 0.0)

    def look(self, theta: float, alpha: float, volts: float) -> None:
        """At a sample, the motor held at `volts`; raises `Stop` at one that is frozen."""
        if theta != self._theta:
            self._theta, self._still, self._volts = theta, 0, 0.0
        self._still += 1
        self._volts += abs(volts)
        if self._still > self._most and self._volts > _DRIVEN * self._limit * self._still:
            raise Stop(
                f"theta has read {theta:g} rad for {_FROZEN} s while the motor was driven with "
                f"{self._volts / self._still:.1f} V on average",
                "see the arm's encoder and its cable, and that the amplifier is enabled",
            )
        if alpha != self._alpha:
            self._alpha, self._samples, self._range = alpha, 0, (theta, theta)
        self._samples += 1
        self._range = (min(self._range[0], theta), max(self._range[1], theta))
        travel = self._range[1] - self._range[0]
        if self._samples > self._most and travel > _TRAVEL:
            raise Stop(
                f"alpha has read {alpha:g} rad for {_FROZEN} s while the arm moved by {travel:.1f} rad",
                "see the pendulum's encoder and its cable",
            )


class Watchdog:
    """Calls `io.off()` while `io.exchange` does not return: from another thread, once, where there is an `off`.

    `called` is when `exchange` was called; None between two calls.
    """

    def __init__(self, io: Any, limit: float) -> None:
        self._off, self._limit = getattr(io, "off", None), limit
        self._over = threading.Event()
        self.called: float | None = None
        self.acted = False

    @contextlib.contextmanager
    def watching(self) -> Iterator[None]:
        """Watches within."""
        if not callable(self._off) or not math.isfinite(self._limit):
            yield
            return
        thread = threading.Thread(target=self._watch, name="furuta-watchdog", daemon=True)
        thread.start()
        try:
            yield
        finally:
            self._over.set()

    def _watch(self) -> None:
        while not self._over.wait(self._limit / 4) and not self.acted:
            called = self.called
            if called is not None and now() - called > self._limit:
                self.acted = True
                with contextlib.suppress(Exception):  # the run's own end tries again
                    self._off()  # type: ignore[misc]


def off(io: Any) -> BaseException | None:
    """Sets the motor to 0 V, several times; the error where none of them succeeded.

    By `io.off()` where there is one that succeeds, else by `io.exchange(0.0)`.
    """
    failed: BaseException | None = None
    done = False
    switch = getattr(io, "off", None)
    for _ in range(_OFF_REPEATS):
        for attempt in (switch, lambda: io.exchange(0.0)):
            if not callable(attempt):
                continue
            try:
                attempt()
                done = True
                break
            except BaseException as e:  # whatever it is, the next attempt may succeed
                failed = e
    return None if done else failed


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + "..."
