//! What `diagnose`, `identify calibrate` and `identify validate` are given, a rig and recordings of it, and how they answer.

use std::io::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};

use furuta_ident::Task;
use furuta_ident::recording::{Notice, Recording, Selection, against_rig};
use furuta_model::Rig;

use crate::failure::Failure;
use crate::streams::{self, note};

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
    /// Use every N-th sample of each recording. The command of a sample becomes the mean of the N commands until the next one used: right where N
    /// sample periods are short against the motion (below 10 ms, say), too coarse for friction and play where they are not.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    every: u32,
    /// Use this span of each recording, seconds from its first sample (2.5..60).
    #[arg(long, value_name = "A..B", value_parser = span)]
    span: Option<Range<f64>>,
}

/// A span of time, `A..B`.
fn span(text: &str) -> Result<Range<f64>, String> {
    let (from, to) = text.split_once("..").ok_or("give it as A..B, seconds")?;
    let seconds = |text: &str| text.trim().parse::<f64>().ok().filter(|s| s.is_finite());
    match (seconds(from), seconds(to)) {
        (Some(from), Some(to)) if from < to => Ok(from..to),
        _ => Err("give two numbers of seconds, the smaller first: 2.5..60".to_owned()),
    }
}

/// From so many seconds on, a person is told beforehand.
const LONG: f64 = 60.0;

impl RecordedArgs {
    /// Says how long it will take where that is long.
    pub(crate) fn foretell(&self, task: Task, recordings: &[Recording]) {
        let samples = recordings.iter().map(Recording::len).sum();
        let seconds = task.seconds(samples);
        if seconds > LONG {
            let minutes = (seconds / 60.0).ceil();
            note!(
                "{samples} samples: this takes some {minutes} minutes; --every N uses every N-th sample (every {}: a minute), --span A..B some seconds of each \
                 recording",
                (seconds / LONG).ceil()
            );
        }
    }

    /// The recordings, and those of `more`, all checked against the rig; what was noticed is added to `notices`.
    pub(crate) fn load(
        &self,
        rig: &Rig,
        more: &[PathBuf],
        notices: &mut Vec<String>,
    ) -> Result<[Vec<Recording>; 2], Failure> {
        let selection = Selection {
            every: self.every as usize,
            span: self.span.clone(),
        };
        let mut all = Vec::new();
        for path in self.data.iter().chain(more) {
            let (recording, found) = Recording::load_with_notices(path)?;
            self.judge(found, notices)?;
            all.push(recording.select(&selection)?);
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

/// Writes a file whole.
pub(crate) fn write(path: &Path, text: &str) -> Result<(), Failure> {
    std::fs::write(path, text)
        .map_err(|e| Failure::new(format!("{}: cannot be written: {e}", path.display())))
}
