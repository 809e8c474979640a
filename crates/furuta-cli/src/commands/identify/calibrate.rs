//! `furuta identify calibrate`: the parameters of a rig file from recordings.

use std::io::Write;
use std::path::{Path, PathBuf};

use furuta_ident::calibrate::{Options, calibrate};
use furuta_ident::recording::{Recording, against_rig};
use furuta_ident::report;
use furuta_ident::validate::validate;
use furuta_model::Rig;

use super::super::diagnose::{load, refuse_suspicion};
use super::write;
use crate::failure::Failure;

/// Fit the parameters of a rig file to recordings: first what they can tell and what only in combination, then values with 95 % intervals.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Recordings of one rig, CSV or MCAP; rates may differ, hanging and upright may be mixed.
    #[arg(value_name = "DATA", required = true)]
    data: Vec<PathBuf>,
    /// Built-in rig or rig file: the model as the data sheet describes it.
    #[arg(long, value_name = "RIG")]
    rig: String,
    /// Fit these parameters, by their keys in the rig file (arm.inertia, motor.torque_constant, arm.coulomb.torque); all that the recordings
    /// determine if not given.
    #[arg(long, value_name = "KEY,KEY,...", value_delimiter = ',')]
    free: Vec<String>,
    /// Hold these parameters although they show: those that a ruler or a balance knows better.
    #[arg(long, value_name = "KEY,KEY,...", value_delimiter = ',')]
    hold: Vec<String>,
    /// Draw the profile likelihood of these parameters: the cost along each, all others fitted anew.
    #[arg(long, value_name = "KEY,KEY,...", value_delimiter = ',')]
    profile: Vec<String>,
    /// Length of the predictions that are fitted where the pendulum hangs, s; near upright half a second at most.
    #[arg(long, value_name = "SECONDS", default_value_t = 2.0)]
    horizon: f64,
    /// Length of the pendulum from hinge to tip, m: neither centre of mass nor inertia lies beyond it.
    #[arg(long, value_name = "METRES")]
    body_length: Option<f64>,
    /// Recordings that the fit must not see: rig file and calibrated rig are judged by them, as `furuta identify validate` does.
    #[arg(long, value_name = "DATA", num_args = 1..)]
    verify: Vec<PathBuf>,
    /// Write the answer as JSON to this file; `-` for standard output, in place of text.
    #[arg(long, value_name = "OUT")]
    json: Option<PathBuf>,
    /// Write a report, one HTML page that needs no network.
    #[arg(long, value_name = "OUT.html")]
    report: Option<PathBuf>,
    /// Write the rig file with the fitted values.
    #[arg(long, value_name = "OUT.toml")]
    write_rig: Option<PathBuf>,
    /// Use recordings even if they look as if a convention were broken (degrees, alpha from hanging, a flipped sign, another rig).
    #[arg(long)]
    accept_suspicious: bool,
}

/// Recordings of one rig, checked against it; what was noticed is added to `notices`.
pub(super) fn recordings(
    paths: &[PathBuf],
    rig: &Rig,
    accept_suspicious: bool,
    notices: &mut Vec<String>,
) -> Result<Vec<Recording>, Failure> {
    let recordings = load(paths, accept_suspicious, notices)?;
    for notice in against_rig(&recordings, rig) {
        refuse_suspicion(&notice, accept_suspicious)?;
        notices.push(notice.to_string());
    }
    Ok(recordings)
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let rig = Rig::load(&args.rig)?;
    let mut notices = Vec::new();
    let data = recordings(&args.data, &rig, args.accept_suspicious, &mut notices)?;
    let options = Options {
        free: args.free.clone(),
        hold: args.hold.clone(),
        profile: args.profile.clone(),
        horizon: args.horizon,
        body_length: args.body_length,
    };
    let mut outcome = calibrate(&data, &rig, &options)?;
    outcome.calibration.notices.splice(0..0, notices);
    let c = &outcome.calibration;
    let to_stdout = args.json.as_deref() == Some(Path::new("-"));
    if let Some(path) = args.json.as_deref().filter(|_| !to_stdout) {
        write(path, &(c.to_json() + "\n"))?;
    }
    if let Some(path) = &args.report {
        write(path, &report::calibration(&outcome))?;
    }
    if let Some(path) = &args.write_rig {
        write(path, &outcome.rig.to_toml())?;
    }
    let mut text = if to_stdout {
        c.to_json() + "\n"
    } else {
        c.summary()
    };
    if !args.verify.is_empty() && !to_stdout {
        let unseen = recordings(&args.verify, &rig, args.accept_suspicious, &mut Vec::new())?;
        for (words, judged) in [("as given", &rig), ("calibrated", &outcome.rig)] {
            text += &format!("\nUnseen recordings, rig file {words}\n");
            text += &validate(&unseen, judged)?.summary();
        }
    }
    std::io::stdout().lock().write_all(text.as_bytes())?;
    Ok(())
}
