//! `furuta convert`: a recording from CSV to MCAP or back, without loss of columns.

use std::io::Write;
use std::path::{Path, PathBuf};

use furuta_ident::recording::{NoticeKind, Recording};
use serde_json::json;

use crate::failure::Failure;

/// Convert a recording between CSV and MCAP. Every column is kept; what is noticed about the recording is printed.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Recording to read, CSV or MCAP.
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// File to write; its ending, .csv or .mcap, gives the format.
    #[arg(value_name = "OUT")]
    output: PathBuf,
    /// Print one line of JSON in place of text.
    #[arg(long)]
    json: bool,
}

type Writer = fn(&Recording, &Path) -> Result<(), furuta_ident::recording::RecordingError>;

/// Runs the command. Of a log that was cut off, what could be read is written before the command fails.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let (input, output) = (args.input.display(), args.output.display());
    let write = writer(&args.output)?;
    let (recording, notices) = Recording::salvage(&args.input)?;
    if same_file(&args.input, &args.output) {
        return Err(Failure::new(format!(
            "{output}: is the recording itself; give another file to write"
        )));
    }
    write(&recording, &args.output)?;

    let cut_off = notices.iter().find_map(|notice| match &notice.kind {
        NoticeKind::CutOff { what } => Some(what),
        _ => None,
    });
    let mut out = std::io::stdout().lock();
    if args.json {
        let notices: Vec<String> = notices.iter().map(ToString::to_string).collect();
        let line = json!({
            "input": args.input.to_string_lossy(), "output": args.output.to_string_lossy(), "samples": recording.len(),
            "seconds": recording.duration(), "columns": recording.column_names(), "notices": notices,
        });
        writeln!(out, "{line}")?;
    } else {
        for notice in notices
            .iter()
            .filter(|notice| !matches!(notice.kind, NoticeKind::CutOff { .. }))
        {
            eprintln!("{notice}");
        }
        writeln!(
            out,
            "{output}: {} samples, {:.3} s, columns {}",
            recording.len(),
            recording.duration(),
            recording.column_names().join(", ")
        )?;
    }
    match cut_off {
        Some(what) => Err(Failure::new(format!(
            "{input}: {what}; they are in {output}"
        ))),
        None => Ok(()),
    }
}

fn writer(output: &Path) -> Result<Writer, Failure> {
    let ending = output
        .extension()
        .unwrap_or_default()
        .to_string_lossy()
        .to_lowercase();
    match ending.as_str() {
        "csv" => Ok(|recording, path| recording.write_csv(path)),
        "mcap" => Ok(|recording, path| recording.write_mcap(path)),
        _ => Err(Failure::new(format!(
            "{}: unknown ending; give a file that ends in .csv or .mcap",
            output.display()
        ))),
    }
}

fn same_file(input: &Path, output: &Path) -> bool {
    matches!((input.canonicalize(), output.canonicalize()), (Ok(input), Ok(output)) if input == output)
}
