//! Writing a log.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Seek, Write};
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions, Writer};

use crate::watched::WatchedFile;
use crate::{Log, LogError, Metadata, Record, STARTED, TOPIC, Timing, metadata, schema, timing};

/// A killed run loses at most this much (s); a microsecond less, so that rounding of t adds no sample to a chunk.
const CHUNK_SECONDS: f64 = 0.1 - 1e-6;

/// Writes the log of one run.
pub struct LogWriter<W: Write + Seek> {
    mcap: Writer<W>,
    channel: u16,
    started_ns: u64,
    chunk_start: f64,
    written: u64,
    kept: u64,
    json: Vec<u8>,
}

impl Log {
    /// Writes a whole log again, as the run that it is of wrote it; its notice is not kept.
    ///
    /// ```
    /// use furuta_log::{Log, Metadata, Record, read_from};
    /// use std::io::Cursor;
    /// let records = vec![Record { t: 0.002, u: 1.5, ..Record::default() }];
    /// let log = Log { metadata: Some(Metadata::default()), records, ..Log::default() };
    /// let bytes = log.write_to(Cursor::new(Vec::new()))?.into_inner();
    /// assert_eq!(read_from(&bytes[..])?, log);
    /// # Ok::<(), furuta_log::LogError>(())
    /// ```
    ///
    /// # Errors
    /// [`LogError::Write`].
    pub fn write_to<W: Write + Seek>(&self, writer: W) -> Result<W, LogError> {
        let metadata = self.metadata.clone().unwrap_or_default();
        let mut log = LogWriter::new(writer, &metadata)?;
        if !self.real_time.is_empty() {
            log.write_real_time(&self.real_time)?;
        }
        for record in &self.records {
            log.write(record)?;
        }
        if let Some(timing) = &self.timing {
            log.write_timing(timing)?;
        }
        log.finish()
    }
}

impl LogWriter<BufWriter<WatchedFile>> {
    /// Creates the file, in place of one of the same name. Where it is removed, replaced or truncated later, a write
    /// says so.
    ///
    /// # Errors
    /// [`LogError::Create`], [`LogError::Write`].
    pub fn create(path: &Path, metadata: &Metadata) -> Result<Self, LogError> {
        let file = File::create(path).and_then(|file| WatchedFile::new(file, path));
        let file = file.map_err(|source| LogError::Create {
            path: path.to_owned(),
            source,
        })?;
        Self::new(BufWriter::new(file), metadata)
    }
}

impl<W: Write + Seek> LogWriter<W> {
    /// Begins a log and writes its metadata, flushed.
    ///
    /// # Errors
    /// [`LogError::Write`].
    pub fn new(writer: W, metadata: &Metadata) -> Result<Self, LogError> {
        let mut mcap = WriteOptions::new()
            .profile("")
            .library(concat!("furuta-log ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Lz4))
            .chunk_size(None) // closed by time, in `write`
            // a chunk is written whole or not at all: no half-made headers in a killed run's file
            .disable_seeking(true)
            .create(writer)
            .map_err(LogError::of_write)?;
        mcap.write_metadata(&mcap::records::Metadata {
            name: metadata::RECORD_NAME.to_owned(),
            metadata: metadata.to_map(),
        })
        .map_err(LogError::of_write)?;
        let schema = schema::json_schema(metadata.command_unit()).to_string();
        let schema = mcap
            .add_schema(schema::SCHEMA_NAME, "jsonschema", schema.as_bytes())
            .map_err(LogError::of_write)?;
        let channel = mcap
            .add_channel(schema, TOPIC, "json", &BTreeMap::new())
            .map_err(LogError::of_write)?;
        mcap.flush().map_err(LogError::of_write)?;
        let since_epoch = || {
            let now = SystemTime::now().duration_since(UNIX_EPOCH);
            u64::try_from(now.unwrap_or_default().as_nanos()).unwrap_or(u64::MAX / 2)
        };
        let started = metadata.extra.get(STARTED).and_then(|ns| ns.parse().ok());
        Ok(Self {
            mcap,
            channel,
            started_ns: started.unwrap_or_else(since_epoch),
            chunk_start: 0.0,
            written: 0,
            kept: 0,
            json: Vec::with_capacity(512),
        })
    }

    /// Appends one record. What was written more than 100 ms of the rig's clock ago has been handed to the system.
    ///
    /// # Errors
    /// [`LogError::Write`]: the log is then as good as it was; further writes fail too.
    pub fn write(&mut self, record: &Record) -> Result<(), LogError> {
        if record.t - self.chunk_start >= CHUNK_SECONDS {
            self.mcap.flush().map_err(LogError::of_write)?;
            self.kept = self.written;
            self.chunk_start = record.t;
        }
        self.json.clear();
        serde_json::to_writer(&mut self.json, record).map_err(LogError::Encode)?;
        // A float to integer cast saturates, so that no t can make it panic.
        let log_time = self.started_ns.saturating_add((record.t * 1e9) as u64);
        let header = MessageHeader {
            channel_id: self.channel,
            sequence: record.seq,
            log_time,
            publish_time: log_time,
        };
        self.mcap
            .write_to_known_channel(&header, &self.json)
            .map_err(LogError::of_write)?;
        self.written += 1;
        Ok(())
    }

    /// Number of records written.
    #[must_use]
    pub fn written(&self) -> u64 {
        self.written
    }

    /// Number of records handed to the system: what remains where writing fails.
    #[must_use]
    pub fn kept(&self) -> u64 {
        self.kept
    }

    /// Says what the system granted the run's loop (priority, locked memory), by name; flushed, as the metadata at the
    /// beginning.
    ///
    /// # Errors
    /// [`LogError::Write`].
    pub fn write_real_time(&mut self, granted: &BTreeMap<String, String>) -> Result<(), LogError> {
        self.mcap
            .write_metadata(&mcap::records::Metadata {
                name: metadata::REAL_TIME_RECORD.to_owned(),
                metadata: granted.clone(),
            })
            .and_then(|()| self.mcap.flush())
            .map_err(LogError::of_write)?;
        self.kept = self.written;
        Ok(())
    }

    /// Says how punctual the run's loop was: after its last record.
    ///
    /// # Errors
    /// [`LogError::Write`].
    pub fn write_timing(&mut self, timing: &Timing) -> Result<(), LogError> {
        // The records before it are then whole, whatever becomes of this one.
        self.mcap.flush().map_err(LogError::of_write)?;
        self.kept = self.written;
        self.mcap
            .write_metadata(&mcap::records::Metadata {
                name: timing::RECORD_NAME.to_owned(),
                metadata: timing.to_map()?,
            })
            .map_err(LogError::of_write)
    }

    /// Writes the index and ends the log.
    ///
    /// # Errors
    /// [`LogError::Write`].
    pub fn finish(mut self) -> Result<W, LogError> {
        self.mcap.finish().map_err(LogError::of_write)?;
        let mut writer = self.mcap.into_inner();
        writer.flush().map_err(|e| LogError::of_write(e.into()))?;
        Ok(writer)
    }
}
