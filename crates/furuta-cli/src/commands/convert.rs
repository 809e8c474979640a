//! `furuta convert`: a recording from CSV to MCAP or back, without loss.

use std::io::Write;
use std::path::{Path, PathBuf};

use furuta_ident::recording::{Notice, NoticeKind, Recording, RecordingError, kept_source};
use furuta_log::{FIELDS, Log, is_csv, read_csv, read_from, write_csv};
use serde_json::json;

use crate::failure::Failure;
use crate::outputs::{self, Output};
use crate::streams::{self, note};

/// Convert a recording between CSV and MCAP, there and back without loss: of a log of `furuta run` every bit of every sample and all that it says
/// of its run, of any other CSV file every byte. What is noticed about the recording is printed.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Recording to read, CSV or MCAP.
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// File to write; its ending, .csv or .mcap, gives the format.
    #[arg(value_name = "OUT", value_parser = outputs::data())]
    output: Output,
    /// Print one line of JSON in place of text.
    #[arg(long)]
    json: bool,
}

/// What to write.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
enum Format {
    Csv,
    Mcap,
}

/// What was converted, for the user.
struct Converted {
    samples: usize,
    seconds: f64,
    columns: Vec<String>,
    notices: Vec<String>,
    /// What the log says where it ends early.
    cut_off: Option<String>,
}

/// Runs the command. Of a log that was cut off, what could be read is written before the command fails.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let (input, output) = (args.input.display(), &args.output);
    let format = format(args.output.path())?;
    let bytes = std::fs::read(&args.input).map_err(|source| RecordingError::Io {
        path: args.input.clone(),
        source,
    })?;
    let converted = match log_of_a_run(&args.input, &bytes)? {
        Some(log) => convert_log(&log, args, format)?,
        None => convert_recording(&bytes, args, format)?,
    };
    say(&converted, args)?;
    match converted.cut_off {
        Some(what) => Err(Failure::new(format!(
            "{input}: {what}; they are in {output}"
        ))),
        None => Ok(()),
    }
}

/// The log, if this is one that a run wrote, in either format. A converted recording says which columns are its own, a run has them all.
fn log_of_a_run(path: &Path, bytes: &[u8]) -> Result<Option<Log>, Failure> {
    if is_csv(bytes) {
        let log = read_csv(bytes).map_err(|e| Failure::new(format!("{}: {e}", path.display())))?;
        return Ok(Some(log));
    }
    // What is wrong with an MCAP file is said by the recording's reader.
    Ok(read_from(bytes).ok().filter(|log| {
        !log.records.is_empty()
            && log
                .metadata
                .as_ref()
                .is_some_and(|metadata| !metadata.extra.contains_key("columns"))
    }))
}

/// Bit for bit, without a look at what the samples mean.
fn convert_log(log: &Log, args: &Args, format: Format) -> Result<Converted, Failure> {
    match format {
        Format::Csv => args.output.write_by(|file| write_csv(log, file))?,
        Format::Mcap => args.output.write_by(|file| log.write_to(file).map(drop))?,
    }
    // What a person should know about it, and what would make it useless to diagnose.
    let notices = match Recording::salvage(&args.input) {
        Ok((_, notices)) => said(&notices),
        Err(error) => vec![error.to_string()],
    };
    let seconds = match (log.records.first(), log.records.last()) {
        (Some(first), Some(last)) => last.t - first.t,
        _ => 0.0,
    };
    Ok(Converted {
        samples: log.records.len(),
        seconds,
        columns: FIELDS.iter().map(|field| field.name.to_owned()).collect(),
        notices,
        cut_off: log.notice.as_ref().map(ToString::to_string),
    })
}

/// A recording of any other origin: checked; a CSV file is kept whole within the log, so that the way back gives its bytes.
fn convert_recording(bytes: &[u8], args: &Args, format: Format) -> Result<Converted, Failure> {
    let (recording, notices) = Recording::salvage(&args.input)?;
    let is_mcap = bytes.starts_with(b"\x89MCAP");
    match (is_mcap, format) {
        (false, Format::Mcap) => recording.write_mcap_keeping(args.output.path(), Some(bytes))?,
        (true, Format::Csv) => match kept_source(bytes) {
            Some(source) => args.output.write_by(|file| file.write_all(&source))?,
            None => recording.write_csv(args.output.path())?,
        },
        (true, Format::Mcap) => {
            recording.write_mcap_keeping(args.output.path(), kept_source(bytes).as_deref())?;
        }
        (false, Format::Csv) => recording.write_csv(args.output.path())?,
    }
    let cut_off = notices.iter().find_map(|notice| match &notice.kind {
        NoticeKind::CutOff { what } => Some(what.clone()),
        _ => None,
    });
    Ok(Converted {
        samples: recording.len(),
        seconds: recording.duration(),
        columns: recording
            .column_names()
            .into_iter()
            .map(str::to_owned)
            .collect(),
        notices: said(&notices),
        cut_off,
    })
}

/// That it is cut off is said at the end.
fn said(notices: &[Notice]) -> Vec<String> {
    notices
        .iter()
        .filter(|notice| !matches!(notice.kind, NoticeKind::CutOff { .. }))
        .map(ToString::to_string)
        .collect()
}

fn say(converted: &Converted, args: &Args) -> Result<(), Failure> {
    let Converted {
        samples,
        seconds,
        columns,
        notices,
        cut_off,
    } = converted;
    let mut out = streams::output();
    if args.json {
        let notices: Vec<_> = cut_off.iter().chain(notices).collect();
        let line = json!({
            "input": args.input.to_string_lossy(), "output": args.output.path().to_string_lossy(), "samples": samples,
            "seconds": seconds, "columns": columns, "notices": notices,
        });
        writeln!(out, "{line}")?;
    } else {
        for notice in notices {
            note!("{notice}");
        }
        writeln!(
            out,
            "{}: {samples} samples, {seconds:.3} s, columns {}",
            args.output,
            columns.join(", ")
        )?;
    }
    Ok(())
}

fn format(output: &Path) -> Result<Format, Failure> {
    let ending = output
        .extension()
        .unwrap_or_default()
        .to_string_lossy()
        .to_lowercase();
    match ending.as_str() {
        "csv" => Ok(Format::Csv),
        "mcap" => Ok(Format::Mcap),
        _ => Err(Failure::new(format!(
            "{}: unknown ending; give a file that ends in .csv or .mcap",
            output.display()
        ))),
    }
}
