//! MCAP: logs of `furuta run`, and recordings written in the same form.
//!
//! A recording is one JSON message a sample on the topic of [`furuta_log`], with the fields of its [`Record`](furuta_log::Record) and
//! further ones for the columns that a record does not have. Any reader of logs reads such a file; the columns that the recording really
//! has are listed in the metadata, since a record has no way to leave a field out.

use std::collections::BTreeMap;
use std::io::{self, Seek, Write};
use std::path::Path;

use ::mcap::records::{MessageHeader, Metadata as MetadataRecord};
use ::mcap::{Compression, McapError, MessageStream, WriteOptions};
use furuta_file::{FileError, WholeFile};
use furuta_log::{FIELDS, Log, Record};
use serde_json::{Map, Value, json};

use super::{Column, NoticeKind, Recording, RecordingError, Table, Values, source};

/// Metadata that lists the columns of a converted recording, as a JSON array.
const COLUMNS: &str = "columns";
/// Metadata that holds the comments of a converted CSV file.
const COMMENTS: &str = "comments";
/// Name of the metadata record that [`furuta_log`] reads.
const METADATA: &str = "furuta";
/// Bytes of messages in a chunk, some 200 samples: of a file that is not copied whole, every whole chunk is read.
const CHUNK: u64 = 64 << 10;
const STATE: [&str; 6] = ["t", "u", "theta", "alpha", "theta_dot", "alpha_dot"];

pub(super) fn is_mcap(bytes: &[u8]) -> bool {
    bytes.starts_with(::mcap::MAGIC)
}

/// The table of a log, and a notice where the log ends early.
pub(super) fn parse(
    file: &str,
    bytes: &[u8],
) -> Result<(Table, Option<NoticeKind>), RecordingError> {
    let log = furuta_log::read_from(bytes).map_err(|error| RecordingError::Log {
        file: file.into(),
        reason: error.to_string(),
    })?;
    let Log {
        metadata,
        records,
        notice,
        ..  // what says how the loop ran is not part of a recording
    } = log;
    let notice = notice.map(|notice| NoticeKind::CutOff {
        what: notice.to_string(),
    });
    let mut metadata = metadata.unwrap_or_default();
    let listed: Option<Vec<String>> = metadata
        .extra
        .remove(COLUMNS)
        .and_then(|names| serde_json::from_str(&names).ok());
    let comments = metadata
        .extra
        .remove(COMMENTS)
        .map(|text| text.lines().map(Into::into).collect())
        .unwrap_or_default();
    // A log of a run has every field of a record. Of a converted recording, only the listed columns are its own.
    let has = |name: &str| {
        listed
            .as_ref()
            .is_none_or(|listed| listed.iter().any(|column| column == name))
    };

    let rows: Vec<usize> = (1..=records.len()).collect();
    let state =
        |name: &'static str, value: fn(&Record) -> f64| -> Result<Vec<f64>, RecordingError> {
            let finite = |(record, &row): (&Record, &usize)| {
                let value = value(record);
                if value.is_finite() {
                    Ok(value)
                } else {
                    Err(RecordingError::NotFinite {
                        file: file.into(),
                        row,
                        column: name.into(),
                        value,
                    })
                }
            };
            records.iter().zip(&rows).map(finite).collect()
        };
    let speed = |name, value: fn(&Record) -> f64| {
        has(name).then(|| records.iter().map(value).collect::<Vec<f64>>())
    };
    let (t, u) = (
        state("t", |record| record.t)?,
        state("u", |record| record.u)?,
    );
    let (theta, alpha) = (
        state("theta", |record| record.theta)?,
        state("alpha", |record| record.alpha)?,
    );
    let (theta_dot, alpha_dot) = (
        speed("theta_dot", |record| record.theta_dot),
        speed("alpha_dot", |record| record.alpha_dot),
    );

    let extra = further_columns(bytes, &records, has);
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
    let rig = (!metadata.rig_file.is_empty()).then_some(metadata.rig_file);
    let table = Table {
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
        metadata: further,
        comments,
    };
    Ok((table, notice))
}

/// Every field of the messages that is not of the state: first those of a record, in their order, then the rest.
fn further_columns(bytes: &[u8], records: &[Record], has: impl Fn(&str) -> bool) -> Vec<Column> {
    // Read by furuta_log already, with its checks: here a damaged message merely ends the columns, and `records` says how many count.
    let messages =
        MessageStream::new_with_options(bytes, ::mcap::read::Options::IgnoreEndMagic.into())
            .into_iter()
            .flatten();
    let ours = messages
        .map_while(Result::ok)
        .filter(|message| message.channel.topic == furuta_log::TOPIC);
    let rows: Vec<Map<String, Value>> = ours
        .take(records.len())
        .map(|message| serde_json::from_slice(&message.data).unwrap_or_default())
        .collect();

    let mut names: Vec<&str> = FIELDS.iter().map(|field| field.name).collect();
    for name in rows.iter().flat_map(Map::keys) {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
    }
    names.retain(|name| !STATE.contains(name) && has(name));
    let column = |name: &str| {
        let values: Vec<Option<&Value>> = (0..records.len())
            .map(|k| rows.get(k).and_then(|row| row.get(name)))
            .collect();
        let text = values.iter().any(|value| {
            matches!(
                value,
                Some(Value::String(_) | Value::Bool(_) | Value::Array(_) | Value::Object(_))
            )
        });
        let values = if text {
            Values::Text(
                values
                    .into_iter()
                    .map(|value| match value {
                        Some(Value::String(text)) => text.clone(),
                        Some(Value::Null) | None => String::new(),
                        Some(other) => other.to_string(),
                    })
                    .collect(),
            )
        } else {
            Values::Numbers(
                values
                    .into_iter()
                    .map(|value| value.and_then(Value::as_f64).unwrap_or(f64::NAN))
                    .collect(),
            )
        };
        Column {
            name: name.into(),
            values,
        }
    };
    names.into_iter().map(column).collect()
}

impl Recording {
    /// Writes the recording as an MCAP log, in the form that `furuta run` writes.
    ///
    /// # Errors
    /// [`RecordingError::File`] where the file cannot be written, [`RecordingError::NotLoggable`] where a further column has the name of a
    /// field of the log and holds something else.
    pub fn write_mcap(&self, path: impl AsRef<Path>) -> Result<(), RecordingError> {
        self.write_mcap_keeping(path, None)
    }

    /// As [`Self::write_mcap`], with the CSV file that the recording was read from kept whole as an attachment: see
    /// [`kept_source`](super::kept_source).
    ///
    /// # Errors
    /// As [`Self::write_mcap`].
    pub fn write_mcap_keeping(
        &self,
        path: impl AsRef<Path>,
        source: Option<&[u8]>,
    ) -> Result<(), RecordingError> {
        let path = path.as_ref();
        self.fits_the_log()?;
        let mut file = WholeFile::create(path)?;
        let written = self.to_mcap(&mut file, source);
        written.map_err(|source| FileError::Write {
            path: path.into(),
            source,
        })?;
        Ok(file.commit()?)
    }

    fn to_mcap(&self, out: impl Write + Seek, source: Option<&[u8]>) -> io::Result<()> {
        let mut writer = WriteOptions::new()
            .profile("")
            .library(concat!("furuta-ident ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Lz4))
            .chunk_size(Some(CHUNK))
            .create(out)
            .map_err(as_io)?;
        writer
            .write_metadata(&MetadataRecord {
                name: METADATA.into(),
                metadata: self.log_metadata(),
            })
            .map_err(as_io)?;
        let schema = writer
            .add_schema(
                "furuta.Sample",
                "jsonschema",
                self.schema().to_string().as_bytes(),
            )
            .map_err(as_io)?;
        let channel_id = writer
            .add_channel(schema, furuta_log::TOPIC, "json", &BTreeMap::new())
            .map_err(as_io)?;
        for k in 0..self.len() {
            let message = self.message(k).to_string();
            // Time in the file counts from t = 0; a cast from float saturates, so that no t can make it panic.
            let time = (self.t.get(k).copied().unwrap_or(0.0) * 1e9) as u64;
            let header = MessageHeader {
                channel_id,
                sequence: u32::try_from(k).unwrap_or(u32::MAX),
                log_time: time,
                publish_time: time,
            };
            writer
                .write_to_known_channel(&header, message.as_bytes())
                .map_err(as_io)?;
        }
        if let Some(source) = source {
            writer.attach(&source::attachment(source)).map_err(as_io)?;
        }
        writer.finish().map_err(as_io)?;
        Ok(())
    }

    /// A column called as a field of the log must hold what that field holds: readers would refuse the log otherwise.
    fn fits_the_log(&self) -> Result<(), RecordingError> {
        for (name, series) in self.columns() {
            let Some(field) = FIELDS.iter().find(|field| field.name == name) else {
                continue;
            };
            let largest = if name == "status" {
                f64::from(u8::MAX)
            } else {
                f64::from(u32::MAX)
            };
            let fits = match (field.kind, series) {
                ("integer", Series::Numbers(values)) => values
                    .iter()
                    .all(|value| (0.0..=largest).contains(value) && value.fract() == 0.0),
                ("string", Series::Text(values)) => values.iter().all(|value| {
                    furuta_log::Mode::ALL
                        .iter()
                        .any(|mode| mode.name() == value)
                }),
                ("number", Series::Numbers(_)) => true,
                _ => false,
            };
            if !fits {
                return Err(RecordingError::NotLoggable {
                    file: self.name.clone(),
                    column: name.into(),
                    meaning: field.meaning,
                });
            }
        }
        Ok(())
    }

    fn log_metadata(&self) -> BTreeMap<String, String> {
        let mut metadata = self.metadata.clone();
        metadata.insert(COLUMNS.into(), Value::from(self.column_names()).to_string());
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

    /// The columns that the recording has, with the value of each at a sample.
    fn columns(&self) -> impl Iterator<Item = (&str, Series<'_>)> {
        let state = [
            Some(&self.t),
            Some(&self.u),
            Some(&self.theta),
            Some(&self.alpha),
            self.theta_dot.as_ref(),
            self.alpha_dot.as_ref(),
        ];
        let state = STATE
            .into_iter()
            .zip(state)
            .filter_map(|(name, values)| Some((name, Series::Numbers(values?))));
        state.chain(self.extra.iter().map(|column| {
            let series = match &column.values {
                Values::Numbers(values) => Series::Numbers(values),
                Values::Text(values) => Series::Text(values),
            };
            (column.name.as_str(), series)
        }))
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
        for (name, series) in self.columns() {
            let kind = if matches!(series, Series::Text(_)) {
                "string"
            } else {
                "number"
            };
            properties
                .entry(name)
                .or_insert_with(|| json!({"type": kind, "description": "as recorded"}));
        }
        json!({"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "furuta.Sample", "type": "object", "properties": properties})
    }

    /// Sample `k` with every field of a record: those that the recording does not have are null, zero or `off`.
    fn message(&self, k: usize) -> Value {
        let default = |field: &furuta_log::Field| match field.kind {
            "integer" => Value::from(0),
            "string" => Value::from(furuta_log::Mode::Off.name()),
            _ => Value::Null,
        };
        let mut message: Map<String, Value> = FIELDS
            .iter()
            .map(|field| (field.name.to_owned(), default(field)))
            .collect();
        for (name, series) in self.columns() {
            let integer = FIELDS
                .iter()
                .any(|field| field.name == name && field.kind == "integer");
            let value = match series {
                Series::Numbers(values) => values.get(k).map_or(Value::Null, |&value| {
                    if integer {
                        whole(value)
                    } else if STATE.contains(&name) && value.is_infinite() {
                        // As a log has it: JSON knows no such number.
                        Value::from(if value > 0.0 { "Infinity" } else { "-Infinity" })
                    } else {
                        Value::from(value)
                    }
                }),
                Series::Text(values) => values
                    .get(k)
                    .map_or(Value::Null, |value| Value::from(value.as_str())),
            };
            message.insert(name.into(), value);
        }
        Value::Object(message)
    }
}

enum Series<'a> {
    Numbers(&'a [f64]),
    Text(&'a [String]),
}

/// Counters are integers in a log.
fn whole(value: f64) -> Value {
    Value::from(value as u64)
}

fn as_io(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        other => io::Error::other(other),
    }
}
