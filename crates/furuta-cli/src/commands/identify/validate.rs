//! `furuta identify validate`: how well a rig file predicts recordings that it was not fitted to.

use std::io::Write;
use std::path::{Path, PathBuf};

use furuta_ident::validate::validate;
use furuta_model::Rig;

use super::calibrate::recordings;
use super::write;
use crate::failure::Failure;

/// Judge a rig file by recordings that it was not fitted to: fit in per cent, residual tests with their 99 % bounds, errors after fixed times.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Recordings of one rig, CSV or MCAP.
    #[arg(value_name = "DATA", required = true)]
    data: Vec<PathBuf>,
    /// Built-in rig or rig file.
    #[arg(long, value_name = "RIG")]
    rig: String,
    /// Write the answer as JSON to this file; `-` for standard output, in place of text.
    #[arg(long, value_name = "OUT")]
    json: Option<PathBuf>,
    /// Use recordings even if they look as if a convention were broken (degrees, alpha from hanging, a flipped sign, another rig).
    #[arg(long)]
    accept_suspicious: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let rig = Rig::load(&args.rig)?;
    let mut notices = Vec::new();
    let data = recordings(&args.data, &rig, args.accept_suspicious, &mut notices)?;
    let mut validation = validate(&data, &rig)?;
    validation.notices.splice(0..0, notices);
    let to_stdout = args.json.as_deref() == Some(Path::new("-"));
    if let Some(path) = args.json.as_deref().filter(|_| !to_stdout) {
        write(path, &(validation.to_json() + "\n"))?;
    }
    let text = if to_stdout {
        validation.to_json() + "\n"
    } else {
        validation.summary()
    };
    std::io::stdout().lock().write_all(text.as_bytes())?;
    Ok(())
}
