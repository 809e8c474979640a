//! What can go wrong with a log.

use std::path::PathBuf;

use furuta_input::{InputError, foreign, quoted};

/// A log could not be written or read.
#[derive(Debug, thiserror::Error)]
pub enum LogError {
    /// The file could not be created.
    #[error("{}: cannot be created: {source}; choose a folder that exists and is writable", path.display())]
    Create {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The log is complete but cannot be moved to its place, or is not known to be on the disk.
    #[error("{}: the log is complete, and stays here: {source}", at.display())]
    Keep {
        /// Where the log is.
        at: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file is not read: not there, a directory, a pipe, zeros, too large.
    #[error(transparent)]
    Open(#[from] InputError),
    /// Reading failed in the middle, for a reason of the system's.
    #[error("log cannot be read further: {0}")]
    Read(#[source] std::io::Error),
    /// Writing failed, for example because the disk is full.
    #[error("log cannot be written further: {}", root(.0))]
    Write(#[source] mcap::McapError),
    /// The file was removed, replaced or truncated meanwhile: nothing of it is kept.
    #[error(
        "log {0} while it was written: what was recorded is lost; leave the file alone until the run has ended"
    )]
    Tampered(#[source] crate::Tampered),
    /// A record could not be made JSON.
    #[error("record cannot be encoded: {0}")]
    Encode(#[source] serde_json::Error),
    /// The file is empty.
    #[error(
        "log is an empty file: the run that wrote it ended before its first line; record it again"
    )]
    Empty,
    /// The file does not begin as an MCAP file does.
    #[error("not an MCAP file (it begins with {first:02x?}): give a log written by `furuta run`")]
    NotMcap {
        /// First bytes of the file.
        first: Vec<u8>,
    },
    /// The file is a whole MCAP file, but not one of ours.
    #[error("MCAP file without topic {topic} (it has {}): give a log written by `furuta run`",
        quoted(&found.join(", ")), topic = crate::TOPIC)]
    NoTopic {
        /// Topics that are in the file, the first ones.
        found: Vec<String>,
    },
    /// A message is not a record.
    #[error("message {index} of topic {topic} is not a record of this version: {}", foreign(&cause.to_string()),
        topic = crate::TOPIC)]
    BadRecord {
        /// Number of the message, from 0.
        index: usize,
        /// What JSON says.
        cause: serde_json::Error,
    },
    /// More entries than are read.
    #[error("{found} entries in one metadata record of the log; at most {limit} are read")]
    TooManyEntries {
        /// How many there are.
        found: usize,
        /// How many there may be.
        limit: usize,
    },
    /// The log would take more memory than it may.
    #[error(
        "log takes more than {limit} bytes of memory; `furuta convert` makes a CSV file of it, which can be cut"
    )]
    TooMuchMemory {
        /// Bytes of memory that it may take.
        limit: u64,
    },
    /// The record of the loop's times makes no sense.
    #[error("{name} in the log's record {record} is not of this version: {}", foreign(&cause.to_string()),
        record = crate::timing::RECORD_NAME)]
    BadTiming {
        /// Its part.
        name: &'static str,
        /// What JSON says.
        cause: serde_json::Error,
    },
}

impl LogError {
    /// Why a write failed.
    pub(crate) fn of_write(error: mcap::McapError) -> Self {
        if let mcap::McapError::Io(io) = &error
            && let Some(tampered) = io.get_ref().and_then(|inner| inner.downcast_ref())
        {
            return Self::Tampered(*tampered);
        }
        Self::Write(error)
    }
}

/// `McapError::Io` hides the system's words, and these are what the reader needs ("No space left on device").
pub(crate) fn root(error: &mcap::McapError) -> String {
    match error {
        mcap::McapError::Io(io) => io.to_string(),
        other => other.to_string(),
    }
}
