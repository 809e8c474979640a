//! MCAP: logs of `furuta run`, and recordings written in the same form.
//!
//! A recording is one JSON message a sample on the topic of [`furuta_log`], with the fields of its [`Record`] and
//! further ones for the columns that a record does not have. Any reader of logs reads such a file; the columns that the
//! recording really has are listed in the metadata, since a record has no way to leave a field out.

use std::collections::BTreeMap;
use std::io::Read;

use furuta_input::Limits;
use furuta_log::{FIELDS, Metadata, Part, Record};
use serde_json::{Map, Value};

use super::budget::Budget;
use super::trouble::Trouble;
use super::{Column, NoticeKind, RecordingError, Table, Values};

/// Metadata that lists the columns of a converted recording, as a JSON array.
pub(super) const COLUMNS: &str = "columns";
/// Metadata that holds the comments of a converted CSV file.
pub(super) const COMMENTS: &str = "comments";
pub(super) const STATE: [&str; 6] = ["t", "u", "theta", "alpha", "theta_dot", "alpha_dot"];

pub(super) fn is_mcap(bytes: &[u8]) -> bool {
    bytes.starts_with(::mcap::MAGIC)
}

/// The table of a log's first `keep` samples, and a notice where the log ends early.
pub(super) fn parse(
    file: &str,
    input: impl Read,
    limits: &Limits,
    keep: usize,
) -> Result<(Table, Option<NoticeKind>), RecordingError> {
    let mut metadata: Option<Metadata> = None;
    let mut samples = Samples::new(file, limits);
    let ended = furuta_log::each_part(input, limits, |part| {
        match part {
            Part::Metadata(found) => {
                samples.listed = listed(&found);
                metadata = Some(found);
            }
            Part::Sample(_) if samples.rows == keep => return Err(Trouble::Enough),
            Part::Sample(json) => samples.push(json)?,
            _ => {}
        }
        Ok(())
    });
    let ending = match ended {
        Ok(ending) => ending,
        Err(Trouble::Enough) => None,
        Err(trouble) => return Err(trouble.of(file)),
    };
    let until = samples.state.first().and_then(|t| t.last().copied());
    let notice = ending.map(|ending| NoticeKind::CutOff {
        what: ending.after(samples.rows, until).to_string(),
    });
    Ok((samples.into_table(metadata.unwrap_or_default()), notice))
}

/// The columns that are a converted recording's own; `None` for the log of a run, which has every field of a record.
pub(super) fn listed(metadata: &Metadata) -> Option<Vec<String>> {
    let names = metadata.extra.get(COLUMNS)?;
    serde_json::from_str(names).ok()
}

/// The samples while they are read.
struct Samples<'a> {
    file: &'a str,
    budget: Budget<'a>,
    limit: usize,
    listed: Option<Vec<String>>,
    rows: usize,
    state: [Vec<f64>; 6],
    further: Vec<Further>,
    places: BTreeMap<String, usize>,
}

impl<'a> Samples<'a> {
    fn new(file: &'a str, limits: &Limits) -> Self {
        let mut samples = Self {
            file,
            budget: Budget::new(file, limits),
            limit: limits.names,
            listed: None,
            rows: 0,
            state: Default::default(),
            further: Vec::new(),
            places: BTreeMap::new(),
        };
        // Those of a record come first, in their order.
        for field in FIELDS.iter().filter(|field| !STATE.contains(&field.name)) {
            samples.add(field.name);
        }
        samples
    }

    fn add(&mut self, name: &str) -> usize {
        let place = self.further.len();
        self.places.insert(name.to_owned(), place);
        self.further.push(Further {
            name: name.to_owned(),
            values: Values::Numbers(Vec::new()),
            whole: true,
        });
        place
    }

    fn has(&self, name: &str) -> bool {
        let listed = self.listed.as_ref();
        listed.is_none_or(|listed| listed.iter().any(|column| column == name))
    }

    fn push(&mut self, json: &[u8]) -> Result<(), Trouble> {
        let index = self.rows;
        let bad = |cause| furuta_log::LogError::BadRecord { index, cause };
        let record: Record = serde_json::from_slice(json).map_err(bad)?;
        let fields: Map<String, Value> = serde_json::from_slice(json).map_err(bad)?;
        let state = [
            record.t,
            record.u,
            record.theta,
            record.alpha,
            record.theta_dot,
            record.alpha_dot,
        ];
        for (i, ((values, value), name)) in self.state.iter_mut().zip(state).zip(STATE).enumerate()
        {
            // Speeds may be unknown.
            if i < 4 && !value.is_finite() {
                return Err(Trouble::Recording(RecordingError::NotFinite {
                    file: self.file.into(),
                    row: index + 1,
                    column: name.into(),
                    value,
                }));
            }
            values.push(value);
        }
        let mut memory = size_of_val(&state) + size_of::<usize>();
        for (name, value) in fields {
            if STATE.contains(&name.as_str()) || !self.has(&name) {
                continue;
            }
            let place = match self.places.get(&name) {
                Some(&place) => place,
                None if self.further.len() >= self.limit => {
                    return Err(Trouble::Recording(RecordingError::TooManyColumns {
                        file: self.file.into(),
                        found: self.further.len() + 1,
                        limit: self.limit,
                    }));
                }
                None => self.add(&name),
            };
            if let Some(column) = self.further.get_mut(place) {
                memory += column.push(index, value);
            }
        }
        self.rows += 1;
        self.budget.take(memory).map_err(Trouble::Recording)
    }

    fn into_table(mut self, mut metadata: Metadata) -> Table {
        let rows = self.rows;
        metadata.extra.remove(COLUMNS);
        let comments = metadata.extra.remove(COMMENTS);
        let comments = comments.map(|text| text.lines().map(Into::into).collect());
        let mut further = metadata.extra;
        for (key, value) in [
            ("rig", metadata.rig),
            ("controller", metadata.controller),
            ("software", metadata.software),
        ] {
            if !value.is_empty() {
                further.insert(key.into(), value);
            }
        }
        let columns = core::mem::take(&mut self.further);
        let extra = columns
            .into_iter()
            .filter(|column| self.has(&column.name))
            .map(|column| column.finished(rows))
            .collect();
        let [t, u, theta, alpha, theta_dot, alpha_dot] = core::mem::take(&mut self.state);
        let speed = |name, values: Vec<f64>| self.has(name).then_some(values);
        Table {
            file: self.file.into(),
            t,
            u,
            theta,
            alpha,
            theta_dot: speed("theta_dot", theta_dot),
            alpha_dot: speed("alpha_dot", alpha_dot),
            extra,
            rows: (1..=rows).collect(),
            rig: (!metadata.rig_file.is_empty()).then_some(metadata.rig_file),
            metadata: further,
            comments: comments.unwrap_or_default(),
        }
    }
}

/// A field that is not of the state, in every message so far.
struct Further {
    name: String,
    values: Values,
    /// Whether all numbers so far were written as whole ones.
    whole: bool,
}

impl Further {
    /// The value in message `row`, and nothing in those before that had none; the memory that this takes.
    fn push(&mut self, row: usize, value: Value) -> usize {
        let number = matches!(value, Value::Number(_) | Value::Null);
        if !number && let Values::Numbers(numbers) = &self.values {
            let whole = self.whole;
            let text = |value: &f64| match value {
                value if value.is_nan() => String::new(),
                value if whole => format!("{value:.0}"),
                value => Value::from(*value).to_string(),
            };
            self.values = Values::Text(numbers.iter().map(text).collect());
        }
        let before = self.len();
        match &mut self.values {
            Values::Numbers(numbers) => {
                self.whole &= !value.is_f64();
                numbers.resize(row, f64::NAN);
                numbers.push(value.as_f64().unwrap_or(f64::NAN));
                (row + 1 - before) * size_of::<f64>()
            }
            Values::Text(texts) => {
                texts.resize(row, String::new());
                let text = match value {
                    Value::String(text) => text,
                    Value::Null => String::new(),
                    other => other.to_string(),
                };
                let length = text.len();
                texts.push(text);
                (row + 1 - before) * size_of::<String>() + length
            }
        }
    }

    fn len(&self) -> usize {
        match &self.values {
            Values::Numbers(numbers) => numbers.len(),
            Values::Text(texts) => texts.len(),
        }
    }

    fn finished(mut self, rows: usize) -> Column {
        match &mut self.values {
            Values::Numbers(numbers) => numbers.resize(rows, f64::NAN),
            Values::Text(texts) => texts.resize(rows, String::new()),
        }
        Column {
            name: self.name,
            values: self.values,
        }
    }
}
