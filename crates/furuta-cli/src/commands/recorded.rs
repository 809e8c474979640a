//! What `diagnose`, `identify calibrate` and `identify validate` are given, a rig and recordings of it, and how they answer.

use std::io::Write;
use std::path::PathBuf;

use furuta_ident::recording::Recording;
use furuta_ident::selection::{SelectionError, read_unseen, select};
use furuta_model::Rig;

use crate::failure::Failure;
use crate::outputs::{self, Output};
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
    /// Print JSON in place of text.
    #[arg(long)]
    json: bool,
    /// Write the same JSON to this file.
    #[arg(long, value_name = "OUT.json", value_parser = outputs::json())]
    json_file: Option<Output>,
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

    /// Prints the answer, as text or as JSON, and writes a file of JSON where one was asked for.
    pub(crate) fn answer(
        &self,
        json: impl Fn() -> String,
        text: impl Fn() -> String,
    ) -> Result<(), Failure> {
        answer(self.json, self.json_file.as_ref(), json, text)
    }
}

/// As [`RecordedArgs::answer`], for a command without recordings.
pub(crate) fn answer(
    as_json: bool,
    file: Option<&Output>,
    json: impl Fn() -> String,
    text: impl Fn() -> String,
) -> Result<(), Failure> {
    if let Some(file) = file {
        file.write(json() + "\n");
    }
    let answer = if as_json { json() + "\n" } else { text() };
    streams::output().write_all(answer.as_bytes())?;
    Ok(())
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
