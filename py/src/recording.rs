//! Recordings given from Python: paths of files, or columns as arrays.

use crate::error;
use furuta_ident::recording::{Excerpt, Notice, Recording, RecordingError};
use furuta_ident::selection::{Read, SelectionError, read_unseen, select};
use furuta_input::shown;
use furuta_model::Rig;
use numpy::{AllowTypeChange, PyArrayLike1};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PySequence, PyString};
use std::fmt::Write as _;
use std::path::PathBuf;

/// The recordings that are used, with notices, one sentence each.
pub(crate) struct Chosen {
    pub(crate) recordings: Vec<Recording>,
    pub(crate) verify: Vec<Recording>,
    pub(crate) notices: Vec<String>,
}

/// What is used of the recordings given for a search and for verification: suspicious ones are left out where the
/// others suffice, unless the person knows
/// better.
pub(crate) fn choose(
    search: &Bound<'_, PyAny>,
    verify: Option<&Bound<'_, PyAny>>,
    rig: &Rig,
    selection: &Excerpt,
    accept_suspicious: bool,
) -> PyResult<Chosen> {
    let part = |(recording, notices): Read| Ok((recording.select(selection)?, notices));
    let (mut seen, mut unseen, mut unreadable) = (Vec::new(), Vec::new(), Vec::new());
    for (_, read) in each(search)? {
        seen.push(read.and_then(part).map_err(error::recording)?);
    }
    if let Some(given) = verify {
        for (name, read) in each(given)? {
            let read = read.and_then(part);
            let read = read_unseen(&name, read, &mut unreadable).map_err(error::recording)?;
            unseen.extend(read);
        }
    }
    let selection = select(seen, unseen, rig, accept_suspicious).map_err(|e| match e {
        SelectionError::Suspicious(notice) => suspicious(&notice),
        other => error::recording(other),
    })?;
    let notices = unreadable.iter().chain(&selection.notices);
    Ok(Chosen {
        notices: notices.map(ToString::to_string).collect(),
        recordings: selection.recordings,
        verify: selection.verify,
    })
}

/// What of each recording is used, as Python's keywords say it.
pub(crate) fn selection(every: usize, span: Option<(f64, f64)>) -> Excerpt {
    Excerpt {
        every,
        span: span.map(|(from, to)| from..to),
    }
}

/// Recordings of a rig that is not known, with notices, one sentence each: none may be suspicious, unless the person
/// knows better.
pub(crate) fn read(
    given: &Bound<'_, PyAny>,
    accept_suspicious: bool,
) -> PyResult<(Vec<Recording>, Vec<String>)> {
    let (mut recordings, mut said) = (Vec::new(), Vec::new());
    for (_, read) in each(given)? {
        let (recording, notices) = read.map_err(error::recording)?;
        let refused = notices.iter().find(|n| n.kind.is_suspicion());
        if let Some(notice) = refused.filter(|_| !accept_suspicious) {
            return Err(suspicious(notice));
        }
        said.extend(notices.iter().map(ToString::to_string));
        recordings.push(recording);
    }
    Ok((recordings, said))
}

fn suspicious(notice: &Notice) -> PyErr {
    error::recording(format!(
        "{notice}; mend the recording, or pass accept_suspicious=True if it is right as it is"
    ))
}

/// Reads one recording or a sequence of them, each a path or a mapping of columns, by their names.
fn each(given: &Bound<'_, PyAny>) -> PyResult<Vec<(String, Result<Read, RecordingError>)>> {
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
    all.iter()
        .enumerate()
        .map(|(i, item)| {
            if let Ok(columns) = item.cast::<PyDict>() {
                let name = format!("recording-{i}");
                let csv = csv(&name, columns)?;
                let read = Recording::from_csv(&name, csv.as_bytes());
                Ok((name, read))
            } else {
                let path: PathBuf = item.extract().map_err(|_| wrong_type(item))?;
                let name = shown(&path);
                Ok((name, Recording::load_with_notices(path)))
            }
        })
        .collect()
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

/// Columns as a CSV file's text, so that they meet the same checks and the same messages as a file. Rust prints the
/// shortest decimal that reads back equal: nothing is lost.
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
