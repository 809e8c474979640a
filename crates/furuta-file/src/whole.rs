//! A file that takes its place when it is complete.

use std::fs::{self, File};
use std::io::{self, BufWriter, ErrorKind, Seek, SeekFrom, Stdout, Write};
use std::path::{Path, PathBuf};

use tempfile::{Builder, NamedTempFile};

use crate::place::{At, folder};
use crate::{FileError, Place};

/// A file that is written beside its place, under another name, and moved there when it is complete and on the disk.
/// One that is dropped leaves nothing behind, and an older file as it was.
///
/// ```
/// use furuta_file::WholeFile;
/// use std::io::Write;
/// # let folder = tempfile::tempdir()?;
/// let path = folder.path().join("rig.toml");
/// let mut file = WholeFile::create(&path)?;
/// file.write_all(b"name = \"bench\"\n")?;
/// assert!(!path.exists());
/// file.commit()?;
/// assert_eq!(std::fs::read(&path)?, b"name = \"bench\"\n");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct WholeFile {
    path: PathBuf,
    to: To,
}

#[derive(Debug)]
enum To {
    StandardOutput(Stdout),
    Stream(BufWriter<File>),
    Beside {
        file: BufWriter<NamedTempFile>,
        place: PathBuf,
    },
}

impl WholeFile {
    /// Begins to write.
    ///
    /// # Errors
    /// [`FileError`] of [`Place::of`]; [`FileError::Create`].
    pub fn create(path: &Path) -> Result<Self, FileError> {
        let place = Place::of(path)?;
        let to = match place.at {
            At::StandardOutput => Ok(To::StandardOutput(io::stdout())),
            // At its end, where it is what standard output was directed to.
            At::Stream => File::options()
                .append(true)
                .open(path)
                .map(|file| To::Stream(BufWriter::new(file))),
            At::File(place) => beside(&place).map(|file| To::Beside {
                file: BufWriter::new(file),
                place,
            }),
        };
        match to {
            Ok(to) => Ok(Self {
                path: path.into(),
                to,
            }),
            Err(source) => Err(FileError::Create {
                path: path.into(),
                source,
            }),
        }
    }

    /// Puts the complete file into its place.
    ///
    /// # Errors
    /// [`FileError::Write`]: the disk is full, or the folder has gone.
    pub fn commit(self) -> Result<(), FileError> {
        let done = match self.to {
            To::StandardOutput(mut out) => out.flush(),
            To::Stream(mut file) => file.flush(),
            To::Beside { file, place } => put(file, &place),
        };
        done.map_err(|source| FileError::Write {
            path: self.path,
            source,
        })
    }
}

fn put(file: BufWriter<NamedTempFile>, place: &Path) -> io::Result<()> {
    let file = file.into_inner().map_err(|e| e.into_error())?;
    file.as_file().sync_all()?;
    file.persist(place).map_err(|e| e.error)?;
    Ok(())
}

/// An empty file beside this one, with the permissions that it has, or that a new one would have.
pub(crate) fn beside(place: &Path) -> io::Result<NamedTempFile> {
    let name = place.file_name().unwrap_or_default().to_string_lossy();
    let prefix = format!("{name}.");
    let mut builder = Builder::new();
    builder.prefix(&prefix).suffix(".partial");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let file = builder.tempfile_in(folder(place))?;
    if let Ok(older) = fs::metadata(place) {
        file.as_file().set_permissions(older.permissions())?;
    }
    Ok(file)
}

impl Write for WholeFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.to {
            To::StandardOutput(out) => out.write(bytes),
            To::Stream(file) => file.write(bytes),
            To::Beside { file, .. } => file.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.to {
            To::StandardOutput(out) => out.flush(),
            To::Stream(file) => file.flush(),
            To::Beside { file, .. } => file.flush(),
        }
    }
}

impl Seek for WholeFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match &mut self.to {
            To::StandardOutput(_) => Err(ErrorKind::NotSeekable.into()),
            To::Stream(file) => file.seek(to),
            To::Beside { file, .. } => file.seek(to),
        }
    }
}

/// Writes a file whole.
///
/// # Errors
/// [`FileError`].
pub fn write(path: &Path, content: &[u8]) -> Result<(), FileError> {
    let mut file = WholeFile::create(path)?;
    if let Err(source) = file.write_all(content) {
        return Err(FileError::Write {
            path: path.into(),
            source,
        });
    }
    file.commit()
}
