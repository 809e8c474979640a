//! The file that a path names.

use std::fs::{self, Metadata};
use std::io::{self, ErrorKind, Read};
use std::path::{Path, PathBuf};

use crate::Kind;

/// Links that are followed to a file that is not there yet.
const MOST_LINKS: usize = 40;
/// Bytes that tell what a file holds.
const START: u64 = 256;

/// A file that shall not, or cannot, be written.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// A folder has this name.
    #[error("{}: is a folder; give the name of a file", path.display())]
    Folder {
        /// The path as given.
        path: PathBuf,
    },
    /// There is no such folder, or nothing can be written into it.
    #[error("{}: cannot be created: {source}; choose a folder that exists and is writable", path.display())]
    Create {
        /// The path as given.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Something stands there that may be all there is of it.
    #[error("{}: exists already, and {}; give another name", path.display(), kind.words())]
    Exists {
        /// The path as given.
        path: PathBuf,
        /// What was to be written.
        kind: Kind,
    },
    /// The file is write-protected.
    #[error("{}: is write-protected; give another name", path.display())]
    Protected {
        /// The path as given.
        path: PathBuf,
    },
    /// Writing failed. An older file at the path is as it was.
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        /// The path as given.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}

/// The file that a path names, behind its symbolic links. It need not exist; its folder must.
#[derive(Clone, Debug)]
pub struct Place {
    pub(crate) path: PathBuf,
    pub(crate) at: At,
}

/// How a place is written to.
#[derive(Clone, Debug)]
pub(crate) enum At {
    /// Standard output, beside what the program prints there.
    StandardOutput,
    /// A device, a pipe: directly.
    Stream,
    /// A file, by its canonical path.
    File(PathBuf),
}

impl Place {
    /// Looks where a path leads to. Nothing is opened: a serial port would notice.
    ///
    /// # Errors
    /// [`FileError::Folder`], [`FileError::Create`].
    pub fn of(path: &Path) -> Result<Self, FileError> {
        let folder = || FileError::Folder { path: path.into() };
        if path.as_os_str().as_encoded_bytes().ends_with(b"/") {
            return Err(folder());
        }
        let at = match fs::metadata(path) {
            Ok(found) if found.is_dir() => return Err(folder()),
            Ok(_) if STANDARD_OUTPUT.iter().any(|name| path == Path::new(name)) => {
                At::StandardOutput
            }
            Ok(found) if !found.is_file() || is_descriptor(path) => At::Stream,
            _ => At::File(target(path).map_err(|source| FileError::Create {
                path: path.into(),
                source,
            })?),
        };
        let path = path.into();
        Ok(Self { path, at })
    }

    /// Whether this is the file that another path names, be it by a link.
    #[must_use]
    pub fn is(&self, other: &Path) -> bool {
        let there = |path: &Path| identity(&fs::metadata(path).ok()?);
        let (this, other_file) = (there(&self.path), there(other));
        if let (Some(this), Some(other)) = (this, other_file) {
            return this == other;
        }
        match &self.at {
            At::File(file) => target(other).is_ok_and(|other| other == *file),
            At::Stream | At::StandardOutput => false,
        }
    }

    /// Whether this is a device, a pipe or standard output, in which nothing can be lost.
    #[must_use]
    pub fn is_stream(&self) -> bool {
        !matches!(self.at, At::File(_))
    }

    /// Refuses to replace a file that cannot be made again: see [`Kind`]. An empty file is no loss.
    ///
    /// # Errors
    /// [`FileError::Exists`], [`FileError::Protected`].
    pub fn may_be_replaced_by(&self, kind: Kind) -> Result<(), FileError> {
        let At::File(file) = &self.at else {
            return Ok(());
        };
        let Ok(found) = fs::metadata(file) else {
            return Ok(());
        };
        let path = || self.path.clone();
        if found.permissions().readonly() {
            return Err(FileError::Protected { path: path() });
        }
        let mut start = Vec::new();
        // What cannot be read is not known to be replaceable.
        let read = fs::File::open(file).and_then(|f| f.take(START).read_to_end(&mut start));
        if found.len() == 0 || (read.is_ok() && kind.replaces(&start)) {
            return Ok(());
        }
        Err(FileError::Exists { path: path(), kind })
    }

    /// Tries whether its folder takes a file; nothing stays behind.
    ///
    /// # Errors
    /// [`FileError::Create`].
    pub fn is_writable(&self) -> Result<(), FileError> {
        let At::File(file) = &self.at else {
            return Ok(());
        };
        match tempfile::tempfile_in(folder(file)) {
            Ok(_) => Ok(()),
            Err(source) => Err(FileError::Create {
                path: self.path.clone(),
                source,
            }),
        }
    }
}

/// The folder of a canonical path.
pub(crate) fn folder(file: &Path) -> &Path {
    file.parent().unwrap_or(Path::new("/"))
}

const STANDARD_OUTPUT: [&str; 3] = ["/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"];

/// Names of what the program has open already: what they lead to is the shell's matter.
fn is_descriptor(path: &Path) -> bool {
    ["/dev/stdin", "/dev/stderr", "/dev/fd", "/proc/self/fd"]
        .iter()
        .any(|name| path.starts_with(name))
}

/// The canonical path of a file, there or not.
fn target(path: &Path) -> io::Result<PathBuf> {
    match path.canonicalize() {
        Err(error) if error.kind() == ErrorKind::NotFound => {}
        done => return done,
    }
    let mut path = path.to_owned();
    for _ in 0..MOST_LINKS {
        let Ok(next) = fs::read_link(&path) else {
            break;
        };
        path.pop();
        path.push(next);
    }
    let no_name = || io::Error::new(ErrorKind::InvalidInput, "this names no file");
    let name = path.file_name().ok_or_else(no_name)?;
    let folder = match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    Ok(folder.canonicalize()?.join(name))
}

/// Device and number of the file: the same for every link to it.
#[cfg(unix)]
fn identity(of: &Metadata) -> Option<(u64, u64)> {
    use std::os::unix::fs::MetadataExt;
    Some((of.dev(), of.ino()))
}

/// Not known here: paths are compared.
#[cfg(not(unix))]
fn identity(_: &Metadata) -> Option<(u64, u64)> {
    None
}
