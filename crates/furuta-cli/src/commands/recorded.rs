//! What `diagnose`, `identify calibrate` and `identify validate` are given, a rig and recordings of it, and how they answer.

use std::io::Write;
use std::path::{Path, PathBuf};

use furuta_ident::recording::Recording;
use furuta_ident::selection::{SelectionError, read_unseen, select};
use furuta_model::Rig;

use crate::failure::Failure;
use crate::streams;

/// A rig, recordings of it, and where the answer goes.
#[derive(clap::Args, Debug)]
pub(crate) struct RecordedArgs {
    /// Recordings of one rig, CSV or MCAP.
    #[arg(value_name = "DATA", required = true)]
    data: Vec<PathBuf>,
    /// Built-in rig or rig file: the model as it is known.
    #[arg(long, value_name = "RIG")]
    pub(crate) rig: String,
    /// Write the answer as JSON to this file; `-` for standard output, in place of text.
    #[arg(long, value_name = "OUT")]
    json: Option<PathBuf>,
    /// Use recordings even if they look as if a convention were broken (degrees, alpha from hanging, a flipped sign, another rig).
    #[arg(long)]
    accept_suspicious: bool,
}

impl RecordedArgs {
    /// The recordings, and those of `unseen`, all checked against the rig; what was noticed is added to `notices`. A
    /// suspicious one is left out where the
    /// others suffice.
    pub(crate) fn load(
        &self,
        rig: &Rig,
        unseen: &[PathBuf],
        notices: &mut Vec<String>,
    ) -> Result<[Vec<Recording>; 2], Failure> {
        let search = self
            .data
            .iter()
            .map(Recording::load_with_notices)
            .collect::<Result<Vec<_>, _>>()?;
        let (mut verify, mut unreadable) = (Vec::new(), Vec::new());
        for path in unseen {
            let name = path.display().to_string();
            let read = Recording::load_with_notices(path);
            verify.extend(read_unseen(&name, read, &mut unreadable)?);
        }
        let selection = select(search, verify, rig, self.accept_suspicious).map_err(refused)?;
        let said = unreadable.iter().chain(&selection.notices);
        notices.extend(said.map(ToString::to_string));
        Ok([selection.recordings, selection.verify])
    }

    /// Prints and writes the answer: as text, as JSON, or text and a file of JSON.
    pub(crate) fn answer(
        &self,
        json: impl FnOnce() -> String,
        text: impl FnOnce() -> String,
    ) -> Result<(), Failure> {
        let text = match self.json.as_deref() {
            Some(path) if path == Path::new("-") => json() + "\n",
            Some(path) => {
                write(path, &(json() + "\n"))?;
                text()
            }
            None => text(),
        };
        streams::output().write_all(text.as_bytes())?;
        Ok(())
    }
}

/// A refusal in one line, with the way around it where there is one.
fn refused(error: SelectionError) -> Failure {
    match error {
        SelectionError::Suspicious(notice) => Failure::new(format!(
            "{notice}; mend the recording, or pass --accept-suspicious if it is right as it is"
        )),
        other => other.into(),
    }
}

/// Writes a file whole.
pub(crate) fn write(path: &Path, text: &str) -> Result<(), Failure> {
    std::fs::write(path, text)
        .map_err(|e| Failure::new(format!("{}: cannot be written: {e}", path.display())))
}
