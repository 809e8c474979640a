//! A file that notices when it is removed, replaced or truncated while it is written.

use std::fs::{File, Metadata};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// What became of a file under its writer's hands.
#[derive(Copy, Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Tampered {
    /// Its name is gone.
    #[error("was removed or renamed")]
    Removed,
    /// Another file has its name.
    #[error("was replaced by another file")]
    Replaced,
    /// It is shorter than what was written.
    #[error("was truncated")]
    Truncated,
}

/// A log file. What is not a regular file (a device, a pipe) is only written.
#[derive(Debug)]
pub struct WatchedFile {
    file: File,
    path: PathBuf,
    /// Its end as far as it was written.
    length: u64,
    position: u64,
    is_regular: bool,
}

impl WatchedFile {
    /// Watches a file that was opened at this path just now, and is empty.
    ///
    /// # Errors
    /// The system does not tell what kind of file it is.
    pub fn new(file: File, path: &Path) -> io::Result<Self> {
        Ok(Self {
            is_regular: file.metadata()?.is_file(),
            path: path.to_owned(),
            file,
            length: 0,
            position: 0,
        })
    }

    /// Asked before each write and at the end; a file that was truncated in between is longer again afterwards.
    fn check(&self) -> io::Result<()> {
        if !self.is_regular {
            return Ok(());
        }
        let open = self.file.metadata()?;
        let found = match std::fs::metadata(&self.path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Some(Tampered::Removed),
            // A folder that may not be read any more says nothing about the file.
            Err(_) => None,
            Ok(named) if !is_same(&open, &named) => Some(Tampered::Replaced),
            Ok(_) => None,
        };
        let found = found.or_else(|| (open.len() < self.length).then_some(Tampered::Truncated));
        found.map_or(Ok(()), |tampered| Err(io::Error::other(tampered)))
    }
}

#[cfg(unix)]
fn is_same(a: &Metadata, b: &Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    (a.dev(), a.ino()) == (b.dev(), b.ino())
}

/// An open file cannot be removed or replaced there.
#[cfg(not(unix))]
fn is_same(_: &Metadata, _: &Metadata) -> bool {
    true
}

impl Write for WatchedFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.check()?;
        let n = self.file.write(bytes)?;
        self.position += n as u64;
        self.length = self.length.max(self.position);
        Ok(n)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()?;
        self.check()
    }
}

impl Seek for WatchedFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.position = self.file.seek(to)?;
        Ok(self.position)
    }
}
