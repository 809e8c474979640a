//! Calibration, validation and the plan of experiments.

mod calibrate;
mod plan;
mod validate;

use crate::recording::{Read, read, refuse_suspicion};
use furuta_ident::recording::{Selection, against_rig};
use furuta_model::Rig;
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Adds classes and functions to the module.
pub(crate) fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_class::<calibrate::PyCalibration>()?;
    m.add_class::<validate::PyValidation>()?;
    m.add_class::<plan::PyPlan>()?;
    m.add_function(wrap_pyfunction!(calibrate::calibrate, m)?)?;
    m.add_function(wrap_pyfunction!(validate::validate, m)?)?;
    m.add_function(wrap_pyfunction!(plan::plan_experiment, m)?)?;
    m.add_function(wrap_pyfunction!(validate::whiteness, m)?)
}

fn field<'py>(contract: &Bound<'py, PyDict>, name: &str) -> PyResult<Bound<'py, PyAny>> {
    contract
        .get_item(name)?
        .ok_or_else(|| PyKeyError::new_err(name.to_owned()))
}

fn parsed<'py>(py: Python<'py>, json: &str) -> PyResult<Bound<'py, PyDict>> {
    Ok(py
        .import("json")?
        .call_method1("loads", (json,))?
        .cast_into::<PyDict>()?)
}

/// Recordings of this rig, checked against it.
fn checked(
    given: &Bound<'_, PyAny>,
    rig: &Rig,
    selection: &Selection,
    accept_suspicious: bool,
) -> PyResult<Read> {
    let mut all = read(given, selection, accept_suspicious)?;
    for notice in against_rig(&all.recordings, rig) {
        refuse_suspicion(&notice, accept_suspicious)?;
        all.notices.push(notice.to_string());
    }
    Ok(all)
}
