//! Python's exceptions: one base class, a `ValueError`, and one subclass for each part that can refuse its input.

use pyo3::create_exception;
use pyo3::exceptions::{PyKeyboardInterrupt, PyUserWarning, PyValueError};
use pyo3::prelude::*;

create_exception!(
    furuta,
    FurutaError,
    PyValueError,
    "Anything that furuta refuses: what, where, which value is allowed."
);
create_exception!(
    furuta,
    RigError,
    FurutaError,
    "A rig, rig file, parameter or effect that cannot be."
);
create_exception!(
    furuta,
    SimulationError,
    FurutaError,
    "A simulation that cannot start or left the finite numbers."
);
create_exception!(
    furuta,
    SignalError,
    FurutaError,
    "A test signal that cannot be: which parameter, which range."
);
create_exception!(
    furuta,
    RecordingError,
    FurutaError,
    "A recording that cannot be used: which, where, why."
);
create_exception!(
    furuta,
    DiagnoseError,
    FurutaError,
    "Recordings that cannot carry a diagnosis."
);
create_exception!(
    furuta,
    CalibrateError,
    FurutaError,
    "Recordings that cannot carry a calibration, or a wish that cannot be fulfilled."
);
create_exception!(
    furuta,
    ControllerError,
    FurutaError,
    "A controller file, or a controller that a rig cannot have."
);
create_exception!(
    furuta,
    DesignError,
    FurutaError,
    "A design problem without a usable answer."
);

create_exception!(
    furuta,
    IdentificationError,
    FurutaError,
    "Data that have no frequency response, a fit or comparison that cannot be."
);

create_exception!(
    furuta,
    Interrupted,
    PyKeyboardInterrupt,
    "A KeyboardInterrupt during `diagnose`; its attribute `diagnosis` holds what was found by then."
);

/// Adds the exceptions to the module.
pub(crate) fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = m.py();
    m.add("FurutaError", py.get_type::<FurutaError>())?;
    m.add("RigError", py.get_type::<RigError>())?;
    m.add("SimulationError", py.get_type::<SimulationError>())?;
    m.add("SignalError", py.get_type::<SignalError>())?;
    m.add("RecordingError", py.get_type::<RecordingError>())?;
    m.add("DiagnoseError", py.get_type::<DiagnoseError>())?;
    m.add("CalibrateError", py.get_type::<CalibrateError>())?;
    m.add("ControllerError", py.get_type::<ControllerError>())?;
    m.add("DesignError", py.get_type::<DesignError>())?;
    m.add("IdentificationError", py.get_type::<IdentificationError>())?;
    m.add("Interrupted", py.get_type::<Interrupted>())
}

/// A rig error of the model as Python's.
pub(crate) fn rig(e: impl std::fmt::Display) -> PyErr {
    RigError::new_err(furuta_input::plain(&e.to_string()).to_string())
}

/// A simulation that cannot be as Python's error.
pub(crate) fn simulation(e: impl std::fmt::Display) -> PyErr {
    SimulationError::new_err(furuta_input::plain(&e.to_string()).to_string())
}

/// [`simulation`] for a message that is made already.
pub(crate) fn said(text: String) -> PyErr {
    simulation(text)
}

/// A signal's error as Python's.
pub(crate) fn signal(e: impl std::fmt::Display) -> PyErr {
    SignalError::new_err(furuta_input::plain(&e.to_string()).to_string())
}

/// A controller's error as Python's.
pub(crate) fn controller(e: impl std::fmt::Display) -> PyErr {
    ControllerError::new_err(furuta_input::plain(&e.to_string()).to_string())
}

/// A design error as Python's.
pub(crate) fn design(e: impl std::fmt::Display) -> PyErr {
    DesignError::new_err(furuta_input::plain(&e.to_string()).to_string())
}

/// A recording's error as Python's.
pub(crate) fn recording(e: impl std::fmt::Display) -> PyErr {
    RecordingError::new_err(furuta_input::plain(&e.to_string()).to_string())
}

/// A diagnosis that cannot be as Python's error.
pub(crate) fn diagnose(e: impl std::fmt::Display) -> PyErr {
    DiagnoseError::new_err(furuta_input::plain(&e.to_string()).to_string())
}

/// An error of a frequency response, a fit or a comparison as Python's.
pub(crate) fn identification(e: impl std::fmt::Display) -> PyErr {
    IdentificationError::new_err(furuta_input::plain(&e.to_string()).to_string())
}

/// An error of calibration, validation or planning as Python's.
pub(crate) fn calibrate(e: impl std::fmt::Display) -> PyErr {
    CalibrateError::new_err(furuta_input::plain(&e.to_string()).to_string())
}

/// Says each of these as a Python UserWarning; where warnings are errors, the first one is raised.
pub(crate) fn warn_each(
    py: Python<'_>,
    texts: impl IntoIterator<Item = impl std::fmt::Display>,
) -> PyResult<()> {
    let category = py.get_type::<PyUserWarning>();
    for text in texts {
        let text = std::ffi::CString::new(text.to_string())?;
        PyErr::warn(py, &category, &text, 1)?;
    }
    Ok(())
}
