//! What `diagnose`, `identify calibrate` and `identify validate` are given, a rig and recordings of it, and how they answer.

use std::io::Write;
use std::path::PathBuf;

use furuta_ident::recording::{Notice, Recording, against_rig};
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
    /// The recordings, and those of `more`, all checked against the rig; what was noticed is added to `notices`.
    pub(crate) fn load(
        &self,
        rig: &Rig,
        more: &[PathBuf],
        notices: &mut Vec<String>,
    ) -> Result<[Vec<Recording>; 2], Failure> {
        let mut all = Vec::new();
        for path in self.data.iter().chain(more) {
            let (recording, found) = Recording::load_with_notices(path)?;
            self.judge(found, notices)?;
            all.push(recording);
        }
        self.judge(against_rig(&all, rig), notices)?;
        let more = all.split_off(self.data.len());
        Ok([all, more])
    }

    fn judge(&self, found: Vec<Notice>, notices: &mut Vec<String>) -> Result<(), Failure> {
        for notice in found {
            if notice.kind.is_suspicion() && !self.accept_suspicious {
                return Err(Failure::new(format!(
                    "{notice}; mend the recording, or pass --accept-suspicious if it is right as it is"
                )));
            }
            notices.push(notice.to_string());
        }
        Ok(())
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
