//! CSV: read strictly, written so that reading it again gives the same recording.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::Path;

use furuta_file::{FileError, WholeFile};

use super::{Column, Recording, RecordingError, Table, Values};

const REQUIRED: [&str; 4] = ["t", "u", "theta", "alpha"];
const SPEEDS: [&str; 2] = ["theta_dot", "alpha_dot"];
/// A comment that carries a line of the rig file starts with this.
const RIG_LINE: &str = "rig| ";

pub(super) fn parse(file: &str, bytes: &[u8]) -> Result<Table, RecordingError> {
    let text = text(file, bytes)?;
    let lines = Lines::split(file, text)?;
    let mut reader = ::csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .from_reader(lines.data.as_bytes());
    let mut records = reader.records().zip(&lines.rows);

    // The reader is given text whose quotes close within each line: what it could still object to does not occur, but is not trusted.
    let damaged = |row: usize, error: &::csv::Error| RecordingError::Log {
        file: file.into(),
        reason: format!("row {row}: {error}"),
    };
    let Some((header, &header_row)) = records.next() else {
        return Err(RecordingError::Empty { file: file.into() });
    };
    let header = header.map_err(|error| damaged(header_row, &error))?;
    let names: Vec<&str> = header.iter().map(str::trim).collect();
    let required = required_columns(file, header_row, &names)?;

    let mut fields: Vec<Vec<String>> = vec![Vec::new(); names.len()];
    let mut rows = Vec::new();
    for (record, &row) in records {
        let record = record.map_err(|error| damaged(row, &error))?;
        if record.len() != names.len() {
            return Err(RecordingError::FieldCount {
                file: file.into(),
                row,
                found: record.len(),
                expected: names.len(),
            });
        }
        for (column, field) in fields.iter_mut().zip(&record) {
            column.push(field.trim().into());
        }
        rows.push(row);
    }

    let mut columns: Vec<Option<(&str, Vec<String>)>> =
        names.into_iter().zip(fields).map(Some).collect();
    let mut take = |index: usize, empty| -> Result<Vec<f64>, RecordingError> {
        let (name, values) = columns
            .get_mut(index)
            .and_then(Option::take)
            .unwrap_or_default();
        numbers(file, name, &values, &rows, empty)
    };
    let [t, u, theta, alpha] = required;
    let mut measured = |index| take(index, Unknown::Refused);
    let (t, u) = (measured(t)?, measured(u)?);
    let (theta, alpha) = (measured(theta)?, measured(alpha)?);
    let mut speeds = [None, None];
    for (speed, name) in speeds.iter_mut().zip(SPEEDS) {
        if let Some(index) = header.iter().position(|found| found.trim() == name) {
            *speed = Some(take(index, Unknown::Kept)?);
        }
    }
    let [theta_dot, alpha_dot] = speeds;
    let extra = columns
        .into_iter()
        .flatten()
        .map(|(name, values)| Column {
            name: name.into(),
            values: classify(values),
        })
        .collect();
    let (rig, comments) = rig_in_comments(lines.comments);
    Ok(Table {
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
    })
}

/// The bytes as text, without the byte-order mark that spreadsheets put in front.
fn text<'a>(file: &str, bytes: &'a [u8]) -> Result<&'a str, RecordingError> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    core::str::from_utf8(bytes).map_err(|error| {
        let before = bytes.get(..error.valid_up_to()).unwrap_or_default();
        RecordingError::NotText {
            file: file.into(),
            row: 1 + before.iter().filter(|&&byte| byte == b'\n').count(),
        }
    })
}

/// The lines that hold data, with the number of each, apart from the comments. The CSV reader's own line numbers are of no use for
/// messages: they stand before the comments and blank lines that it skips.
struct Lines {
    data: String,
    rows: Vec<usize>,
    comments: Vec<String>,
}

impl Lines {
    fn split(file: &str, text: &str) -> Result<Self, RecordingError> {
        let mut lines = Self {
            data: String::with_capacity(text.len() + 1),
            rows: Vec::new(),
            comments: Vec::new(),
        };
        for (i, line) in text.split('\n').enumerate() {
            // A carriage return alone would end a line for the CSV reader but not for an editor.
            let line = line.trim_end_matches('\r');
            let row = i + 1;
            if let Some(comment) = line.trim_start().strip_prefix('#') {
                lines
                    .comments
                    .push(comment.strip_prefix(' ').unwrap_or(comment).into());
            } else if !line.trim().is_empty() {
                if line.bytes().filter(|&byte| byte == b'"').count() % 2 == 1 {
                    return Err(RecordingError::OpenQuote {
                        file: file.into(),
                        row,
                    });
                }
                lines
                    .data
                    .extend(line.chars().map(|c| if c == '\r' { ' ' } else { c }));
                lines.data.push('\n');
                lines.rows.push(row);
            }
        }
        Ok(lines)
    }
}

/// Indices of `t`, `u`, `theta`, `alpha`.
fn required_columns(file: &str, row: usize, names: &[&str]) -> Result<[usize; 4], RecordingError> {
    let numbers = names.iter().all(|name| name.parse::<f64>().is_ok());
    for (i, name) in names.iter().enumerate().filter(|_| !numbers) {
        if names.iter().take(i).any(|other| other == name) {
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

fn numbers(
    file: &str,
    column: &str,
    fields: &[String],
    rows: &[usize],
    unknown: Unknown,
) -> Result<Vec<f64>, RecordingError> {
    fields
        .iter()
        .zip(rows)
        .map(|(field, &row)| match field.parse::<f64>() {
            Ok(value) if value.is_finite() || unknown == Unknown::Kept => Ok(value),
            Ok(value) => Err(RecordingError::NotFinite {
                file: file.into(),
                row,
                column: column.into(),
                value,
            }),
            Err(_) if field.is_empty() && unknown == Unknown::Kept => Ok(f64::NAN),
            Err(_) => Err(RecordingError::NotANumber {
                file: file.into(),
                row,
                column: column.into(),
                value: field.clone(),
            }),
        })
        .collect()
}

/// Numbers where every field is a number or empty, text otherwise.
fn classify(fields: Vec<String>) -> Values {
    let number = |field: &String| {
        if field.is_empty() {
            Some(f64::NAN)
        } else {
            field.parse().ok()
        }
    };
    match fields.iter().map(number).collect() {
        Some(numbers) => Values::Numbers(numbers),
        None => Values::Text(fields),
    }
}

fn rig_in_comments(comments: Vec<String>) -> (Option<String>, Vec<String>) {
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
    /// Writes the recording as CSV: comments (with metadata as `key: value`, and the rig file line by line), header, one row per sample.
    /// Numbers are written with as many digits as it takes to read the same number again.
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
                writer.write_field(number(values.get(k)))?;
            }
            for column in &self.extra {
                match &column.values {
                    Values::Numbers(values) => writer.write_field(number(values.get(k)))?,
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

fn number(value: Option<&f64>) -> String {
    value
        .filter(|value| !value.is_nan())
        .map_or_else(String::new, f64::to_string)
}
