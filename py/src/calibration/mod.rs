//! Calibration, validation and the plan of experiments.

mod calibrate;
mod plan;
mod validate;

use crate::arguments::Names;
use crate::error;
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

/// The names of what is fitted and of what is held; none is both.
fn free_and_held(
    free: Option<Names>,
    held: [Option<Names>; 2],
) -> PyResult<(Vec<String>, Vec<String>)> {
    if free.as_ref().is_some_and(|free| free.0.is_empty()) {
        return Err(error::calibrate(
            "free names nothing: leave it out to fit all that the recordings determine",
        ));
    }
    let held: Vec<String> = held.into_iter().flatten().flat_map(|n| n.0).collect();
    Ok((free.unwrap_or_default().0, held))
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
