//! The log of a run: an MCAP file with one JSON message per sample on the topic [`TOPIC`], its JSON schema beside it,
//! so that Foxglove, PlotJuggler and the official MCAP readers open it without plug-ins; and the rig file, the
//! controller, the units and the software version in a metadata record; at the end, in another, how punctual the loop
//! was ([`Timing`]).
//!
//! A chunk is closed and flushed for every 100 ms of samples: a run that is killed leaves a file that is readable up
//! to its last tenth of a second. [`read`] reads such a file too and says where it ends ([`Notice`]).
//!
//! ```
//! use std::io::Cursor;
//! use furuta_log::{LogWriter, Metadata, Mode, Record, read_from};
//!
//! let metadata = Metadata { rig: "qube-servo-2".into(), controller: "none".into(), ..Metadata::default() };
//! let mut log = LogWriter::new(Cursor::new(Vec::new()), &metadata)?;
//! for k in 0..500 {
//!     let t = f64::from(k) * 0.002;
//!     log.write(&Record { t, seq: k, u: (10.0 * t).sin(), mode: Mode::Excite, ..Record::default() })?;
//! }
//! let mut bytes = log.finish()?.into_inner();
//!
//! let log = read_from(&bytes[..])?;
//! assert_eq!(log.records.len(), 500);
//! assert_eq!(log.metadata.map(|m| m.rig), Some("qube-servo-2".to_owned()));
//! assert!(log.notice.is_none());
//!
//! bytes.truncate(bytes.len() / 2); // the run was killed
//! let log = read_from(&bytes[..])?;
//! assert!(!log.records.is_empty() && log.notice.is_some());
//! # Ok::<(), furuta_log::LogError>(())
//! ```
mod attachments;
mod chunk;
mod csv;
mod error;
mod histogram;
mod metadata;
mod number;
mod read;
mod record;
mod schema;
mod timing;
mod watched;
mod write;

pub use attachments::copy_attachment;
pub use csv::{
    CsvError, each_csv_record, is_csv, read_csv, write_csv, write_csv_head, write_csv_record,
};
pub use error::LogError;
pub use histogram::{Bucket, Histogram};
pub use metadata::{Metadata, STARTED};
pub use read::{Ending, Log, Notice, Part, each_part, each_record, read, read_from};
pub use record::{Mode, Record};
pub use schema::{COMMAND_UNIT, FIELDS, Field};
pub use timing::{Quantiles, Timing, TimingSummary};
pub use watched::{Tampered, WatchedFile};
pub use write::LogWriter;

/// Topic of the samples.
pub const TOPIC: &str = "/furuta/sample";
