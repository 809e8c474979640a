//! Cards: how a notebook shows a result.

use pyo3::prelude::*;

/// The card that `furuta._cards` makes of an object of this kind.
pub(crate) fn card<'py>(object: &Bound<'py, PyAny>, kind: &str) -> PyResult<Bound<'py, PyAny>> {
    object
        .py()
        .import("furuta._cards")?
        .call_method1(kind, (object,))
}
