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
    let free = free.unwrap_or_default().0;
    let held: Vec<String> = held.into_iter().flatten().flat_map(|n| n.0).collect();
    match free.iter().find(|name| held.contains(name)) {
        None => Ok((free, held)),
        Some(name) => Err(error::calibrate(format!(
            "{name} is in free and in fix (or hold): leave it out of one of them"
        ))),
    }
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
