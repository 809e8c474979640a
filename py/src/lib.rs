//! The private extension module `furuta._furuta`. What users see, `furuta`, is `python/furuta/__init__.py`; types and
//! docstrings for editors are in `_furuta.pyi`.
//!
//! Every function copies its numbers in, releases the interpreter for the work (where that takes longer than
//! letting go), and copies the answer out: other Python threads run meanwhile.

mod arguments;
mod background;
mod batch;
mod batch_simulator;
mod calibration;
mod card;
mod catalogue;
mod command;
mod controlled;
mod controller;
mod design;
mod diagnose;
mod diagnosis;
mod error;
mod estimator;
mod example;
mod experiments;
mod file;
mod forked;
mod frequency;
mod hypothesis;
mod kept;
mod linear;
mod matrix;
mod recording;
mod region;
mod replay;
mod rig;
mod signals;
mod simulate;
mod simulator;
mod supervisor;
mod timing;

use pyo3::prelude::*;

/// Rotary inverted pendulum: model, design, diagnosis (private extension; import `furuta`).
#[pymodule]
fn _furuta(m: &Bound<'_, PyModule>) -> PyResult<()> {
    forked::imported();
    error::register(m)?;
    m.add("__version__", env!("CARGO_PKG_VERSION"))?;
    m.add_class::<rig::PyRig>()?;
    m.add_class::<hypothesis::PyHypothesis>()?;
    m.add_function(wrap_pyfunction!(catalogue::catalogue, m)?)?;
    m.add_function(wrap_pyfunction!(simulate::simulate, m)?)?;
    m.add_function(wrap_pyfunction!(batch::simulate_batch, m)?)?;
    m.add_function(wrap_pyfunction!(simulate::measure, m)?)?;
    m.add_class::<simulator::PySimulator>()?;
    m.add_class::<batch_simulator::PyBatchSimulator>()?;
    m.add_function(wrap_pyfunction!(recording::_read_recording, m)?)?;
    m.add_function(wrap_pyfunction!(example::_example, m)?)?;
    m.add_function(wrap_pyfunction!(file::_write_data, m)?)?;
    m.add_function(wrap_pyfunction!(signals::signal, m)?)?;
    m.add_function(wrap_pyfunction!(linear::linearize, m)?)?;
    m.add_function(wrap_pyfunction!(linear::zero_order_hold, m)?)?;
    design::register(m)?;
    m.add_class::<estimator::PyEstimator>()?;
    experiments::register(m)?;
    m.add_class::<controller::PyController>()?;
    m.add_class::<supervisor::PySupervisor>()?;
    m.add_class::<supervisor::PySwingUp>()?;
    m.add_function(wrap_pyfunction!(controller::controllers, m)?)?;
    m.add_function(wrap_pyfunction!(region::region_of_attraction, m)?)?;
    calibration::register(m)?;
    m.add_class::<diagnosis::PyDiagnosis>()?;
    m.add_function(wrap_pyfunction!(diagnose::diagnose, m)?)?;
    m.add_class::<replay::PyReplay>()?;
    m.add_function(wrap_pyfunction!(replay::replay, m)?)?;
    m.add_function(wrap_pyfunction!(timing::timing, m)?)?;
    frequency::register(m)?;
    m.add_function(wrap_pyfunction!(command::_main, m)?)?;
    Ok(())
}
