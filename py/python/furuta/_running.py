"""The loop of `furuta.run`, and that the motor is off however it ends."""

from __future__ import annotations

import contextlib
import gc
import signal
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from furuta._exchange import IO, Angles, Frozen, Stop, Watchdog, off
from furuta._furuta import Supervisor
from furuta._pace import Ours, Theirs, now

HOLD = 2.0
"""How long the arm stays at a step of its reference, s: as in `furuta run --arm-steps`."""
COLUMNS = (
    *("t", "u", "theta", "alpha", "theta_dot", "alpha_dot", "reference", "command", "mode", "seq", "lost"),
    *("lateness", "compute", "exchange"),
)
"""Of each sample, in the order in which the loop has them."""
_MODES = {"swing-up": "swing-up", "balance": "balance", "braking": "brake"}


@dataclass
class Loop:
    """A run under way."""

    io: IO
    supervisor: Supervisor
    angles: Angles
    frozen: Frozen
    watchdog: Watchdog
    pace: Ours | Theirs
    largest: float
    """Command limit, V."""
    duration: float
    """Of the samples' time, s."""
    late_limit: float
    """s."""
    longest: float
    """Of the host's time, s."""
    any_clock: bool
    arm_steps: float
    """rad."""
    t: float = 0.0
    """Of the last sample, s."""
    rows: list[tuple[Any, ...]] = field(default_factory=list)
    """The columns of `COLUMNS`, one row a sample."""

    def until_the_end(self) -> None:
        """Samples until the duration is over; raises whatever ends it before."""
        io, supervisor, pace, angles, watchdog = self.io, self.supervisor, self.pace, self.angles, self.watchdog
        dt, volts, k, last, braking = supervisor.dt, 0.0, 0, -1, False
        balanced: float | None = None
        begin = now()
        while True:
            pace.wait(k)
            called = now()
            # The motor is off at the first call, which may begin with what takes long.
            watchdog.called = called if k else None
            try:
                given = io.exchange(volts)
                watchdog.called = None
            except Exception as e:
                said = f"io.exchange raised {type(e).__name__}: {e}"
                raise Stop(said, "see the error above, and the rig's cables") from e
            arrived = now()
            k, late = pace.sample(k, arrived)
            # As the protocol's whole microseconds.
            self.t = t = round(k * dt * 1e6) * 1e-6
            theta, alpha = angles.read(given)
            self._punctual(k, late, arrived, begin)
            self.frozen.look(theta, alpha, volts)
            target = _steps(self.arm_steps, t - balanced if balanced is not None else 0.0)
            command, doing = supervisor.step(t, theta, alpha, target=target, held=volts)
            balanced = (t if balanced is None else balanced) if doing == "balance" else None
            mode = "brake" if braking and doing == "fault" else _MODES.get(doing, "off")
            braking = doing == "braking"
            estimate = supervisor.estimate
            theta_dot, alpha_dot = (0.0, 0.0) if estimate is None else (float(estimate[2]), float(estimate[3]))
            self.rows.append(
                (
                    *(t, volts, theta, alpha, theta_dot, alpha_dot, supervisor.reference, command, mode, k),
                    *(k - last - 1, late, now() - arrived, arrived - called),
                )
            )
            if doing == "fault":
                raise Stop(str(supervisor.fault), "bring the arm back to its middle")
            if t >= self.duration and not braking:
                return
            # In single precision, as it would go over the protocol's wire and as a log holds it.
            volts = min(max(float(np.float32(command)), -self.largest), self.largest)
            last, k = k, k + 1

    def _punctual(self, k: int, late: float, arrived: float, begin: float) -> None:
        """Raises `Stop` where a sample is too late, or the samples' time is not the clock's."""
        if self.watchdog.acted:
            raise Stop(
                f"io.exchange did not return for more than {self.late_limit * 1e3:.1f} ms, and off() was called "
                "meanwhile",
                "see what io.exchange waits for, or give a larger late_limit",
            )
        if late > self.late_limit:
            raise Stop(
                f"a sample came {late * 1e3:.1f} ms late, the limit is {self.late_limit * 1e3:.1f} ms",
                "see what else the computer does and how long io.exchange takes, or give a larger late_limit",
            )
        if arrived - begin > self.longest:
            raise Stop(
                f"a run of {self.duration:g} s has lasted {arrived - begin:.1f} s of the host's clock",
                "see how long io.exchange takes",
            )
        if not self.any_clock and (rate := self.pace.rate(k, arrived)) is not None:
            raise Stop(
                f"the samples of io come {rate:.3f} times as fast as one every {self.supervisor.dt * 1e3:g} ms",
                "give io and furuta.run the same period, or any_clock=True if io is a simulation",
            )


def fly(loop: Loop) -> tuple[BaseException | None, BaseException | None, int]:
    """Runs the loop, and switches the motor off.

    What ended it before its time, why the motor could not be switched off, when it began (ns since 1970).
    """
    error: BaseException | None = None
    started = time.time_ns()
    collected = gc.isenabled()
    with _signals() as ended:
        try:
            gc.disable()
            with loop.watchdog.watching():
                loop.until_the_end()
            ended()
        except BaseException as e:
            ended()
            error = e
        finally:
            off_error = off(loop.io)
            if collected:
                gc.enable()
    return error, off_error, started


@contextlib.contextmanager
def _signals() -> Iterator[Any]:
    """Ctrl-C and SIGTERM raise once within, and no more once what is given was called: 0 V is on its way then."""
    deaf = False

    def ended() -> None:
        nonlocal deaf
        deaf = True

    def heard(number: int, _: Any) -> None:
        if deaf:
            return
        ended()
        if number == signal.SIGINT:
            raise KeyboardInterrupt
        raise SystemExit(128 + number)

    before: dict[int, Any] = {}
    if threading.current_thread() is threading.main_thread():
        for name in ("SIGINT", "SIGTERM", "SIGHUP"):
            number = getattr(signal, name, None)  # there is no SIGHUP on Windows
            usual = signal.default_int_handler if name == "SIGINT" else signal.SIG_DFL
            # What the program has set up itself, stays.
            if number is not None and signal.getsignal(number) is usual:
                before[number] = signal.signal(number, heard)
    try:
        yield ended
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _steps(amplitude: float, t: float) -> float:
    """The arm's reference at a time since balancing began: as `furuta run --arm-steps` has it."""
    step = int(max(t, 0.0) / HOLD)
    return 0.0 if step == 0 else amplitude if step % 2 else -amplitude
