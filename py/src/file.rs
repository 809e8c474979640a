//! Files that are written from Python: whole or not at all, and nothing is replaced that cannot be made again.

use std::path::{Path, PathBuf};

use furuta_file::{FileError, Kind, Place};
use pyo3::exceptions::{PyFileExistsError, PyIsADirectoryError, PyPermissionError};
use pyo3::prelude::*;

/// Writes an HTML page. A file that is there already is replaced if it is one, or by force.
pub(crate) fn write_page(
    py: Python<'_>,
    path: &Path,
    force: bool,
    page: impl FnOnce() -> String + Send,
) -> PyResult<()> {
    write(py, path, force, Kind::Page, page)
}

/// Writes a recording, rig file or controller file. A file that is there already is replaced by force alone.
pub(crate) fn write_data(py: Python<'_>, path: &Path, force: bool, text: &str) -> PyResult<()> {
    write(py, path, force, Kind::Data, || text.to_owned())
}

/// The same for the package's own Python.
#[pyfunction]
#[pyo3(signature = (path, text, *, force=false))]
pub(crate) fn _write_data(py: Python<'_>, path: PathBuf, text: &str, force: bool) -> PyResult<()> {
    write_data(py, &path, force, text)
}

fn write(
    py: Python<'_>,
    path: &Path,
    force: bool,
    kind: Kind,
    content: impl FnOnce() -> String + Send,
) -> PyResult<()> {
    let write = || {
        if !force {
            Place::of(path)?.may_be_replaced_by(kind)?;
        }
        furuta_file::write(path, content().as_bytes())
    };
    py.detach(write).map_err(exception)
}

/// The exception that Python itself raises for such a file.
fn exception(error: FileError) -> PyErr {
    let text = error.to_string();
    match error {
        FileError::Exists { .. } => {
            PyFileExistsError::new_err(format!("{text}, or force=True to replace it"))
        }
        FileError::Protected { .. } => PyPermissionError::new_err(text),
        FileError::Folder { .. } => PyIsADirectoryError::new_err(text),
        FileError::Create { source, .. } | FileError::Write { source, .. } => {
            std::io::Error::new(source.kind(), text).into()
        }
    }
}
