//! Recordings given from Python: paths of files, or columns as arrays.

use crate::error;
use furuta_ident::recording::{Notice, Recording, Selection};
use numpy::{AllowTypeChange, PyArrayLike1};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PySequence, PyString};
use std::fmt::Write as _;
use std::path::PathBuf;

/// The recordings with their notices, one sentence each.
pub(crate) struct Read {
    pub(crate) recordings: Vec<Recording>,
    pub(crate) notices: Vec<String>,
}

/// A notice that looks like a broken convention is an error, unless the person knows better.
pub(crate) fn refuse_suspicion(notice: &Notice, accepted: bool) -> PyResult<()> {
    if notice.kind.is_suspicion() && !accepted {
        return Err(error::recording(format!(
            "{notice}; mend the recording, or pass accept_suspicious=True if it is right as it is"
        )));
    }
    Ok(())
}

/// What of each recording is used, as Python's keywords say it.
pub(crate) fn selection(every: usize, span: Option<(f64, f64)>) -> Selection {
    Selection {
        every,
        span: span.map(|(from, to)| from..to),
    }
}

/// Reads one recording or a sequence of them, each a path or a mapping of columns.
pub(crate) fn read(
    given: &Bound<'_, PyAny>,
    selection: &Selection,
    accept_suspicious: bool,
) -> PyResult<Read> {
    let one = given.is_instance_of::<PyString>()
        || given.is_instance_of::<PyDict>()
        || given.hasattr("__fspath__")?;
    let all: Vec<Bound<'_, PyAny>> = if one {
        vec![given.clone()]
    } else {
        given
            .cast::<PySequence>()
            .map_err(|_| wrong_type(given))?
            .try_iter()?
            .collect::<PyResult<_>>()?
    };
    let mut read = Read {
        recordings: Vec::new(),
        notices: Vec::new(),
    };
    for (i, item) in all.iter().enumerate() {
        let (recording, notices) = if let Ok(columns) = item.cast::<PyDict>() {
            let name = format!("recording-{i}");
            let csv = csv(&name, columns)?;
            Recording::from_csv(&name, csv.as_bytes())
        } else {
            let path: PathBuf = item.extract().map_err(|_| wrong_type(item))?;
            Recording::load_with_notices(path)
        }
        .map_err(error::recording)?;
        for notice in &notices {
            refuse_suspicion(notice, accept_suspicious)?;
        }
        read.notices
            .extend(notices.iter().map(|n| format!("{}: {n}", recording.name)));
        let selected = recording.select(selection).map_err(error::recording)?;
        read.recordings.push(selected);
    }
    Ok(read)
}

fn wrong_type(given: &Bound<'_, PyAny>) -> PyErr {
    let kind = given
        .get_type()
        .name()
        .map_or_else(|_| "?".to_owned(), |n| n.to_string());
    PyTypeError::new_err(format!(
        "a recording is a path or a dict of arrays t, u, theta, alpha; several are a list of these; got {kind}"
    ))
}

/// Columns as a CSV file's text, so that they meet the same checks and the same messages as a file. Rust prints the shortest
/// decimal that reads back equal: nothing is lost.
fn csv(name: &str, columns: &Bound<'_, PyDict>) -> PyResult<String> {
    let mut header = Vec::new();
    let mut values: Vec<Vec<f64>> = Vec::new();
    for (key, column) in columns {
        let key: String = key.extract()?;
        let column: PyArrayLike1<'_, f64, AllowTypeChange> = column.extract().map_err(|e| {
            error::recording(format!(
                "{name}: column `{key}` must be a one-dimensional array of numbers ({e})"
            ))
        })?;
        let column: Vec<f64> = column.as_array().iter().copied().collect();
        if let Some(first) = values.first()
            && first.len() != column.len()
        {
            return Err(error::recording(format!(
                "{name}: column `{key}` has {} values, column `{}` has {}",
                column.len(),
                header[0],
                first.len()
            )));
        }
        header.push(key);
        values.push(column);
    }
    let mut text = header.join(",") + "\n";
    for row in 0..values.first().map_or(0, Vec::len) {
        for (i, column) in values.iter().enumerate() {
            let comma = if i == 0 { "" } else { "," };
            // Writing to a String cannot fail.
            let _ = write!(text, "{comma}{}", column[row]);
        }
        text.push('\n');
    }
    Ok(text)
}
