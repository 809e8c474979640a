"""`furuta.simulate` where Python decides: any callable as controller or estimator."""

from __future__ import annotations

from typing import Any

import numpy as np

from furuta._furuta import Controller, ControllerError, Estimator, Rig, SimulationError, Simulator


def simulate(
    rig: Rig,
    x0: Any,
    u: Any,
    dt: float,
    *,
    substeps: int,
    run: int,
    encoders: bool,
    controller: Any,
    reference: Any,
    ideal: bool,
    estimator: Any,
) -> tuple[Any, ...]:
    """States, commands, modes and, with `encoders`, readings; see `furuta.simulate`."""
    if controller is None:
        raise SimulationError("estimator belongs to a controller: give controller=...")
    if ideal and estimator is not None:
        raise SimulationError("ideal=True shows the controller the true states: leave estimator out, or ideal")
    added = np.atleast_1d(np.squeeze(np.asarray(u, dtype=float)))
    if added.ndim != 1:
        raise SimulationError(f"u has shape {np.shape(u)}; it must be (n,)")
    for made in (controller, estimator):
        _check_period(made, dt)
    decide, mode = _decider(controller, reference, len(added))
    simulator = Simulator(rig, x0, dt, substeps=substeps, run=run)
    see = None if ideal else _seer(estimator, rig, dt)
    limit = rig["motor.command_limit"]
    states, readings, commands = [simulator.x], [simulator.reading], np.empty(len(added))
    waiting = 0.0
    for k, volts in enumerate(added):
        t = simulator.t
        if see is None:
            # The true state, a copy that the controller may change, and the command acts at once.
            decided = _number("controller", t, decide(t, states[-1].copy(), k))
            held = _limited(decided + volts, limit, t, rig.command_unit)
        else:
            # As on a rig: what is decided now acts from the next sample on.
            held = waiting
            x = see(t, *readings[-1], held)
            waiting = _limited(_number("controller", t, decide(t, x, k)) + volts, limit, t, rig.command_unit)
        commands[k] = held
        states.append(simulator.step(held))
        readings.append(simulator.reading)
    answer = (np.array(states), commands, [mode] * len(commands))
    return (*answer, np.array(readings)) if encoders else answer


def _check_period(made: Any, dt: float) -> None:
    """Refuses a Controller or Estimator that is made for another sample period (s)."""
    # Written so that a NaN fails.
    if isinstance(made, (Controller, Estimator)) and not abs(dt / made.dt - 1) < 1e-9:
        what = type(made).__name__.lower()
        raise ControllerError(f"the {what} is made for dt = {made.dt} s, not for {dt} s")


def _decider(controller: Any, reference: Any, samples: int) -> tuple[Any, str]:
    """`decide(t, x, k)`, and what the mode is called."""
    if isinstance(controller, Controller):
        targets = np.broadcast_to(0.0 if reference is None else np.asarray(reference, dtype=float), (samples,))
        controller.start()
        return lambda t, x, k: controller.update(x, [float(targets[k]), 0.0, 0.0, 0.0]), "balance"
    if not callable(controller):
        raise TypeError(
            "controller must be a furuta.Controller or a callable controller(t, x); "
            f"a {type(controller).__name__} was given"
        )
    if reference is not None:
        raise SimulationError("reference belongs to a furuta.Controller: a callable knows its own")
    return lambda t, x, k: controller(t, x), "callable"


def _seer(estimator: Any, rig: Rig, dt: float) -> Any:
    """`see(t, theta, alpha, held)`: the state that the controller is shown."""
    if estimator is None:
        estimator = Estimator("kalman", rig, dt)
    if isinstance(estimator, str):
        estimator = Estimator(estimator, rig, dt)
    if isinstance(estimator, Estimator):
        own = estimator
        own.start()
        # The state when the command begins to act.
        return lambda t, theta, alpha, held: own.update(theta, alpha, held)[1]
    if not callable(estimator):
        raise TypeError(
            "estimator must be a furuta.Estimator, the name of a kind or a callable estimator(t, theta, alpha, held); "
            f"a {type(estimator).__name__} was given"
        )

    def see(t: float, theta: float, alpha: float, held: float) -> Any:
        # A copy: what the controller does to it does not reach what the estimator remembers.
        x = np.array(estimator(t, theta, alpha, held), dtype=float)
        if x.shape != (4,):
            raise SimulationError(f"the estimator gave shape {x.shape} at t = {t:g} s; a state has shape (4,)")
        if not np.isfinite(x).all():
            raise SimulationError(f"the estimator gave {x.tolist()} at t = {t:g} s: a state has finite numbers")
        return x

    return see


def _number(what: str, t: float, value: Any) -> float:
    """The one number that a callable gave."""
    array = np.asarray(value, dtype=float)
    if array.size != 1:
        raise SimulationError(
            f"the {what} gave shape {array.shape} at t = {t:g} s; one number, the command, is expected"
        )
    return float(array.reshape(()))


def _limited(u: float, limit: float, t: float, unit: str) -> float:
    if not np.isfinite(u):
        raise SimulationError(f"the controller gave {u} {unit} at t = {t:g} s: not a finite number")
    return min(max(u, -limit), limit)
