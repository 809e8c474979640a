//! Writing recordings as MCAP logs, sample by sample.

use std::collections::BTreeMap;
use std::io::{self, Read, Seek, Write};
use std::path::Path;

use ::mcap::records::{AttachmentHeader, MessageHeader, Metadata as MetadataRecord};
use ::mcap::{Compression, McapError, WriteOptions, Writer};
use furuta_file::{FileError, WholeFile};
use furuta_log::FIELDS;
use serde_json::{Map, Value, json};

use super::mcap::{COLUMNS, COMMENTS, STATE};
use super::source::{self, Digest};
use super::{Recording, RecordingError, Values};

/// Name of the metadata record that [`furuta_log`] reads.
const METADATA: &str = "furuta";
/// Bytes of messages in a chunk, some 200 samples: of a file that is not copied whole, every whole chunk is read.
const CHUNK: u64 = 64 << 10;

/// A value of a sample.
#[derive(Copy, Clone)]
pub(super) enum Cell<'a> {
    Number(f64),
    Text(&'a str),
}

/// The columns of a recording, and how a sample of them is written.
pub(super) struct Shape {
    columns: Vec<(String, bool)>,
    /// What stands in a message: text, and behind it the value of a column.
    parts: Vec<(String, Option<(usize, Form)>)>,
}

#[derive(Copy, Clone)]
enum Form {
    Number,
    /// One that may be infinite.
    State,
    Whole,
    Text,
}

impl Shape {
    /// Of columns by name, and whether each holds numbers. Fields of a record that the recording does not have are
    /// null, zero or `off`.
    pub(super) fn new(columns: Vec<(String, bool)>) -> Self {
        let text = |name: &str| Value::from(name).to_string();
        let mut parts = Vec::new();
        let mut before = "{".to_owned();
        for (i, (name, numbers)) in columns.iter().enumerate() {
            let whole = FIELDS
                .iter()
                .any(|field| field.name == name && field.kind == "integer");
            let form = match (numbers, whole) {
                (false, _) => Form::Text,
                (true, true) => Form::Whole,
                (true, false) if STATE.contains(&name.as_str()) => Form::State,
                (true, false) => Form::Number,
            };
            before += &text(name);
            before.push(':');
            parts.push((
                core::mem::replace(&mut before, ",".to_owned()),
                Some((i, form)),
            ));
        }
        for field in FIELDS {
            if columns.iter().any(|(name, _)| name == field.name) {
                continue;
            }
            let value = match field.kind {
                "integer" => "0".to_owned(),
                "string" => text(furuta_log::Mode::Off.name()),
                _ => "null".to_owned(),
            };
            before += &format!("{}:{value},", text(field.name));
        }
        before.pop();
        parts.push((before + "}", None));
        Self { columns, parts }
    }

    /// Whether a column, of those that are not of the state, is called as a field of the log.
    pub(super) fn shares_names(&self) -> bool {
        let own = |name: &str| !STATE.contains(&name) && FIELDS.iter().any(|f| f.name == name);
        self.columns.iter().any(|(name, _)| own(name))
    }

    /// Whether a column called as a field of the log holds what that field holds: readers would refuse the log
    /// otherwise. If not, what the
    /// field means.
    pub(super) fn misfit(&self, column: usize, cell: Cell<'_>) -> Option<&'static str> {
        let (name, _) = self.columns.get(column)?;
        let field = FIELDS.iter().find(|field| field.name == name)?;
        let largest = if name == "status" {
            f64::from(u8::MAX)
        } else {
            f64::from(u32::MAX)
        };
        let fits = match (field.kind, cell) {
            ("integer", Cell::Number(value)) => {
                (0.0..=largest).contains(&value) && value.fract() == 0.0
            }
            ("string", Cell::Text(value)) => furuta_log::Mode::ALL
                .iter()
                .any(|mode| mode.name() == value),
            ("number", Cell::Number(_)) => true,
            _ => false,
        };
        (!fits).then_some(field.meaning)
    }

    fn message(&self, cells: &[Cell<'_>], out: &mut Vec<u8>) -> io::Result<()> {
        out.clear();
        for (before, column) in &self.parts {
            out.extend_from_slice(before.as_bytes());
            let Some((place, form)) = *column else {
                continue;
            };
            match (form, cells.get(place)) {
                (Form::Whole, Some(&Cell::Number(value))) => write!(out, "{}", value as u64)?,
                // As a log has it: JSON knows no such number.
                (Form::State, Some(&Cell::Number(value))) if value.is_infinite() => {
                    let name = if value > 0.0 { "Infinity" } else { "-Infinity" };
                    write!(out, "\"{name}\"")?;
                }
                (_, Some(Cell::Number(value))) => serde_json::to_writer(&mut *out, value)?,
                (_, Some(Cell::Text(text))) => serde_json::to_writer(&mut *out, text)?,
                (_, None) => out.extend_from_slice(b"null"),
            }
        }
        Ok(())
    }

    fn schema(&self) -> Value {
        let mut properties = Map::new();
        for field in &FIELDS {
            let unit = if field.unit.is_empty() {
                String::new()
            } else {
                format!(" [{}]", field.unit)
            };
            properties.insert(
                field.name.into(),
                json!({"type": field.kind, "description": format!("{}{unit}", field.meaning)}),
            );
        }
        for (name, numbers) in &self.columns {
            let kind = if *numbers { "number" } else { "string" };
            properties
                .entry(name)
                .or_insert_with(|| json!({"type": kind, "description": "as recorded"}));
        }
        json!({"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "furuta.Sample", "type": "object",
            "properties": properties})
    }
}

/// A log that is being written.
pub(super) struct SampleWriter<'a, W: Write + Seek> {
    mcap: Writer<W>,
    shape: &'a Shape,
    channel: u16,
    written: u32,
    message: Vec<u8>,
    digest: Digest,
}

impl<'a, W: Write + Seek> SampleWriter<'a, W> {
    /// Begins a log with what `about` says of itself.
    pub(super) fn new(out: W, shape: &'a Shape, about: &Recording) -> io::Result<Self> {
        let mut mcap = WriteOptions::new()
            .profile("")
            .library(concat!("furuta-ident ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Lz4))
            .chunk_size(Some(CHUNK))
            .create(out)
            .map_err(as_io)?;
        mcap.write_metadata(&MetadataRecord {
            name: METADATA.into(),
            metadata: about.log_metadata(shape),
        })
        .map_err(as_io)?;
        let schema = shape.schema().to_string();
        let schema = mcap
            .add_schema("furuta.Sample", "jsonschema", schema.as_bytes())
            .map_err(as_io)?;
        let channel = mcap
            .add_channel(schema, furuta_log::TOPIC, "json", &BTreeMap::new())
            .map_err(as_io)?;
        Ok(Self {
            mcap,
            shape,
            channel,
            written: 0,
            message: Vec::with_capacity(512),
            digest: Digest::default(),
        })
    }

    /// Appends a sample; `t` is in `cells`, too.
    pub(super) fn write(&mut self, t: f64, cells: &[Cell<'_>]) -> io::Result<()> {
        self.shape.message(cells, &mut self.message)?;
        self.digest.add(&self.message);
        // Time in the file counts from t = 0; a cast from float saturates, so that no t can make it panic.
        let time = (t * 1e9) as u64;
        let header = MessageHeader {
            channel_id: self.channel,
            sequence: self.written,
            log_time: time,
            publish_time: time,
        };
        self.written = self.written.saturating_add(1);
        self.mcap
            .write_to_known_channel(&header, &self.message)
            .map_err(as_io)
    }

    /// Attaches the file of `size` bytes that the samples were read from.
    pub(super) fn attach(&mut self, mut file: impl Read, size: u64) -> io::Result<()> {
        self.mcap
            .write_metadata(&MetadataRecord {
                name: source::MARK.into(),
                metadata: self.digest.to_map(),
            })
            .map_err(as_io)?;
        let header = AttachmentHeader {
            log_time: 0,
            create_time: 0,
            name: source::NAME.into(),
            media_type: "text/csv".into(),
        };
        self.mcap.start_attachment(size, header).map_err(as_io)?;
        let mut buffer = vec![0; CHUNK as usize];
        loop {
            let got = file.read(&mut buffer)?;
            if got == 0 {
                break;
            }
            let read = buffer.get(..got).unwrap_or_default();
            self.mcap.put_attachment_bytes(read).map_err(as_io)?;
        }
        self.mcap.finish_attachment().map_err(as_io)
    }

    pub(super) fn finish(mut self) -> io::Result<()> {
        self.mcap.finish().map_err(as_io)?;
        self.mcap.into_inner().flush()
    }
}

impl Recording {
    /// Writes the recording as an MCAP log, in the form that `furuta run` writes.
    ///
    /// # Errors
    /// [`RecordingError::File`] where the file cannot be written, [`RecordingError::NotLoggable`] where a further
    /// column has the name of a
    /// field of the log and holds something else.
    pub fn write_mcap(&self, path: impl AsRef<Path>) -> Result<(), RecordingError> {
        let path = path.as_ref();
        let shape = self.shape();
        self.fits_the_log(&shape)?;
        let mut file = WholeFile::create(path)?;
        let written = self.to_mcap(&shape, &mut file);
        written.map_err(|source| FileError::Write {
            path: path.into(),
            source,
        })?;
        Ok(file.commit()?)
    }

    pub(super) fn to_mcap(&self, shape: &Shape, out: impl Write + Seek) -> io::Result<()> {
        let mut writer = SampleWriter::new(out, shape, self)?;
        for (k, &t) in self.t.iter().enumerate() {
            writer.write(t, &self.cells(k))?;
        }
        writer.finish()
    }

    /// The columns that the recording has.
    pub(super) fn shape(&self) -> Shape {
        let further = self.extra.iter().map(|column| &column.values);
        let texts = further.map(|values| matches!(values, Values::Numbers(_)));
        let names = self.column_names();
        let state = names.len() - self.extra.len();
        let numbers = core::iter::repeat_n(true, state).chain(texts);
        Shape::new(names.into_iter().map(Into::into).zip(numbers).collect())
    }

    fn cells(&self, k: usize) -> Vec<Cell<'_>> {
        let number = |values: &Vec<f64>| Cell::Number(values.get(k).copied().unwrap_or(f64::NAN));
        let speeds = [&self.theta_dot, &self.alpha_dot].into_iter().flatten();
        let state = [&self.t, &self.u, &self.theta, &self.alpha];
        let state = state.into_iter().chain(speeds).map(number);
        let further = self.extra.iter().map(|column| match &column.values {
            Values::Numbers(values) => number(values),
            Values::Text(values) => Cell::Text(values.get(k).map_or("", String::as_str)),
        });
        state.chain(further).collect()
    }

    pub(super) fn fits_the_log(&self, shape: &Shape) -> Result<(), RecordingError> {
        for k in 0..self.len() {
            for (i, cell) in self.cells(k).into_iter().enumerate() {
                if let Some(meaning) = shape.misfit(i, cell) {
                    return Err(RecordingError::NotLoggable {
                        file: self.name.clone(),
                        column: shape
                            .columns
                            .get(i)
                            .map_or_else(String::new, |(n, _)| n.clone()),
                        meaning,
                    });
                }
            }
        }
        Ok(())
    }

    fn log_metadata(&self, shape: &Shape) -> BTreeMap<String, String> {
        let mut metadata = self.metadata.clone();
        let names = shape.columns.iter().map(|(name, _)| name.as_str());
        metadata.insert(COLUMNS.into(), names.collect::<Value>().to_string());
        if !self.comments.is_empty() {
            metadata.insert(COMMENTS.into(), self.comments.join("\n"));
        }
        if let Some(rig) = &self.rig {
            metadata.insert("rig_file".into(), rig.clone());
        }
        let units = FIELDS
            .iter()
            .filter(|field| !field.unit.is_empty())
            .map(|field| (field.name.to_owned(), Value::from(field.unit)));
        metadata.insert("units".into(), units.collect::<Value>().to_string());
        metadata
    }
}

fn as_io(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        other => io::Error::other(other),
    }
}
