//! Recordings given from Python: paths of files, or columns as arrays.

use crate::arguments::kind;
use crate::error;
use crate::forked::here;
use crate::matrix::vector;
use furuta_ident::Pendulum;
use furuta_ident::recording::{
    Command, Excerpt, Notice, NoticeKind, Recording, RecordingError, Values,
};
use furuta_ident::selection::{Read, SelectionError, read_unseen, select};
use furuta_input::shown;
use furuta_model::Rig;
use numpy::{PyReadonlyArray1, ToPyArray};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PySequence, PyString};
use std::borrow::Cow;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// The recordings that are used, with notices, one sentence each.
pub(crate) struct Chosen {
    pub(crate) recordings: Vec<Recording>,
    pub(crate) verify: Vec<Recording>,
    pub(crate) notices: Vec<String>,
}

/// What the pendulum did in recordings, by its word.
pub(crate) fn state(word: &str) -> PyResult<Pendulum> {
    word.parse()
        .map_err(|e| PyValueError::new_err(format!("pendulum: {e}")))
}

/// What is used of the recordings given for a search and for verification: suspicious ones are left out where the
/// others suffice, unless the person knows
/// better.
pub(crate) fn choose(
    (search, verify): (&Bound<'_, PyAny>, Option<&Bound<'_, PyAny>>),
    (rig, pendulum): (&Rig, Pendulum),
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
    let selection =
        here(|| select(seen, unseen, rig, accept_suspicious, pendulum)).map_err(|e| match e {
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
pub(crate) fn selection(
    every: usize,
    span: Option<(f64, f64)>,
    command: &str,
) -> PyResult<Excerpt> {
    let command: Command = command
        .parse()
        .map_err(|e| PyValueError::new_err(format!("command: {e}")))?;
    Ok(Excerpt {
        every,
        span: span.map(|(from, to)| from..to),
        command,
    })
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

/// Reads one recording, a sequence of them or a mapping of names to them, each a path or a mapping of columns, by their
/// names.
fn each(given: &Bound<'_, PyAny>) -> PyResult<Vec<(String, Result<Read, RecordingError>)>> {
    type Item<'py> = (Option<String>, Bound<'py, PyAny>);
    let all: Vec<Item<'_>> = if let Some(named) = named(given)? {
        let of = |(name, item): (Bound<'_, PyAny>, _)| Ok((Some(name.extract()?), item));
        named.iter().map(of).collect::<PyResult<_>>()?
    } else if is_path(given)? || given.hasattr(CHECKED)? || columns(given)?.is_some() {
        vec![(None, given.clone())]
    } else {
        given
            .cast::<PySequence>()
            .map_err(|_| wrong_type(given))?
            .try_iter()?
            .map(|item| Ok((None, item?)))
            .collect::<PyResult<_>>()?
    };
    all.iter()
        .enumerate()
        .map(|(i, (key, item))| {
            if let Some(read) = Checked::of(item, key.as_deref())? {
                return Ok(read);
            }
            if is_path(item)? {
                let path: PathBuf = item.extract().map_err(|_| wrong_type(item))?;
                return Ok((shown(&path), Recording::load_with_notices(path)));
            }
            let columns = columns(item)?.ok_or_else(|| wrong_type(item))?;
            let own = || item.getattr("name").and_then(|name| name.extract());
            let name = key.clone().map_or_else(own, Ok);
            let name = name.unwrap_or_else(|_| format!("recording-{i}"));
            let read = from_columns(&name, &columns)?;
            Ok((name, read))
        })
        .collect()
}

fn is_path(given: &Bound<'_, PyAny>) -> PyResult<bool> {
    Ok(given.is_instance_of::<PyString>() || given.hasattr("__fspath__")?)
}

/// The columns of what is no file: `furuta._columns.columns`.
fn columns<'py>(given: &Bound<'py, PyAny>) -> PyResult<Option<Bound<'py, PyDict>>> {
    found(given, "columns")
}

/// Recordings by name, where it is a mapping of these: `furuta._columns.recordings`.
fn named<'py>(given: &Bound<'py, PyAny>) -> PyResult<Option<Bound<'py, PyDict>>> {
    found(given, "recordings")
}

/// What a function of `furuta._columns` finds.
fn found<'py>(given: &Bound<'py, PyAny>, function: &str) -> PyResult<Option<Bound<'py, PyDict>>> {
    let module = given.py().import("furuta._columns")?;
    Ok(module.call_method1(function, (given,))?.extract()?)
}

fn wrong_type(given: &Bound<'_, PyAny>) -> PyErr {
    PyTypeError::new_err(format!(
        "a recording is a path, a furuta.Recording, a pandas DataFrame or a dict of arrays t, u, theta, alpha; several \
         are a list of these, or a dict of them by name; got {}",
        kind(given)
    ))
}

/// Of a text, the header's row and the first sample's: what a sample's row is beyond its index.
const ROWS_OF_TEXT: usize = 2;
/// The same where samples are counted from 1.
const ROWS_OF_SAMPLES: usize = 1;

/// The same with indices, counted from 0, where rows would be named; `rows_before` of them are before index 0.
fn by_index(
    read: Result<Read, RecordingError>,
    rows_before: usize,
) -> Result<Read, RecordingError> {
    let index = |row: &mut usize| *row = row.saturating_sub(rows_before);
    match read {
        Ok((recording, mut notices)) => {
            for notice in &mut notices {
                match &mut notice.kind {
                    NoticeKind::DuplicatedRows { rows }
                    | NoticeKind::Gaps { rows }
                    | NoticeKind::IrregularIntervals { rows, .. }
                    | NoticeKind::Spikes { rows, .. }
                    | NoticeKind::ShortSegments { rows, .. } => rows.iter_mut().for_each(index),
                    NoticeKind::Gap { row, .. }
                    | NoticeKind::Unwrapped { row, .. }
                    | NoticeKind::Jump { row, .. } => index(row),
                    _ => {}
                }
            }
            Ok((recording, notices))
        }
        Err(mut error) => {
            match &mut error {
                RecordingError::NotANumber { row, .. }
                | RecordingError::NotFinite { row, .. }
                | RecordingError::TimeBackwards { row, .. }
                | RecordingError::TimeStandsStill { row, .. }
                | RecordingError::IrregularTime { row, .. } => index(row),
                _ => {}
            }
            Err(error)
        }
    }
}

/// The columns that every recording has.
const REQUIRED: [&str; 4] = ["t", "u", "theta", "alpha"];

/// A recording of columns, with the checks and messages of a file.
fn from_columns(name: &str, columns: &Bound<'_, PyDict>) -> PyResult<Result<Read, RecordingError>> {
    if columns.is_empty() {
        return Err(error::recording(format!(
            "{name}: there are no columns; required are {}",
            REQUIRED.join(", ")
        )));
    }
    let (header, given) = read_columns(name, columns)?;
    let place = |key| header.iter().position(|k| k == key);
    // Nothing but these, and nothing that a message would have to quote: no text needs to be made of them.
    let numbers: Vec<&[f64]> = given.iter().filter_map(Given::finite).collect();
    if let ([Some(t), Some(u), Some(theta), Some(alpha)], 4) = (REQUIRED.map(place), numbers.len())
        && header.len() == numbers.len()
        && !numbers[t].is_empty()
    {
        let sample = |k: usize| [t, u, theta, alpha].map(|column| numbers[column][k]);
        let samples = (0..numbers[t].len()).map(sample);
        let read = Recording::from_samples(name, samples);
        return Ok(by_index(read, ROWS_OF_SAMPLES));
    }
    let read = Recording::from_csv(name, csv(&header, &given).as_bytes());
    Ok(by_index(read, ROWS_OF_TEXT))
}

/// The values of a column that was given.
enum Given {
    Numbers(Vec<f64>),
    Text(Vec<String>),
}

impl Given {
    fn len(&self) -> usize {
        match self {
            Self::Numbers(values) => values.len(),
            Self::Text(values) => values.len(),
        }
    }

    /// The numbers, where all are finite.
    fn finite(&self) -> Option<&[f64]> {
        match self {
            Self::Numbers(values) if values.iter().all(|x| x.is_finite()) => Some(values),
            _ => None,
        }
    }

    /// As the field of a row.
    fn write(&self, row: usize, text: &mut String) {
        match self {
            // Rust prints the shortest decimal that reads back equal; writing to a String cannot fail.
            Self::Numbers(values) => drop(write!(text, "{}", values[row])),
            Self::Text(values) => text.push_str(&field(&values[row])),
        }
    }
}

/// Names and values of the columns; all have one length. Those that every recording has are numbers, others may be
/// text.
fn read_columns(name: &str, columns: &Bound<'_, PyDict>) -> PyResult<(Vec<String>, Vec<Given>)> {
    let mut header = Vec::new();
    let mut values: Vec<Given> = Vec::new();
    for (key, column) in columns {
        let key = key.str()?.to_string();
        let called = format!("{name}: column `{key}`");
        let numbers = vector::<f64>(&called, &column, error::recording);
        let column = match numbers {
            Ok(numbers) => Given::Numbers(numbers),
            Err(error) if REQUIRED.contains(&key.as_str()) => return Err(error),
            Err(error) => Given::Text(text(&column)?.ok_or(error)?),
        };
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
    Ok((header, values))
}

/// The values of a column of text: `furuta._columns.text`.
fn text(column: &Bound<'_, PyAny>) -> PyResult<Option<Vec<String>>> {
    let module = column.py().import("furuta._columns")?;
    module.call_method1("text", (column,))?.extract()
}

/// Columns as a CSV file's text, so that they meet the same checks and the same messages as a file: nothing is lost.
fn csv(header: &[String], values: &[Given]) -> String {
    let mut text = String::new();
    for (i, key) in header.iter().enumerate() {
        text.push_str(if i == 0 { "" } else { "," });
        text.push_str(&field(key));
    }
    text.push('\n');
    for row in 0..values.first().map_or(0, Given::len) {
        for (i, column) in values.iter().enumerate() {
            text.push_str(if i == 0 { "" } else { "," });
            column.write(row, &mut text);
        }
        text.push('\n');
    }
    text
}

/// A field of a CSV file, of one line.
fn field(text: &str) -> Cow<'_, str> {
    if text.contains([',', '"', '\n', '\r', '#']) {
        Cow::Owned(format!(
            "\"{}\"",
            text.replace(['\n', '\r'], " ").replace('"', "\"\"")
        ))
    } else {
        Cow::Borrowed(text)
    }
}

/// Where a `furuta.Recording` keeps its [`Checked`], and where its columns.
const CHECKED: &str = "_checked";
const COLUMNS: &str = "_columns";

/// What a `furuta.Recording` was when it was made, so that no function that takes it checks it again.
#[pyclass(frozen, name = "_Checked", module = "furuta._furuta")]
pub(crate) struct Checked {
    name: String,
    recording: Recording,
    notices: Vec<Notice>,
}

impl Checked {
    /// The recording that `item` was made as, by its name or `key`, if it is a `furuta.Recording` whose columns still
    /// hold the same numbers: they are arrays, and may have been written to since.
    fn of(
        item: &Bound<'_, PyAny>,
        key: Option<&str>,
    ) -> PyResult<Option<(String, Result<Read, RecordingError>)>> {
        let Ok(kept) = item.getattr(CHECKED) else {
            return Ok(None);
        };
        let (Ok(kept), Ok(columns)) = (kept.cast::<Self>(), item.getattr(COLUMNS)) else {
            return Ok(None);
        };
        let (kept, Ok(columns)) = (kept.get(), columns.cast::<PyDict>()) else {
            return Ok(None);
        };
        if !kept.holds(columns)? {
            return Ok(None);
        }
        let name = key.map_or_else(|| item.getattr("name")?.extract(), |key| Ok(key.to_owned()))?;
        let (mut recording, mut notices) = (kept.recording.clone(), kept.notices.clone());
        if name != kept.name {
            let file = Path::new(&name).file_name();
            recording.name = file.map_or_else(|| name.clone(), |f| f.to_string_lossy().into());
            for notice in &mut notices {
                notice.file.clone_from(&name);
            }
        }
        Ok(Some((name, Ok((recording, notices)))))
    }

    /// Whether these are its columns, number by number.
    fn holds(&self, columns: &Bound<'_, PyDict>) -> PyResult<bool> {
        let expected = numbers_of(&self.recording);
        if columns.len() != expected.len() + texts_of(&self.recording).count() {
            return Ok(false);
        }
        for (name, values) in expected {
            let Some(found) = columns.get_item(name)? else {
                return Ok(false);
            };
            let Ok(found) = found.extract::<PyReadonlyArray1<'_, f64>>() else {
                return Ok(false);
            };
            let same = |found: &[f64]| {
                let bits = |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits();
                found.len() == values.len() && found.iter().zip(values).all(bits)
            };
            if !found.as_slice().is_ok_and(same) {
                return Ok(false);
            }
        }
        for (name, values) in texts_of(&self.recording) {
            let found = columns.get_item(name)?;
            let found = found.and_then(|found| found.extract::<Vec<String>>().ok());
            if found.is_none_or(|found| found != *values) {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

/// A recording's columns of numbers, those that every recording has first.
fn numbers_of(recording: &Recording) -> Vec<(&str, &Vec<f64>)> {
    let required = [
        &recording.t,
        &recording.u,
        &recording.theta,
        &recording.alpha,
    ];
    let speeds = [
        ("theta_dot", recording.theta_dot.as_ref()),
        ("alpha_dot", recording.alpha_dot.as_ref()),
    ];
    let speeds = speeds.into_iter().filter_map(|(k, v)| Some((k, v?)));
    let further = recording.extra.iter().filter_map(|c| match &c.values {
        Values::Numbers(values) => Some((c.name.as_str(), values)),
        Values::Text(_) => None,
    });
    let required = REQUIRED.into_iter().zip(required);
    required.chain(speeds).chain(further).collect()
}

/// Its columns of text.
fn texts_of(recording: &Recording) -> impl Iterator<Item = (&str, &Vec<String>)> {
    recording.extra.iter().filter_map(|c| match &c.values {
        Values::Text(values) => Some((c.name.as_str(), values)),
        Values::Numbers(_) => None,
    })
}

/// A recording with everything that is known of it: for `furuta.Recording`.
///
/// Its name, its columns, notices, one sentence each, and what it is when functions take it.
#[pyfunction]
pub(crate) fn _read_recording<'py>(
    py: Python<'py>,
    given: &Bound<'py, PyAny>,
) -> PyResult<(String, Bound<'py, PyDict>, Vec<String>, Checked)> {
    let mut all = each(given)?;
    let (Some((name, read)), true) = (all.pop(), all.is_empty()) else {
        return Err(wrong_type(given));
    };
    let (recording, notices) = read.map_err(error::recording)?;
    let columns = PyDict::new(py);
    let required = [
        &recording.t,
        &recording.u,
        &recording.theta,
        &recording.alpha,
    ];
    for (key, values) in REQUIRED.into_iter().zip(required) {
        columns.set_item(key, values.to_pyarray(py))?;
    }
    let speeds = [
        ("theta_dot", &recording.theta_dot),
        ("alpha_dot", &recording.alpha_dot),
    ];
    for (key, values) in speeds {
        if let Some(values) = values {
            columns.set_item(key, values.to_pyarray(py))?;
        }
    }
    for column in &recording.extra {
        match &column.values {
            Values::Numbers(values) => columns.set_item(&column.name, values.to_pyarray(py))?,
            Values::Text(values) => columns.set_item(&column.name, values)?,
        }
    }
    Ok((
        name.clone(),
        columns,
        notices.iter().map(ToString::to_string).collect(),
        Checked {
            name,
            recording,
            notices,
        },
    ))
}
