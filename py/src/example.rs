//! Recordings of a real rig that the package carries, so that there is something real to try it on.

use crate::error;
use pyo3::prelude::*;

/// Files of `examples/qube-servo-2`, by their names there.
const QUBE: [(&str, &str); 9] = [
    (
        "chirp-minus-1.csv",
        include_str!("../../examples/qube-servo-2/chirp-minus-1.csv"),
    ),
    (
        "chirp-minus-5.csv",
        include_str!("../../examples/qube-servo-2/chirp-minus-5.csv"),
    ),
    (
        "chirp-plus-1.csv",
        include_str!("../../examples/qube-servo-2/chirp-plus-1.csv"),
    ),
    (
        "chirp-plus-5.csv",
        include_str!("../../examples/qube-servo-2/chirp-plus-5.csv"),
    ),
    (
        "swing-up-1.csv",
        include_str!("../../examples/qube-servo-2/swing-up-1.csv"),
    ),
    (
        "swing-up-2.csv",
        include_str!("../../examples/qube-servo-2/swing-up-2.csv"),
    ),
    (
        "rig.toml",
        include_str!("../../examples/qube-servo-2/rig.toml"),
    ),
    (
        "README.md",
        include_str!("../../examples/qube-servo-2/README.md"),
    ),
    (
        "LICENSE.txt",
        include_str!("../../examples/qube-servo-2/LICENSE.txt"),
    ),
];

/// Names and contents of an example's files.
#[pyfunction]
pub(crate) fn _example(name: &str) -> PyResult<Vec<(&'static str, &'static str)>> {
    match name {
        "qube-servo-2" => Ok(QUBE.to_vec()),
        _ => Err(error::recording(format!(
            "{name:?} is no example that the package carries; \"qube-servo-2\" is"
        ))),
    }
}
