//! What is wrong with a controller file.

use crate::section::SettingsError;
use crate::trajectory::TrajectoryError;
use furuta_input::{InputError, foreign, quoted};

/// What is wrong with a controller file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FileError {
    /// A file that cannot be read.
    #[error("controller file {0}")]
    Unreadable(#[from] InputError),
    /// Not TOML.
    #[error("controller file, line {line}: {}", foreign(message))]
    Syntax {
        /// Where, from 1.
        line: usize,
        /// What.
        message: String,
    },
    /// A section that controller files do not have.
    #[error(
        "controller file, line {line}: no section `{}`; there are {known}",
        quoted(name)
    )]
    UnknownSection {
        /// Where, from 1.
        line: usize,
        /// What was given.
        name: String,
        /// What there is.
        known: String,
    },
    /// A kind that the section does not have.
    #[error(
        "controller file, line {line}: [{section}] has no kind {}; it has {known}",
        quoted(kind)
    )]
    UnknownKind {
        /// Where, from 1.
        line: usize,
        /// The section.
        section: &'static str,
        /// What was given.
        kind: String,
        /// What there is.
        known: String,
    },
    /// A key that the section does not have.
    #[error(
        "controller file, line {line}: [{section}] has no key `{}`; {known}",
        quoted(key)
    )]
    UnknownKey {
        /// Where, from 1.
        line: usize,
        /// The section.
        section: &'static str,
        /// What was given.
        key: String,
        /// What there is.
        known: String,
    },
    /// A value of the wrong kind.
    #[error("controller file, line {line}: {} must be {wanted}", quoted(key))]
    WrongType {
        /// Where, from 1.
        line: usize,
        /// Which key.
        key: String,
        /// What it must be.
        wanted: String,
    },
    /// A value that is not possible.
    #[error("controller file, line {line}: {error}")]
    Setting {
        /// Where, from 1.
        line: usize,
        /// What is wrong with it.
        error: SettingsError,
    },
    /// A trajectory that is not possible.
    #[error("controller file, line {line}: trajectory: {error}")]
    Trajectory {
        /// Where, from 1.
        line: usize,
        /// What is wrong with it.
        error: TrajectoryError,
    },
    /// Any of these in a file with a name.
    #[error("{}: {error}", quoted(path))]
    InFile {
        /// The file.
        path: String,
        /// What is wrong in it.
        error: Box<FileError>,
    },
}
