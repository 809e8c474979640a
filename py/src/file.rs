//! Files that are written from Python: whole or not at all, and nothing is replaced that cannot be made again.

use std::path::Path;

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
    let write = || {
        if !force {
            Place::of(path)?.may_be_replaced_by(Kind::Page)?;
        }
        furuta_file::write(path, page().as_bytes())
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
