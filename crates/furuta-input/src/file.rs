//! Files that a person names: which of them are opened at all, and how much of them is read.

use std::fs::{File, FileType, Metadata};
use std::io::{self, BufReader, Read, Seek};
use std::path::{Path, PathBuf};

use crate::quoted;

/// How much is read of a recording, and how much memory it may take.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Bytes of the file.
    pub file: u64,
    /// Bytes of memory for what is read from it.
    pub memory: u64,
    /// Bytes of one line of text.
    pub line: usize,
    /// Bytes of one record of a log, and of one chunk once it is unpacked.
    pub record: usize,
    /// Columns, and entries of what a recording says of itself.
    pub names: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            file: 2 << 30,
            memory: 512 << 20,
            line: 1 << 20,
            record: 64 << 20,
            names: 1000,
        }
    }
}

/// Bytes of a rig file or a controller file: a thousand times what one has.
pub const TEXT_LIMIT: u64 = 4 << 20;

/// Why a file is not read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum InputError {
    /// It is not there, or the system does not give it.
    #[error("{}: {source}", shown(path))]
    Io {
        /// The path as given.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// A directory, a pipe, a device.
    #[error(
        "{} is {kind}, not {wanted}: give the path of a file{}",
        shown(path),
        hint(kind)
    )]
    Kind {
        /// The path as given.
        path: PathBuf,
        /// What it is.
        kind: &'static str,
        /// What was to be read.
        wanted: &'static str,
    },
    /// The file begins with zeros: it was created, and its content never written.
    #[error(
        "{} is {kind}, not {wanted}: its content was never written (a full disk, a machine switched off, a \
         copy that failed); copy it or make it again",
        shown(path)
    )]
    Zeros {
        /// The path as given.
        path: PathBuf,
        /// `a file of zero bytes` or `a sparse file of zero bytes`.
        kind: &'static str,
        /// What was to be read.
        wanted: &'static str,
    },
    /// More than is read.
    #[error(
        "{}: {bytes} bytes; at most {limit} are read of {wanted}: give a shorter one",
        shown(path)
    )]
    TooLarge {
        /// The path as given.
        path: PathBuf,
        /// Its size, or what was read of it.
        bytes: u64,
        /// The limit.
        limit: u64,
        /// What was to be read.
        wanted: &'static str,
    },
    /// Not UTF-8.
    #[error(
        "{}: line {line}: not UTF-8 text; save {wanted} as plain text in UTF-8",
        shown(path)
    )]
    NotText {
        /// The path as given.
        path: PathBuf,
        /// Line of the first byte that is no text, from 1.
        line: usize,
        /// What was to be read.
        wanted: &'static str,
    },
}

/// The path as a message shows it.
#[must_use]
pub fn shown(path: &Path) -> String {
    let text = path.to_string_lossy();
    if text.chars().all(crate::is_printable) {
        text.into_owned()
    } else {
        quoted(&text).to_string()
    }
}

fn hint(kind: &str) -> &'static str {
    if kind.contains("pipe") {
        ", and write what comes through the pipe to one first"
    } else {
        ""
    }
}

/// A file opened for reading, by a person's wish: a regular file that is not empty of content and not too large.
#[derive(Debug)]
pub struct Input {
    file: File,
    path: PathBuf,
    wanted: &'static str,
    limit: u64,
    read: u64,
}

impl Input {
    /// Opens a file of which at most `limit` bytes are read; `wanted` says what it should be, for messages (`a
    /// recording`).
    ///
    /// # Errors
    /// [`InputError`]: not there, no regular file, begins with zeros, too large.
    pub fn open(
        path: impl AsRef<Path>,
        wanted: &'static str,
        limit: u64,
    ) -> Result<Self, InputError> {
        let path = path.as_ref();
        let io = |source| InputError::Io {
            path: path.into(),
            source,
        };
        // Before it is opened: to open a pipe that nothing writes to would wait forever.
        let about = std::fs::metadata(path).map_err(io)?;
        if let Some(kind) = special(about.file_type()) {
            return Err(InputError::Kind {
                path: path.into(),
                kind,
                wanted,
            });
        }
        if about.len() > limit {
            return Err(InputError::TooLarge {
                path: path.into(),
                bytes: about.len(),
                limit,
                wanted,
            });
        }
        let mut file = File::open(path).map_err(io)?;
        let mut start = Vec::new();
        file.by_ref().take(16).read_to_end(&mut start).map_err(io)?;
        // No text and no log begins with a zero.
        if start.first() == Some(&0) {
            return Err(InputError::Zeros {
                path: path.into(),
                kind: zeros(&about),
                wanted,
            });
        }
        file.rewind().map_err(io)?;
        Ok(Self {
            file,
            path: path.into(),
            wanted,
            limit,
            read: 0,
        })
    }

    /// The file's size now, bytes.
    ///
    /// # Errors
    /// [`InputError::Io`].
    pub fn size(&self) -> Result<u64, InputError> {
        let about = self.file.metadata().map_err(|source| InputError::Io {
            path: self.path.clone(),
            source,
        })?;
        Ok(about.len())
    }

    /// From the beginning again.
    ///
    /// # Errors
    /// [`InputError::Io`].
    pub fn again(&self) -> Result<Self, InputError> {
        Self::open(&self.path, self.wanted, self.limit)
    }

    /// With a buffer.
    #[must_use]
    pub fn buffered(self) -> BufReader<Self> {
        BufReader::with_capacity(128 << 10, self)
    }
}

impl Read for Input {
    /// As of a file; one that grows beyond the limit while it is read ends in an error.
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let got = self.file.read(into)?;
        self.read += got as u64;
        if self.read > self.limit {
            return Err(io::Error::other(InputError::TooLarge {
                path: self.path.clone(),
                bytes: self.read,
                limit: self.limit,
                wanted: self.wanted,
            }));
        }
        Ok(got)
    }
}

/// A small text file whole.
///
/// # Errors
/// [`InputError`].
pub fn read_text(path: impl AsRef<Path>, wanted: &'static str) -> Result<String, InputError> {
    let path = path.as_ref();
    let mut input = Input::open(path, wanted, TEXT_LIMIT)?;
    let mut bytes = Vec::new();
    input
        .read_to_end(&mut bytes)
        .map_err(|source| InputError::Io {
            path: path.into(),
            source,
        })?;
    String::from_utf8(bytes).map_err(|error| {
        let valid = error.utf8_error().valid_up_to();
        let before = error.as_bytes().iter().take(valid);
        InputError::NotText {
            path: path.into(),
            line: 1 + before.filter(|&&byte| byte == b'\n').count(),
            wanted,
        }
    })
}

/// What it is if it is no regular file.
fn special(kind: FileType) -> Option<&'static str> {
    if kind.is_file() {
        return None;
    }
    if kind.is_dir() {
        return Some("a directory");
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt as _;
        if kind.is_fifo() {
            return Some("a pipe (FIFO)");
        }
        if kind.is_socket() {
            return Some("a socket");
        }
        if kind.is_char_device() || kind.is_block_device() {
            return Some("a device");
        }
    }
    Some("a special file")
}

fn zeros(about: &Metadata) -> &'static str {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt as _;
        if about.blocks() * 512 < about.len() {
            return "a sparse file of zero bytes";
        }
    }
    let _ = about;
    "a file of zero bytes"
}
