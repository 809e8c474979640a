//! Why a log cannot be replayed.

use furuta_ctrl::{ConfigError, FileError};

use crate::identity::Mismatch;
use crate::pilot::TaskError;
use crate::provenance::{FORMAT_VERSION, SOFTWARE};

/// A log cannot be replayed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReplayError {
    /// The file ends before what it says of its run, or never said it.
    #[error(
        "the log says nothing about its run (it ends before, or `furuta run` did not write it): there is \
         nothing to replay it with"
    )]
    NoMetadata,
    /// No sample.
    #[error("the log has no samples: there is nothing to replay")]
    Empty,
    /// A log from before logs held all that it takes.
    #[error(
        "the log was written by {} and has no `{missing}`: it is older than replay, or no log of `furuta \
         run`; `furuta convert` and `diagnose` read it, a run of {SOFTWARE} can be replayed",
        named(.software)
    )]
    Older {
        /// What wrote it.
        software: String,
        /// Key of the metadata that it lacks.
        missing: &'static str,
    },
    /// A log whose keys mean something else.
    #[error("the log was written by {}, in format {found}; this is {SOFTWARE}, which replays format \
        {FORMAT_VERSION}: use the furuta that wrote it", named(.software))]
    Format {
        /// What wrote it.
        software: String,
        /// Its format.
        found: String,
    },
    /// Another version may compute otherwise by right.
    #[error(
        "the log was written by {}, this is {SOFTWARE}, which may command otherwise by right: use the \
         furuta that wrote it, or --any-version to compare all the same",
        named(.log)
    )]
    OtherVersion {
        /// What wrote it.
        log: String,
    },
    /// The rig's hello is damaged.
    #[error("what the rig said of itself cannot be read from the log: {0}")]
    Hello(#[source] serde_json::Error),
    /// No rig has such a period.
    #[error("the log's sampling period is {period_us} us, must be between 100 and 1000000")]
    Period {
        /// Sampling period (us).
        period_us: u32,
    },
    /// The task is damaged.
    #[error("what the run was asked to do cannot be read from the log: {0}")]
    Task(#[from] TaskError),
    /// The log's rig file is damaged.
    #[error("the log's rig file: {cause}")]
    RigFile {
        /// What is wrong in it.
        cause: String,
    },
    /// The log's controller file is damaged.
    #[error("the log's controller file: {0}")]
    ControllerFile(#[from] FileError),
    /// The rig has no such controller.
    #[error(transparent)]
    Controller(#[from] ConfigError),
    /// The rig file given is of another rig.
    #[error("the log is of another rig than the rig file given: {}; give that rig's file, or --any-rig to \
        replay it all the same", mismatches.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))]
    AnotherRig {
        /// What differs.
        mismatches: Vec<Mismatch>,
    },
}

fn named(software: &str) -> &str {
    if software.is_empty() {
        "an unknown program"
    } else {
        software
    }
}
