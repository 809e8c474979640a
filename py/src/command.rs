//! The command `furuta`, as the package carries it.

use crate::forked::here;
use std::ffi::OsString;

use pyo3::prelude::*;

/// Runs the command with these arguments, of which the first is the program's name, and returns its exit code.
#[pyfunction]
pub(crate) fn _main(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| here(|| furuta_cli::main(arguments)))
}
