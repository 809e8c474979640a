//! A file that can be read while it grows.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use crate::place::At;
use crate::whole::beside;
use crate::{FileError, Place};

/// A log's file: what was written is there for readers, even if the program is killed. It is written at its place if
/// nothing stands there, else beside it, as `NAME.xxxxxx.partial`, until [`GrowingFile::keep`] lets it replace what
/// stands there.
#[derive(Debug)]
pub struct GrowingFile {
    path: PathBuf,
    grows: Grows,
}

#[derive(Debug)]
enum Grows {
    Stream,
    InPlace(PathBuf),
    Beside { partial: PathBuf, place: PathBuf },
}

impl GrowingFile {
    /// Creates the file, to be written by whoever holds it.
    ///
    /// # Errors
    /// [`FileError`] of [`Place::of`]; [`FileError::Create`].
    pub fn create(path: &Path) -> Result<(File, Self), FileError> {
        let begun = match Place::of(path)?.at {
            At::StandardOutput | At::Stream => File::options()
                .append(true)
                .open(path)
                .map(|file| (file, Grows::Stream)),
            At::File(place) => begin(place),
        };
        match begun {
            Ok((file, grows)) => Ok((
                file,
                Self {
                    path: path.into(),
                    grows,
                },
            )),
            Err(source) => Err(FileError::Create {
                path: path.into(),
                source,
            }),
        }
    }

    /// Where it grows.
    #[must_use]
    pub fn path(&self) -> &Path {
        match &self.grows {
            Grows::Stream | Grows::InPlace(_) => &self.path,
            Grows::Beside { partial, .. } => partial,
        }
    }

    /// The file is complete: it takes its place, once it is on the disk.
    ///
    /// # Errors
    /// The system's. The file stays at [`Self::path`].
    pub fn keep(&self) -> io::Result<()> {
        match &self.grows {
            Grows::Stream => Ok(()),
            Grows::InPlace(place) => File::open(place)?.sync_all(),
            Grows::Beside { partial, place } => {
                File::open(partial)?.sync_all()?;
                fs::rename(partial, place)
            }
        }
    }

    /// Nothing came of it: it is removed, and what stood there stays.
    pub fn discard(self) {
        match &self.grows {
            Grows::Stream => {}
            // One that cannot be removed holds nothing of worth.
            Grows::InPlace(file) | Grows::Beside { partial: file, .. } => {
                let _ = fs::remove_file(file);
            }
        }
    }
}

fn begin(place: PathBuf) -> io::Result<(File, Grows)> {
    match File::create_new(&place) {
        Ok(file) => Ok((file, Grows::InPlace(place))),
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
            let (file, partial) = beside(&place)?.keep().map_err(|e| e.error)?;
            Ok((file, Grows::Beside { partial, place }))
        }
        Err(error) => Err(error),
    }
}
