//! The memory that a recording may take.

use furuta_input::Limits;

use super::RecordingError;

/// Counts the memory taken while a file is read.
pub(super) struct Budget<'a> {
    file: &'a str,
    limit: u64,
    left: u64,
}

impl<'a> Budget<'a> {
    pub(super) const fn new(file: &'a str, limits: &Limits) -> Self {
        Self {
            file,
            limit: limits.memory,
            left: limits.memory,
        }
    }

    /// Takes `bytes` of what is left.
    pub(super) fn take(&mut self, bytes: usize) -> Result<(), RecordingError> {
        let left = self.left.checked_sub(bytes as u64);
        self.left = left.ok_or_else(|| RecordingError::TooMuchMemory {
            file: self.file.into(),
            limit: self.limit,
        })?;
        Ok(())
    }
}
