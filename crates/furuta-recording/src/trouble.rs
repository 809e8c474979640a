//! What can go wrong while a file is gone through, before it is known which file that is.

use furuta_log::{CsvError, LogError};

use super::RecordingError;

pub(super) enum Trouble {
    Log(LogError),
    Csv(CsvError),
    Recording(RecordingError),
    /// The writer's.
    Write(std::io::Error),
    /// None: what was wanted was read.
    Enough,
}

impl From<LogError> for Trouble {
    fn from(error: LogError) -> Self {
        Self::Log(error)
    }
}

impl From<CsvError> for Trouble {
    fn from(error: CsvError) -> Self {
        Self::Csv(error)
    }
}

impl From<RecordingError> for Trouble {
    fn from(error: RecordingError) -> Self {
        Self::Recording(error)
    }
}

impl Trouble {
    /// As the error of a recording in this file.
    pub(super) fn of(self, file: &str) -> RecordingError {
        let reason = match self {
            Self::Recording(error) => return error,
            Self::Write(source) => {
                return RecordingError::Io {
                    path: file.into(),
                    source,
                };
            }
            Self::Log(error) => error.to_string(),
            Self::Csv(error) => error.to_string(),
            Self::Enough => "read in part".to_owned(),
        };
        RecordingError::Log {
            file: file.into(),
            reason,
        }
    }
}
