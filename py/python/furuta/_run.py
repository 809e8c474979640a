"""`furuta.run`: the supervisor of `furuta run` on any object that exchanges volts for angles."""

from __future__ import annotations

import math
import os
from typing import Any, Literal

import numpy as np

from furuta import _runlog
from furuta._exchange import IO, Angles, Frozen, RunError, Stop, Watchdog
from furuta._furuta import Controller, ControllerError, Interrupted, Rig, Simulator, Supervisor
from furuta._pace import Ours, Theirs
from furuta._ran import Run
from furuta._running import COLUMNS, HOLD, Loop, fly

# Periods after which a late sample ends a run: those after which a rig's watchdog switches its motor off.
_LATE = 10
# A controller that holds the pendulum of the model from here, rad, for so long, s, may be run.
_TILT, _HELD = 0.05, 2.0


def run(
    rig: Rig | str | os.PathLike[str],
    controller: Controller | str | os.PathLike[str] | None = None,
    *,
    io: IO,
    duration: float = 20.0,
    dt: float | None = None,
    pace: Literal["ours", "io"] = "ours",
    counts: bool | None = None,
    arm_steps: float = 0.0,
    log: str | os.PathLike[str] | None = None,
    force: bool = False,
    late_limit: float | None = None,
    any_clock: bool = False,
    any_loop: bool = False,
) -> Run:
    """Swings the pendulum of a rig up and balances it, through any object that exchanges volts for angles.

    It is the supervisor of `furuta run` and of the firmware, with its estimator, limits and faults, and its log. A
    command that is decided at a sample acts from the next one on. However the run ends, the last thing that `io` is
    told is 0 V, three times.

    Parameters
    ----------
    rig : Rig
        What the controller is designed for. Or the name of a built-in rig, or the path of a rig file.
    controller : Controller, optional
        Or the path of a controller file; the standard one if not given.
    io : object
        It has a method `exchange(volts)`, which sets the motor to `volts` and returns the sample's `(theta, alpha)`:
        rad, theta = 0 where the arm rests, alpha = pi hanging, neither wrapped. With `counts` both encoders' counts, 0
        at rest. It may have a method `off()`, which sets 0 V and reads nothing: for when reading fails, and from
        another thread while `exchange` does not return.
    duration : float, optional
        Length of the run, s. It ends after half as much again and 2 s of the host's clock in any case.
    dt : float, optional
        Sample period, s, whole microseconds; the controller's, or 0.002.
    pace : {"ours", "io"}, optional
        "ours": `exchange` is called once a period of the host's clock, and returns as soon as it can. "io": it waits
        for its next sample itself, leaves none out, and sets the motor then.
    counts : bool, optional
        Whether `exchange` returns encoder counts; if not given, the attribute `counts` of `io`, or False.
    arm_steps : float, optional
        While balancing, step the arm between plus and minus this angle, rad, every 2 s.
    log : path, optional
        CSV log, as `furuta convert` makes it of an MCAP log: written when the run is over, however it ended.
    force : bool, optional
        Replace a log that is there already.
    late_limit : float, optional
        A sample that comes later than this, s, ends the run; 10 periods if not given.
    any_clock : bool, optional
        For a simulated `io`, whose time is not that of a clock: how late it is ends no run, unless `late_limit` is
        given.
    any_loop : bool, optional
        Run a controller that does not hold the nonlinear model of the rig upright. It is tried before anything moves.

    Returns
    -------
    Run

    Raises
    ------
    RunError
        A run that ended before its time: `exchange` raised (its error is the cause) or gave what is no angle, a sample
        came late, an encoder stands still, a limit was passed. Its attribute `run` holds what was measured.
    Interrupted
        Ctrl-C. Its attribute `run` holds what was measured.
    ControllerError
        A controller that the rig cannot have, or that does not hold it upright.
    FileExistsError
        A log that is there already, before anything moves.

    Examples
    --------
    >>> import numpy as np, furuta
    >>> class Simulated:  # in the place of a data acquisition card
    ...     def __init__(self, rig, dt):
    ...         self.plant = furuta.Simulator(rig, [0, np.pi, 0, 0], dt)
    ...     def exchange(self, volts):
    ...         reading = self.plant.reading
    ...         self.plant.step(volts)
    ...         return reading
    >>> rig = furuta.Rig.load("shahzad2022-srv02")
    >>> run = furuta.run(rig, io=Simulated(rig, 0.002), duration=3, pace="io", any_clock=True)
    >>> run.mode[-1], bool(abs(run.alpha[-1]) < 0.05), run.lost.sum().item()
    ('balance', True, 0)
    """
    known = rig if isinstance(rig, Rig) else Rig.load(rig)
    period = _period(dt, controller)
    made = _controller(controller, known, period)
    supervisor = Supervisor(known, made, period)
    _check(io, duration, pace, late_limit, arm_steps)
    if log is not None:
        _runlog.check(log, force)
    if not any_loop:
        _rehearse(known, made, period)
    limit = late_limit if late_limit is not None else math.inf if any_clock else _LATE * period
    is_counts = bool(getattr(io, "counts", False) if counts is None else counts)
    loop = Loop(
        io=io,
        supervisor=supervisor,
        angles=Angles(known, is_counts),
        frozen=Frozen(known["motor.command_limit"], period),
        # An object that waits for its next sample may take a period longer.
        watchdog=Watchdog(io, limit + period),
        pace=Ours(period) if pace == "ours" else Theirs(period),
        largest=_runlog.largest_command(known),
        duration=duration,
        late_limit=limit,
        longest=10 * duration + 60 if any_clock else 1.5 * duration + 2,
        any_clock=any_clock,
        arm_steps=float(arm_steps),
    )
    error, off_error, started = fly(loop)
    told = f"furuta.run, {type(io).__module__}.{type(io).__qualname__}, pace {pace}{', counts' if is_counts else ''}"
    done = _ran(loop, known, made, _told(error, loop.t), told, started)
    _end(done, error, off_error, log, force)
    return done


def _ran(loop: Loop, rig: Rig, controller: Controller, end: str, io: str, started: int) -> Run:
    """What a loop has measured, and what its log says."""
    dt, steps, limit = loop.supervisor.dt, loop.arm_steps, loop.late_limit
    arm = f"arm to plus and minus {steps} rad every {HOLD} s" if steps else "arm at 0 rad"
    reference = {"steps": {"amplitude": steps, "hold": HOLD}} if steps else {"constant": 0.0}
    again = {
        "task": {"balance": {"reference": reference}},
        "dt": dt,
        "watchdog": min(max(round(limit / dt), 1), 65535) if math.isfinite(limit) else _LATE,
    }
    words = f"energy swing-up; {controller.kind}; {arm}"
    said = _runlog.metadata(rig, controller.to_toml(), words, io, started, again if loop.angles.whole else None)
    columns: dict[str, Any] = dict(zip(COLUMNS, zip(*loop.rows))) if loop.rows else dict.fromkeys(COLUMNS, ())
    modes = list(columns.pop("mode"))
    arrays = {name: np.array(values, dtype=float) for name, values in columns.items()}
    arrays |= {name: arrays[name].astype(np.int64) for name in ("seq", "lost")}
    return Run(**arrays, mode=modes, dt=dt, end=end, name=rig.name, rig=rig, said=said)


def _end(
    run: Run,
    error: BaseException | None,
    off_error: BaseException | None,
    log: str | os.PathLike[str] | None,
    force: bool,
) -> None:
    """Writes the log, and raises what there is to raise."""
    unwritten: OSError | None = None
    if log is not None:
        try:
            run.save(log, force=force)
        except OSError as e:
            unwritten = e
    if error is None and off_error is None and unwritten is None:
        return
    if isinstance(error, Exception) and not isinstance(error, Stop):
        raise error  # a mistake in this package, or in what it was given
    said = run.end if error is not None else "the run is over"
    said += ": motor off"
    if off_error is not None:
        said = said.removesuffix("off")
        said += f"NOT OFF, io raised {type(off_error).__name__}: {off_error}; switch the rig off by hand"
    if isinstance(error, Stop):
        said += f"; {error.advice}"
    if unwritten is not None:
        said += f"; the log was not written ({unwritten}): the attribute run holds it, run.save(path) writes it"
    if isinstance(error, SystemExit):
        raise error
    raised = Interrupted(said) if isinstance(error, KeyboardInterrupt) else RunError(said)
    raised.run = run  # type: ignore[union-attr]
    cause = error.__cause__ if isinstance(error, Stop) else error
    raise raised from (cause or off_error or unwritten)


def _told(error: BaseException | None, t: float) -> str:
    """How a run ended, in words."""
    if error is None:
        return "finished"
    if isinstance(error, KeyboardInterrupt):
        return f"interrupted at t = {t:.3f} s"
    if isinstance(error, SystemExit):
        return f"told to terminate at t = {t:.3f} s"
    what = error.what if isinstance(error, Stop) else f"{type(error).__name__}: {error}"
    return f"{what} at t = {t:.3f} s"


def _period(dt: float | None, controller: Any) -> float:
    given = dt if dt is not None else controller.dt if isinstance(controller, Controller) else 0.002
    if not 1e-4 <= given <= 0.1 or abs(given * 1e6 - round(given * 1e6)) > 1e-6:
        raise ControllerError(f"dt = {given} s must be whole microseconds from 0.0001 s to 0.1 s")
    return round(given * 1e6) * 1e-6


def _controller(given: Any, rig: Rig, dt: float) -> Controller:
    if given is None:
        return Controller.from_toml("", rig, dt)
    return given if isinstance(given, Controller) else Controller.from_file(given, rig, dt)


def _check(io: Any, duration: float, pace: str, late_limit: float | None, arm_steps: float) -> None:
    if not callable(getattr(io, "exchange", None)):
        raise TypeError(
            f"io must have a method exchange(volts) that returns (theta, alpha); a {type(io).__name__} was given"
        )
    if pace not in ("ours", "io"):
        raise ValueError(f'pace = {pace!r} is none of "ours", "io"')
    if not (math.isfinite(duration) and duration > 0):
        raise ValueError(f"duration = {duration} s must be a finite number above 0")
    if late_limit is not None and not late_limit > 0:
        raise ValueError(f"late_limit = {late_limit} s must be above 0")
    if not 0 <= arm_steps <= 1:
        raise ValueError(f"arm_steps = {arm_steps} rad must be between 0 and 1")


def _rehearse(rig: Rig, controller: Controller, dt: float) -> None:
    """Refuses a controller that does not hold the pendulum of the nonlinear model, encoders and delay included."""
    supervisor, plant, u = Supervisor(rig, controller, dt), Simulator(rig, [0, _TILT, 0, 0], dt), 0.0
    while plant.t < _HELD:
        held, (u, _) = u, supervisor.step(plant.t, *plant.reading)
        x = plant.step(held)
        if abs(x[1]) > math.pi / 2 or supervisor.fault is not None:
            raise ControllerError(
                f"this controller does not hold {rig.name} upright: on the model its pendulum fell after "
                f"{plant.t:.2f} s{f' ({supervisor.fault})' if supervisor.fault else ''}; `furuta design` gives a gain "
                "for a rig, any_loop=True runs it all the same"
            )
