//! Reading a log, whole or not.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use mcap::records::Record as McapRecord;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

use crate::{LogError, Metadata, Record, TOPIC, Timing, metadata, timing};

/// No record or chunk of ours comes near this; a damaged length field must not make us ask for more memory.
const RECORD_LIMIT: usize = 64 << 20;

/// A log as read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Log {
    /// What the log says about its run; `None` where the file ends before it.
    pub metadata: Option<Metadata>,
    /// The samples, in the order of the file.
    pub records: Vec<Record>,
    /// What the system granted the loop (priority, locked memory), or refused, by name; empty where the log does not say.
    pub real_time: BTreeMap<String, String>,
    /// How punctual the loop was; `None` where the log does not say, as that of a run that was killed.
    pub timing: Option<Box<Timing>>,
    /// Set where the file ends early or is damaged: the records are then those before that place.
    pub notice: Option<Notice>,
}

/// A log ends early: its run was killed, or the file is damaged. Everything before that place was read.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Notice {
    /// The file was not finished.
    #[error("log was cut off (its run was killed, or the file was not copied whole); {} were read", span(.records, .until))]
    Truncated {
        /// Samples read.
        records: usize,
        /// Time of the last one (s).
        until: Option<f64>,
    },
    /// The file's bytes were altered.
    #[error("log is damaged ({cause}); {} before that place were read", span(.records, .until))]
    Damaged {
        /// Samples read.
        records: usize,
        /// Time of the last one (s).
        until: Option<f64>,
        /// What the MCAP reader says.
        cause: String,
    },
}

fn span(records: &usize, until: &Option<f64>) -> String {
    match until {
        Some(t) => format!("{records} samples, up to t = {t:.3} s,"),
        None => format!("{records} samples"),
    }
}

/// Reads a log file, whole or not.
///
/// # Errors
/// [`LogError::Open`], and those of [`read_from`].
pub fn read(path: impl AsRef<Path>) -> Result<Log, LogError> {
    let path = path.as_ref();
    let file = File::open(path).map_err(|source| LogError::Open {
        path: path.to_owned(),
        source,
    })?;
    read_from(BufReader::new(file))
}

/// Reads a log, whole or not. A chunk counts only if it is whole and its checksum is right.
///
/// # Errors
/// [`LogError::Empty`], [`LogError::NotMcap`], [`LogError::NoTopic`], [`LogError::BadRecord`] and [`LogError::BadTiming`] where the input is no
/// log of ours; [`LogError::Read`] where the system cannot read it. A log cut off or damaged is no error: it comes
/// with a [`Notice`].
pub fn read_from(mut input: impl Read) -> Result<Log, LogError> {
    let mut magic = Vec::new();
    input
        .by_ref()
        .take(mcap::MAGIC.len() as u64)
        .read_to_end(&mut magic)
        .map_err(LogError::Read)?;
    if magic.is_empty() {
        return Err(LogError::Empty);
    }
    if !mcap::MAGIC.starts_with(&magic) {
        return Err(LogError::NotMcap { first: magic });
    }
    // Checked just now; what is left to the reader begins behind it.
    let options = LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_prevalidate_chunk_crcs(true)
        .with_record_length_limit(RECORD_LIMIT);
    let mut reader = LinearReader::new_with_options(options);
    let mut log = Log::default();
    let mut topics = Topics::default();
    while let Some(event) = reader.next_event() {
        match event {
            Ok(LinearReadEvent::ReadRequest(bytes)) => {
                let got = loop {
                    match input.read(reader.insert(bytes)) {
                        Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
                        other => break other.map_err(LogError::Read)?,
                    }
                };
                reader.notify_read(got);
            }
            Ok(LinearReadEvent::Record { data, opcode }) => {
                match mcap::parse_record(opcode, data) {
                    Ok(record) => take(record, &mut log, &mut topics)?,
                    Err(error) => {
                        log.notice = Some(notice(&log.records, &error));
                        return Ok(log);
                    }
                }
            }
            Err(error) => {
                log.notice = Some(notice(&log.records, &error));
                return Ok(log);
            }
        }
    }
    if topics.ours.is_none() {
        return Err(LogError::NoTopic {
            found: topics.others,
        });
    }
    Ok(log)
}

#[derive(Default)]
struct Topics {
    ours: Option<u16>,
    others: Vec<String>,
}

fn take(record: McapRecord<'_>, log: &mut Log, topics: &mut Topics) -> Result<(), LogError> {
    match record {
        McapRecord::Metadata(m) if m.name == metadata::RECORD_NAME => {
            log.metadata = Some(Metadata::from_map(m.metadata));
        }
        McapRecord::Metadata(m) if m.name == metadata::REAL_TIME_RECORD => {
            log.real_time = m.metadata;
        }
        McapRecord::Metadata(m) if m.name == timing::RECORD_NAME => {
            log.timing = Some(Box::new(Timing::from_map(&m.metadata)?));
        }
        McapRecord::Channel(channel) if channel.topic == TOPIC => topics.ours = Some(channel.id),
        // The summary at the end repeats the channels.
        McapRecord::Channel(channel) if !topics.others.contains(&channel.topic) => {
            topics.others.push(channel.topic)
        }
        McapRecord::Message { header, data } if Some(header.channel_id) == topics.ours => {
            let index = log.records.len();
            let record = serde_json::from_slice(&data)
                .map_err(|cause| LogError::BadRecord { index, cause })?;
            log.records.push(record);
        }
        _ => {}
    }
    Ok(())
}

fn notice(read: &[Record], error: &mcap::McapError) -> Notice {
    let (records, until) = (read.len(), read.last().map(|r| r.t));
    match error {
        mcap::McapError::UnexpectedEof => Notice::Truncated { records, until },
        other => Notice::Damaged {
            records,
            until,
            cause: crate::error::root(other),
        },
    }
}
