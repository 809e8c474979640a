//! Identification in the frequency domain.

mod compare;
mod fit;
mod frf;
mod response;
mod spectra;
mod transfer_fit;

use pyo3::prelude::*;

/// Adds classes and functions to the module.
pub(crate) fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_class::<frf::PyFrf>()?;
    m.add_class::<transfer_fit::PyTransferFit>()?;
    m.add_class::<compare::PyComparison>()?;
    m.add_function(wrap_pyfunction!(spectra::spectra, m)?)?;
    m.add_function(wrap_pyfunction!(response::frf, m)?)?;
    m.add_function(wrap_pyfunction!(fit::fit_transfer_function, m)?)?;
    m.add_function(wrap_pyfunction!(compare::compare, m)?)
}
