//! CSV: read strictly, written so that reading it again gives the same recording.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, BufRead, Write};
use std::path::Path;

use furuta_file::{FileError, WholeFile};
use furuta_input::Limits;

use super::budget::Budget;
use super::lines::{Line, Lines};
use super::{Column, Recording, RecordingError, Table, Values};

/// The columns that a recording needs.
pub(super) const REQUIRED: [&str; 4] = ["t", "u", "theta", "alpha"];
const SPEEDS: [&str; 2] = ["theta_dot", "alpha_dot"];
/// A comment that carries a line of the rig file starts with this.
const RIG_LINE: &str = "rig| ";

/// Reads a whole file and checks every field, but keeps the first `keep` samples only.
pub(super) fn parse(
    file: &str,
    input: impl BufRead,
    limits: &Limits,
    keep: usize,
) -> Result<(Table, Through), RecordingError> {
    let mut budget = Budget::new(file, limits);
    let mut header = None;
    let mut rows = Vec::new();
    let mut through = Through::default();
    let mut comments = Vec::new();
    each_row(file, input, limits, &mut |part| match part {
        Part::Comment(text) => {
            budget.take(text.len() + size_of::<String>())?;
            comments.push(text.to_owned());
            Ok(())
        }
        Part::Header(row, names) => {
            header = Some(Columns::new(file, row, names, limits)?);
            Ok(())
        }
        Part::Row(row, fields) => {
            let Some(columns) = &mut header else {
                return Ok(());
            };
            let kept = through.samples < keep;
            let taken = columns.push(file, row, fields, kept)?;
            if kept {
                budget.take(taken + size_of::<usize>())?;
                rows.push(row);
            }
            through.goes_on(file, row, columns.time(), fields, kept)
        }
    })?;
    let Some(columns) = header else {
        return Err(RecordingError::Empty { file: file.into() });
    };
    let (rig, comments) = rig_in_comments(comments);
    through.columns = columns.kinds();
    let table = columns.into_table(file, rows, rig, comments);
    Ok((table, through))
}

/// What is known of a file once it was read through.
#[derive(Default)]
pub(super) struct Through {
    /// Rows of data.
    pub(super) samples: usize,
    /// First and last time stamp, s.
    pub(super) time: [f64; 2],
    /// Name of each column in the order of the file, and whether all its fields are numbers.
    pub(super) columns: Vec<(String, bool)>,
    last: String,
}

impl Through {
    /// Time must go on where the checks of what was kept do not look; a row may repeat the one before.
    fn goes_on(
        &mut self,
        file: &str,
        row: usize,
        t: f64,
        fields: &[Cow<'_, str>],
        kept: bool,
    ) -> Result<(), RecordingError> {
        let [first, before] = self.time;
        if self.samples > 0 && !kept && t <= before {
            if t < before {
                return Err(RecordingError::TimeBackwards {
                    file: file.into(),
                    row,
                    before,
                    t,
                });
            }
            if self.last != fields.join(",") {
                return Err(RecordingError::TimeStandsStill {
                    file: file.into(),
                    row,
                    t,
                });
            }
        }
        if !kept {
            self.last.clear();
            for field in fields {
                self.last.push_str(field);
                self.last.push(',');
            }
            self.last.pop();
        }
        self.time = [if self.samples == 0 { t } else { first }, t];
        self.samples += 1;
        Ok(())
    }
}

/// A part of a CSV file, in the order of the file: comments anywhere, one header, rows with as many fields.
pub(super) enum Part<'a> {
    Comment(&'a str),
    Header(usize, &'a [Cow<'a, str>]),
    Row(usize, &'a [Cow<'a, str>]),
}

/// Goes through a CSV file.
pub(super) fn each_row(
    file: &str,
    input: impl BufRead,
    limits: &Limits,
    each: &mut dyn FnMut(Part<'_>) -> Result<(), RecordingError>,
) -> Result<(), RecordingError> {
    let mut lines = Lines::new(file, input, limits)?;
    let mut expected = None;
    while let Some((row, line)) = lines.next()? {
        let line = match line {
            Line::Comment(text) => {
                each(Part::Comment(text))?;
                continue;
            }
            Line::Data(line) => line,
        };
        let fields = fields(file, row, line)?;
        match expected {
            None => {
                expected = Some(fields.len());
                each(Part::Header(row, &fields))?;
            }
            Some(expected) if fields.len() != expected => {
                return Err(RecordingError::FieldCount {
                    file: file.into(),
                    row,
                    found: fields.len(),
                    expected,
                });
            }
            Some(_) => each(Part::Row(row, &fields))?,
        }
    }
    Ok(())
}

/// The fields of a line, without the blanks about them.
fn fields<'a>(file: &str, row: usize, line: &'a str) -> Result<Vec<Cow<'a, str>>, RecordingError> {
    if !line.contains('"') {
        return Ok(line.split(',').map(|field| field.trim().into()).collect());
    }
    if line.bytes().filter(|&byte| byte == b'"').count() % 2 == 1 {
        return Err(RecordingError::OpenQuote {
            file: file.into(),
            row,
        });
    }
    let mut reader = ::csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .from_reader(line.as_bytes());
    // Quotes close within the line: what the reader could still object to does not occur, but is not trusted.
    let record = reader.records().next().transpose();
    let record = record.map_err(|error| RecordingError::Log {
        file: file.into(),
        reason: format!("row {row}: {error}"),
    })?;
    let fields = record.unwrap_or_default();
    Ok(fields
        .iter()
        .map(|field| field.trim().to_owned().into())
        .collect())
}

/// The columns while a file is read.
struct Columns {
    names: Vec<String>,
    kinds: Vec<Kind>,
    /// Places of t, u, theta and alpha.
    required: [usize; 4],
    last_time: f64,
}

enum Kind {
    /// A number in every row.
    Measured(Vec<f64>),
    /// A number, or nothing.
    Speed(Vec<f64>),
    /// As it stands, until the file's end tells whether all are numbers.
    Further(Texts, bool),
}

impl Columns {
    fn new(
        file: &str,
        row: usize,
        names: &[Cow<'_, str>],
        limits: &Limits,
    ) -> Result<Self, RecordingError> {
        let names: Vec<&str> = names.iter().map(AsRef::as_ref).collect();
        let required = required_columns(file, row, &names)?;
        if names.len() > limits.names {
            return Err(RecordingError::TooManyColumns {
                file: file.into(),
                found: names.len(),
                limit: limits.names,
            });
        }
        let kind = |(i, name): (usize, &&str)| {
            if required.contains(&i) {
                Kind::Measured(Vec::new())
            } else if SPEEDS.contains(name) {
                Kind::Speed(Vec::new())
            } else {
                Kind::Further(Texts::default(), true)
            }
        };
        Ok(Self {
            kinds: names.iter().enumerate().map(kind).collect(),
            names: names.into_iter().map(Into::into).collect(),
            required,
            last_time: f64::NAN,
        })
    }

    /// Checks a row, keeps it if it shall be kept, and returns the memory that this takes.
    fn push(
        &mut self,
        file: &str,
        row: usize,
        fields: &[Cow<'_, str>],
        keep: bool,
    ) -> Result<usize, RecordingError> {
        let mut memory = 0;
        for (i, (kind, field)) in self.kinds.iter_mut().zip(fields).enumerate() {
            let name = || self.names.get(i).map_or("", String::as_str);
            let values = match kind {
                Kind::Measured(values) => {
                    let value = number_in(file, row, name, field, Unknown::Refused)?;
                    if self.required.first() == Some(&i) {
                        self.last_time = value;
                    }
                    (values, value)
                }
                Kind::Speed(values) => {
                    let value = number_in(file, row, name, field, Unknown::Kept)?;
                    (values, value)
                }
                Kind::Further(texts, numbers) => {
                    *numbers &= field.is_empty() || field.parse::<f64>().is_ok();
                    if keep {
                        texts.push(field);
                        memory += field.len() + size_of::<usize>();
                    }
                    continue;
                }
            };
            if keep {
                values.0.push(values.1);
                memory += size_of::<f64>();
            }
        }
        Ok(memory)
    }

    const fn time(&self) -> f64 {
        self.last_time
    }

    fn kinds(&self) -> Vec<(String, bool)> {
        let numbers = |kind: &Kind| !matches!(kind, Kind::Further(_, false));
        let kinds = self.kinds.iter().map(numbers);
        self.names.iter().cloned().zip(kinds).collect()
    }

    fn into_table(
        self,
        file: &str,
        rows: Vec<usize>,
        rig: Option<String>,
        comments: Vec<String>,
    ) -> Table {
        let mut measured = [const { Vec::new() }; 4];
        let mut speeds = [None, None];
        let mut extra = Vec::new();
        for (i, (name, kind)) in self.names.into_iter().zip(self.kinds).enumerate() {
            match kind {
                Kind::Measured(values) => {
                    let place = self.required.iter().position(|&at| at == i);
                    if let Some(column) = place.and_then(|place| measured.get_mut(place)) {
                        *column = values;
                    }
                }
                Kind::Speed(values) => {
                    let place = SPEEDS.iter().position(|speed| *speed == name);
                    if let Some(speed) = place.and_then(|place| speeds.get_mut(place)) {
                        *speed = Some(values);
                    }
                }
                Kind::Further(texts, numbers) => extra.push(Column {
                    name,
                    values: texts.into_values(numbers),
                }),
            }
        }
        let [t, u, theta, alpha] = measured;
        let [theta_dot, alpha_dot] = speeds;
        Table {
            file: file.into(),
            t,
            u,
            theta,
            alpha,
            theta_dot,
            alpha_dot,
            extra,
            rows,
            rig,
            metadata: BTreeMap::new(),
            comments,
        }
    }
}

/// Many short texts, without an allocation for each.
#[derive(Default)]
pub(super) struct Texts {
    text: String,
    ends: Vec<usize>,
}

impl Texts {
    pub(super) fn push(&mut self, text: &str) {
        self.text.push_str(text);
        self.ends.push(self.text.len());
    }

    fn iter(&self) -> impl Iterator<Item = &str> {
        let starts = core::iter::once(0).chain(self.ends.iter().copied());
        let spans = starts.zip(&self.ends);
        spans.map(|(start, &end)| self.text.get(start..end).unwrap_or_default())
    }

    /// As numbers (NaN where there is nothing), or as they are.
    pub(super) fn into_values(self, numbers: bool) -> Values {
        if numbers {
            let number = |field: &str| field.parse().unwrap_or(f64::NAN);
            Values::Numbers(self.iter().map(number).collect())
        } else {
            Values::Text(self.iter().map(Into::into).collect())
        }
    }
}

/// Indices of `t`, `u`, `theta`, `alpha`.
fn required_columns(file: &str, row: usize, names: &[&str]) -> Result<[usize; 4], RecordingError> {
    let numbers = names.iter().all(|name| name.parse::<f64>().is_ok());
    let mut seen = BTreeSet::new();
    for name in names.iter().filter(|_| !numbers) {
        if !seen.insert(name) {
            return Err(RecordingError::DuplicateColumn {
                file: file.into(),
                row,
                column: (*name).into(),
            });
        }
    }
    let mut indices = [0; 4];
    for (index, column) in indices.iter_mut().zip(REQUIRED) {
        *index = names
            .iter()
            .position(|name| *name == column)
            .ok_or_else(|| RecordingError::MissingColumn {
                file: file.into(),
                column,
                found: if names.len() == 1 {
                    format!("`{}`", names.join(""))
                } else {
                    names.join(", ")
                },
                hint: hint(names, column),
            })?;
    }
    Ok(indices)
}

fn hint(names: &[&str], column: &str) -> &'static str {
    let separated = |by: char| names.len() == 1 && names.iter().any(|name| name.contains(by));
    let bare = |name: &str| {
        name.split(['[', '(', ' '])
            .next()
            .unwrap_or_default()
            .trim()
            .to_lowercase()
    };
    if separated(';') || separated('\t') {
        "; separate the columns by commas (and write decimal points)"
    } else if names.iter().all(|name| name.parse::<f64>().is_ok()) {
        "; the first row holds numbers: put the header before it"
    } else if names.iter().any(|name| bare(name) == column) {
        "; names are lower case, without units"
    } else {
        ""
    }
}

/// What becomes of a value that is missing or not finite.
#[derive(Copy, Clone, PartialEq)]
enum Unknown {
    Refused,
    /// NaN where the field is empty.
    Kept,
}

fn number_in<'a>(
    file: &str,
    row: usize,
    column: impl FnOnce() -> &'a str,
    field: &str,
    unknown: Unknown,
) -> Result<f64, RecordingError> {
    match field.parse::<f64>() {
        Ok(value) if value.is_finite() || unknown == Unknown::Kept => Ok(value),
        Ok(value) => Err(RecordingError::NotFinite {
            file: file.into(),
            row,
            column: column().into(),
            value,
        }),
        Err(_) if field.is_empty() && unknown == Unknown::Kept => Ok(f64::NAN),
        Err(_) => Err(RecordingError::NotANumber {
            file: file.into(),
            row,
            column: column().into(),
            value: field.into(),
        }),
    }
}

pub(super) fn rig_in_comments(comments: Vec<String>) -> (Option<String>, Vec<String>) {
    let (rig, comments): (Vec<String>, Vec<String>) = comments
        .into_iter()
        .partition(|line| line.starts_with(RIG_LINE.trim_end()));
    let text = rig
        .iter()
        .map(|line| line.strip_prefix(RIG_LINE).unwrap_or_default())
        .fold(String::new(), |text, line| text + line + "\n");
    ((!rig.is_empty()).then_some(text), comments)
}

impl Recording {
    /// Writes the recording as CSV: comments (with metadata as `key: value`, and the rig file line by line), header,
    /// one row per sample. Numbers are written with as many digits as it takes to read the same number again.
    ///
    /// # Errors
    /// [`RecordingError::File`] where the file cannot be written.
    pub fn write_csv(&self, path: impl AsRef<Path>) -> Result<(), RecordingError> {
        let path = path.as_ref();
        let mut file = WholeFile::create(path)?;
        let written = self.to_csv(&mut file);
        written.map_err(|source| FileError::Write {
            path: path.into(),
            source,
        })?;
        Ok(file.commit()?)
    }

    /// As [`Self::write_csv`], to any writer.
    ///
    /// # Errors
    /// The writer's.
    pub fn to_csv(&self, mut out: impl Write) -> io::Result<()> {
        for comment in &self.comments {
            writeln!(out, "# {comment}")?;
        }
        for (key, value) in &self.metadata {
            for line in value.lines() {
                writeln!(out, "# {key}: {line}")?;
            }
        }
        for line in self.rig.iter().flat_map(|rig| rig.lines()) {
            writeln!(out, "# {RIG_LINE}{line}")?;
        }

        let speeds = SPEEDS
            .into_iter()
            .zip([&self.theta_dot, &self.alpha_dot])
            .filter_map(|(name, values)| Some((name, values.as_ref()?)));
        let numbers: Vec<(&str, &Vec<f64>)> = REQUIRED
            .into_iter()
            .zip([&self.t, &self.u, &self.theta, &self.alpha])
            .chain(speeds)
            .collect();
        let mut writer = ::csv::Writer::from_writer(out);
        writer.write_record(
            numbers
                .iter()
                .map(|(name, _)| *name)
                .chain(self.extra.iter().map(|column| column.name.as_str())),
        )?;
        for k in 0..self.len() {
            for (_, values) in &numbers {
                writer.write_field(written(values.get(k)))?;
            }
            for column in &self.extra {
                match &column.values {
                    Values::Numbers(values) => writer.write_field(written(values.get(k)))?,
                    Values::Text(values) => {
                        writer.write_field(values.get(k).map_or("", String::as_str))?
                    }
                }
            }
            writer.write_record(None::<&[u8]>)?;
        }
        writer.flush()
    }
}

fn written(value: Option<&f64>) -> String {
    value
        .filter(|value| !value.is_nan())
        .map_or_else(String::new, f64::to_string)
}
