//! `furuta convert`: a recording from CSV to MCAP or back, without loss.

use std::io::Write;
use std::path::{Path, PathBuf};

use furuta_ident::recording::{Format, Transcoded, transcode};
use serde_json::json;

use crate::failure::Failure;
use crate::outputs::{self, Output};
use crate::streams::{self, note};

/// Convert a recording between CSV and MCAP, there and back without loss: of a log of `furuta run` every bit of every
/// sample and all that it says of its run, of any other CSV file every byte. Samples pass one by one: a recording may
/// be longer than memory. What is noticed about the recording is printed.
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

/// Runs the command. Of a log that was cut off, what could be read is written before the command fails.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let (input, output) = (args.input.display(), &args.output);
    let format = format(output.path())?;
    let converted = transcode(&args.input, output.path(), format)?;
    say(&converted, args)?;
    match converted.cut_off {
        Some(what) => Err(Failure::new(format!(
            "{input}: {what}; they are in {output}"
        ))),
        None => Ok(()),
    }
}

fn say(converted: &Transcoded, args: &Args) -> Result<(), Failure> {
    let Transcoded {
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
