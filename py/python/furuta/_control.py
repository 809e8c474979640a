"""To python-control's systems and back. python-control is imported where one of these is called, not before."""

from __future__ import annotations

from typing import Any

import numpy as np

from furuta._furuta import Frf, IdentificationError, Rig, linearize, zero_order_hold

STATES = ["theta", "alpha", "theta_dot", "alpha_dot"]


def _control() -> Any:
    try:
        import control  # type: ignore
    except ImportError as e:
        raise ImportError("this needs python-control, which is not installed: pip install control") from e
    return control


def state_space(rig: Rig, x: Any = None, dt: float | None = None) -> Any:
    """The linear model of a rig; see `furuta.Rig.to_ss`."""
    control = _control()
    a, b = linearize(rig, x)
    if dt is not None:
        a, b = zero_order_hold(a, b, dt)
    outputs = np.eye(2, 4)
    return control.ss(
        a, b, outputs, np.zeros((2, 1)), dt or 0, states=STATES, inputs=["u"], outputs=["theta", "alpha"], name=rig.name
    )


def transfer_function(rig: Rig, output: str = "alpha", x: Any = None) -> Any:
    """From u to one angle; see `furuta.Rig.to_tf`."""
    control = _control()
    if output not in ("alpha", "theta"):
        raise ValueError(f'output = {output!r} is none of "alpha", "theta"')
    system = state_space(rig, [0.0, np.pi, 0.0, 0.0] if x is None else x)
    row = ["theta", "alpha"].index(output)
    # python-control converts with SLICOT where it is there and by SciPy otherwise.
    return control.ss2tf(system.A, system.B, system.C[[row]], system.D[[row]])


def response_data(frf: Frf) -> Any:
    """A measured response as python-control's; see `furuta.Frf.to_control`."""
    control = _control()
    dt = {"dt": frf.sample_period} if frf.sample_period > 0 else {}
    return control.frd(frf.response, 2 * np.pi * frf.frequency, smooth=True, **dt)


def response(system: Any, frequency: Any = None) -> Frf:
    """The response of a python-control system; see `furuta.Frf.from_control`."""
    _control()
    if not callable(getattr(system, "frequency_response", None)):
        raise TypeError(
            "system must be a python-control system (StateSpace, TransferFunction or FrequencyResponseData); "
            f"a {type(system).__name__} was given"
        )
    measured = getattr(system, "omega", None)
    if frequency is None:
        if measured is None:
            raise IdentificationError(
                "frequency must be given for a system that is no frequency response data: Hz, ascending"
            )
        frequency = np.asarray(measured) / (2 * np.pi)
    frequency = _frequencies(frequency)
    omega = 2 * np.pi * frequency
    if measured is None:
        answer = system.frequency_response(omega, squeeze=False)
        # Its name before python-control 0.10.1.
        values = np.asarray(answer.frdata if hasattr(answer, "frdata") else answer.fresp)
    else:
        # Sampled data refuse `frequency_response`, which asks for points of the unit circle.
        values = np.asarray(system.eval(omega, squeeze=False))
    values = values.reshape(-1, len(frequency))
    if len(values) != 1:
        raise IdentificationError(
            f"the system has {len(values)} pairs of output and input; one is needed: choose with system[output, input]"
        )
    dt = getattr(system, "dt", 0)
    return Frf(frequency, values[0], sample_period=0.0 if dt in (None, True) else float(dt))


def _frequencies(given: Any) -> Any:
    """Hz, at least one, as an array of one dimension."""
    try:
        found = np.atleast_1d(np.asarray(given, dtype=float))
    except (TypeError, ValueError) as e:
        raise IdentificationError(f"frequency must be an array of numbers, Hz, ascending: {e}") from e
    if found.ndim != 1 or not found.size:
        raise IdentificationError(f"frequency has shape {found.shape}; it must be (N,), N at least 1")
    return found
