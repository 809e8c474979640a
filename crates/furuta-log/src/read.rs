//! Reading a log, whole or not.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

use furuta_input::{Input, Limits, foreign};
use mcap::records::Record as McapRecord;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

use crate::attachments::WithoutAttachments;
use crate::{LogError, Metadata, Record, TOPIC, Timing, chunk, metadata, timing};

/// A log as read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Log {
    /// What the log says about its run; `None` where the file ends before it.
    pub metadata: Option<Metadata>,
    /// The samples, in the order of the file.
    pub records: Vec<Record>,
    /// What the system granted the loop (priority, locked memory), or refused, by name; empty where the log does not
    /// say.
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
    #[error("log was cut off (its run was killed, or the file was not copied whole); {} were read",
        span(.records, .until))]
    Truncated {
        /// Samples read.
        records: usize,
        /// Time of the last one (s).
        until: Option<f64>,
    },
    /// The file's bytes were altered.
    #[error("log is damaged ({}); {} before that place were read", foreign(cause), span(.records, .until))]
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

/// A part of a log, in the order of the file.
#[derive(Debug)]
#[non_exhaustive]
pub enum Part<'a> {
    /// What the log says about its run.
    Metadata(Metadata),
    /// What the system granted the loop.
    RealTime(BTreeMap<String, String>),
    /// How punctual the loop was.
    Timing(Box<Timing>),
    /// What another program noted, under its name.
    Other(String, BTreeMap<String, String>),
    /// A sample, as JSON.
    Sample(&'a [u8]),
}

/// How a log ends that does not end as it should.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Ending {
    /// The file was not finished.
    Truncated,
    /// The file's bytes were altered; what is wrong with them.
    Damaged(String),
}

impl Ending {
    /// With what was read before that place.
    #[must_use]
    pub fn after(self, records: usize, until: Option<f64>) -> Notice {
        match self {
            Self::Truncated => Notice::Truncated { records, until },
            Self::Damaged(cause) => Notice::Damaged {
                records,
                until,
                cause,
            },
        }
    }
}

/// Reads a log file, whole or not.
///
/// # Errors
/// [`LogError::Open`], and those of [`read_from`].
pub fn read(path: impl AsRef<Path>) -> Result<Log, LogError> {
    let limits = Limits::default();
    let input = Input::open(path, "a log of `furuta run`", limits.file)?;
    read_from(input.buffered())
}

/// Reads a log, whole or not. A chunk counts only if it is whole and its checksum is right.
///
/// # Errors
/// [`LogError::Empty`], [`LogError::NotMcap`], [`LogError::NoTopic`], [`LogError::BadRecord`] and
/// [`LogError::BadTiming`] where the input is no log of ours; [`LogError::Read`] where the system cannot read it;
/// [`LogError::TooMuchMemory`]. A log cut off or damaged is no error: it comes with a [`Notice`].
pub fn read_from(input: impl Read) -> Result<Log, LogError> {
    let limits = Limits::default();
    let mut records = Vec::new();
    let most = limits.memory / size_of::<Record>() as u64;
    let log = each_record(input, &limits, |record| {
        if records.len() as u64 == most {
            return Err(LogError::TooMuchMemory {
                limit: limits.memory,
            });
        }
        records.push(record);
        Ok(())
    })?;
    Ok(Log { records, ..log })
}

/// Goes through a log, whole or not, record by record, and returns what it says beside them.
///
/// # Errors
/// As [`read_from`], and those of `each`.
pub fn each_record<E: From<LogError>>(
    input: impl Read,
    limits: &Limits,
    mut each: impl FnMut(Record) -> Result<(), E>,
) -> Result<Log, E> {
    let mut log = Log::default();
    let (mut index, mut until) = (0, None);
    let ending = each_part(input, limits, |part| {
        match part {
            Part::Metadata(metadata) => log.metadata = Some(metadata),
            Part::RealTime(granted) => log.real_time = granted,
            Part::Timing(timing) => log.timing = Some(timing),
            Part::Other(..) => {}
            Part::Sample(json) => {
                let record: Record = serde_json::from_slice(json)
                    .map_err(|cause| LogError::BadRecord { index, cause })?;
                index += 1;
                until = Some(record.t);
                each(record)?;
            }
        }
        Ok::<(), E>(())
    })?;
    log.notice = ending.map(|ending| ending.after(index, until));
    Ok(log)
}

/// Goes through a log, whole or not, part by part; the samples are not looked into.
///
/// # Errors
/// As [`read_from`] but for what samples hold, and those of `each`.
pub fn each_part<E: From<LogError>>(
    mut input: impl Read,
    limits: &Limits,
    mut each: impl FnMut(Part<'_>) -> Result<(), E>,
) -> Result<Option<Ending>, E> {
    let mut magic = Vec::new();
    input
        .by_ref()
        .take(mcap::MAGIC.len() as u64)
        .read_to_end(&mut magic)
        .map_err(LogError::Read)?;
    if magic.is_empty() {
        return Err(LogError::Empty.into());
    }
    if !mcap::MAGIC.starts_with(&magic) {
        return Err(LogError::NotMcap { first: magic }.into());
    }
    // Checked just now; what is left to the reader begins behind it.
    let options = LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_emit_chunks(true)
        .with_record_length_limit(limits.record);
    let mut reader = LinearReader::new_with_options(options);
    let mut input = WithoutAttachments::new(input);
    let mut topics = Topics::default();
    let mut unpacked = Vec::new();
    while let Some(event) = reader.next_event() {
        let (opcode, data) = match event {
            Ok(LinearReadEvent::ReadRequest(bytes)) => {
                let got = loop {
                    match input.read(reader.insert(bytes)) {
                        Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
                        other => break other.map_err(LogError::Read)?,
                    }
                };
                reader.notify_read(got);
                continue;
            }
            Ok(LinearReadEvent::Record { data, opcode }) => (opcode, data),
            Err(error) => return Ok(Some(ending(&error))),
        };
        let record = match mcap::parse_record(opcode, data) {
            Ok(record) => record,
            Err(error) => return Ok(Some(ending(&error))),
        };
        let McapRecord::Chunk { header, data } = record else {
            take(record, limits, &mut topics, &mut each)?;
            continue;
        };
        if let Err(cause) = chunk::unpack(&header, &data, limits.record, &mut unpacked) {
            return Ok(Some(Ending::Damaged(cause)));
        }
        for record in chunk::records(&unpacked) {
            let Some((opcode, data)) = record else {
                let cause = "a record is longer than its chunk".to_owned();
                return Ok(Some(Ending::Damaged(cause)));
            };
            match mcap::parse_record(opcode, data) {
                Ok(record) => take(record, limits, &mut topics, &mut each)?,
                Err(error) => return Ok(Some(ending(&error))),
            }
        }
    }
    if topics.ours.is_none() {
        let found = topics.others;
        return Err(LogError::NoTopic { found }.into());
    }
    Ok(None)
}

/// Topics of others that are named in a message.
const TOPICS_NAMED: usize = 8;

#[derive(Default)]
struct Topics {
    ours: Option<u16>,
    others: Vec<String>,
}

fn take<E: From<LogError>>(
    record: McapRecord<'_>,
    limits: &Limits,
    topics: &mut Topics,
    each: &mut impl FnMut(Part<'_>) -> Result<(), E>,
) -> Result<(), E> {
    match record {
        McapRecord::Metadata(m) => {
            if m.metadata.len() > limits.names {
                let (found, limit) = (m.metadata.len(), limits.names);
                return Err(LogError::TooManyEntries { found, limit }.into());
            }
            each(match m.name.as_str() {
                metadata::RECORD_NAME => Part::Metadata(Metadata::from_map(m.metadata)),
                metadata::REAL_TIME_RECORD => Part::RealTime(m.metadata),
                timing::RECORD_NAME => Part::Timing(Box::new(Timing::from_map(&m.metadata)?)),
                _ => Part::Other(m.name, m.metadata),
            })
        }
        McapRecord::Channel(channel) if channel.topic == TOPIC => {
            topics.ours = Some(channel.id);
            Ok(())
        }
        // The summary at the end repeats the channels.
        McapRecord::Channel(channel)
            if topics.others.len() < TOPICS_NAMED && !topics.others.contains(&channel.topic) =>
        {
            topics.others.push(channel.topic);
            Ok(())
        }
        McapRecord::Message { header, data } if Some(header.channel_id) == topics.ours => {
            each(Part::Sample(&data))
        }
        _ => Ok(()),
    }
}

fn ending(error: &mcap::McapError) -> Ending {
    match error {
        mcap::McapError::UnexpectedEof => Ending::Truncated,
        other => Ending::Damaged(crate::error::root(other)),
    }
}
