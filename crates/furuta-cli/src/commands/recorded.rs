//! What `diagnose`, `identify calibrate` and `identify validate` are given, a rig and recordings of it, and how they
//! answer.

use std::io::Write;
use std::ops::Range;
use std::path::PathBuf;

use furuta_ident::recording::{Command, Excerpt, Recording, RecordingError};
use furuta_ident::selection::{SelectionError, read_unseen, select};
use furuta_ident::{Pendulum, Task};
use furuta_input::shown;
use furuta_model::Rig;

use crate::failure::Failure;
use crate::outputs::{self, Output};
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
    /// Print JSON in place of text.
    #[arg(long)]
    json: bool,
    /// Write the same JSON to this file.
    #[arg(long, value_name = "OUT.json", value_parser = outputs::json())]
    json_file: Option<Output>,
    /// Use recordings even if they look as if a convention were broken (degrees, alpha from hanging, a flipped sign,
    /// another rig).
    #[arg(long)]
    accept_suspicious: bool,
    /// Use every N-th sample of each recording. The command of a sample becomes the mean of the N commands until the
    /// next one used: right where N sample periods are short against the motion (below 10 ms, say), too coarse for
    /// friction and backlash where they are not.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    every: u32,
    /// Use this span of each recording, seconds from its first sample (2.5..60).
    #[arg(long, value_name = "A..B", value_parser = span, allow_hyphen_values = true)]
    span: Option<Range<f64>>,
    /// What the command does between two rows of a recording: `held`, or `smooth` where the file keeps every N-th row
    /// of a faster controller. Where it jumps then, predictions stop and start anew.
    #[arg(long, value_name = "held|smooth", default_value_t = Command::Held)]
    command: Command,
}

/// A span of time, `A..B`.
fn span(text: &str) -> Result<Range<f64>, String> {
    let (from, to) = text.split_once("..").ok_or("give it as A..B, seconds")?;
    let seconds = |text: &str| text.trim().parse::<f64>().ok().filter(|s| s.is_finite());
    match (seconds(from), seconds(to)) {
        (Some(from), Some(to)) if 0.0 <= from && from < to => Ok(from..to),
        _ => Err("give two numbers of seconds from 0, the smaller first: 2.5..60".to_owned()),
    }
}

/// A person is told beforehand of what takes longer than this, s.
const LONG: f64 = 60.0;

/// How many samples there are to look at.
pub(crate) fn samples_used(recordings: &[Recording]) -> usize {
    recordings.iter().map(Recording::samples_used).sum()
}

impl RecordedArgs {
    /// Says how long it will take where that is long.
    pub(crate) fn foretell(&self, task: Task, samples: usize) {
        let seconds = task.seconds(samples);
        if seconds > LONG {
            let minutes = (seconds / 60.0).ceil();
            note!(
                "{samples} samples: this takes some {minutes} minutes; --every N uses every N-th sample \
                 (every {}: a minute), --span A..B some seconds of each recording",
                (seconds / LONG).ceil()
            );
        }
    }

    /// The recordings, and those of `unseen`, all checked against the rig; what was noticed is added to `notices`. A
    /// suspicious one is left out where the
    /// others suffice.
    pub(crate) fn load(
        &self,
        rig: &Rig,
        unseen: &[PathBuf],
        pendulum: Pendulum,
        notices: &mut Vec<String>,
    ) -> Result<[Vec<Recording>; 2], Failure> {
        self.load_from(&self.data, unseen, (rig, pendulum), notices)
    }

    /// The same from other files than those of the command's first arguments.
    pub(crate) fn load_from(
        &self,
        data: &[PathBuf],
        unseen: &[PathBuf],
        (rig, pendulum): (&Rig, Pendulum),
        notices: &mut Vec<String>,
    ) -> Result<[Vec<Recording>; 2], Failure> {
        let part = Excerpt {
            every: self.every as usize,
            span: self.span.clone(),
            command: self.command,
        };
        let read = |path: &PathBuf| {
            let (recording, notices) = Recording::load_with_notices(path)?;
            Ok::<_, RecordingError>((recording.select(&part)?, notices))
        };
        let search = data.iter().map(read).collect::<Result<Vec<_>, _>>()?;
        let (mut verify, mut unreadable) = (Vec::new(), Vec::new());
        for path in unseen {
            verify.extend(read_unseen(&shown(path), read(path), &mut unreadable)?);
        }
        let selection =
            select(search, verify, rig, self.accept_suspicious, pendulum).map_err(refused)?;
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
