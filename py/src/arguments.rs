//! Arguments that more than one function takes, read leniently where it is plain what is meant.

use crate::error;
use crate::rig::PyRig;
use furuta_model::Rig;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyString;
use std::path::PathBuf;

/// A rig: a `Rig`, the name of a built-in one or the path of a rig file.
#[derive(Clone)]
pub(crate) struct RigLike {
    pub(crate) rig: Rig,
}

impl<'py> FromPyObject<'_, 'py> for RigLike {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(rig) = given.cast::<PyRig>() {
            let rig = rig.get().rig.clone();
            return Ok(Self { rig });
        }
        let path: PathBuf = given.extract().map_err(|_| {
            PyTypeError::new_err(format!(
                "a furuta.Rig, the name of a built-in rig or the path of a rig file is expected, a {} was given",
                kind(&given)
            ))
        })?;
        let rig = Rig::load(&path.to_string_lossy()).map_err(error::rig)?;
        Ok(Self { rig })
    }
}

/// Names: a list of str, or one of them alone.
#[derive(Clone, Default)]
pub(crate) struct Names(pub(crate) Vec<String>);

impl<'py> FromPyObject<'_, 'py> for Names {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if given.is_instance_of::<PyString>() {
            return Ok(Self(vec![given.extract()?]));
        }
        let wrong = || {
            PyTypeError::new_err(format!(
                "a list of str (or one str) is expected, a {} was given",
                kind(&given)
            ))
        };
        let all = given.try_iter().map_err(|_| wrong())?;
        let names = all.map(|name| name.and_then(|name| name.extract().map_err(|_| wrong())));
        names.collect::<PyResult<_>>().map(Self)
    }
}

/// The name of an object's type.
pub(crate) fn kind(given: &Bound<'_, PyAny>) -> String {
    given
        .get_type()
        .name()
        .map_or_else(|_| "?".to_owned(), |name| name.to_string())
}
