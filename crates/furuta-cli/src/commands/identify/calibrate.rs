//! `furuta identify calibrate`: the parameters of a rig file from recordings.

use std::path::PathBuf;

use furuta_ident::calibrate::{Options, calibrate};
use furuta_ident::{Pendulum, Task, report, validate};
use furuta_model::Rig;

use crate::commands::recorded::{RecordedArgs, samples_used};
use crate::failure::Failure;
use crate::outputs::{self, Output};

/// Fit the parameters of a rig file to recordings: first what they can tell and what only in combination, then values
/// with 95 % intervals.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    #[command(flatten)]
    recorded: RecordedArgs,
    /// Fit these parameters, by their keys in the rig file (arm.inertia, motor.torque_constant, arm.coulomb.torque);
    /// all that the recordings determine if not given.
    #[arg(long, value_name = "KEY,KEY,...", value_delimiter = ',')]
    free: Vec<String>,
    /// Hold these parameters although they show: those that a ruler or a balance knows better.
    #[arg(
        long = "fix",
        alias = "hold",
        value_name = "KEY,KEY,...",
        value_delimiter = ','
    )]
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
    /// What the pendulum did in DATA: swings; removed (taken off) or locked (hanging, held to the arm), so that the arm
    /// alone is looked at; alone (it swings, the arm is held) or driven (it swings, the arm moves as theta says), so
    /// that the pendulum is.
    #[arg(long, value_name = "STATE", default_value = "swings")]
    pendulum: Pendulum,
    /// All recordings count their angles from the rig's zeros: no encoder was switched off between them. Otherwise each
    /// has zeros of its own.
    #[arg(long)]
    same_zero: bool,
    /// Recordings with the pendulum taken off, to be fitted together with DATA.
    #[arg(long, value_name = "DATA", num_args = 1..)]
    removed: Vec<PathBuf>,
    /// Recordings with the pendulum locked to the arm, hanging, to be fitted together with DATA.
    #[arg(long, value_name = "DATA", num_args = 1..)]
    locked: Vec<PathBuf>,
    /// Recordings of the pendulum with the arm held, to be fitted together with DATA.
    #[arg(long, value_name = "DATA", num_args = 1..)]
    alone: Vec<PathBuf>,
    /// Recordings of the pendulum on an arm that moves as theta says, whatever u is, to be fitted together with DATA.
    #[arg(long, value_name = "DATA", num_args = 1..)]
    driven: Vec<PathBuf>,
    /// Recordings that the fit must not see: rig file and calibrated rig are judged by them, as
    /// `furuta identify validate` does.
    #[arg(long, value_name = "DATA", num_args = 1..)]
    verify: Vec<PathBuf>,
    /// Write a report, one HTML page that needs no network.
    #[arg(long, value_name = "OUT.html", value_parser = outputs::page())]
    report: Option<Output>,
    /// Write the rig file with the fitted values.
    #[arg(long, value_name = "OUT.toml", value_parser = outputs::data())]
    write_rig: Option<Output>,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let rig = Rig::load(&args.recorded.rig)?;
    let mut notices = Vec::new();
    let [data, unseen] = (args.recorded).load(&rig, &args.verify, args.pendulum, &mut notices)?;
    let mut beside = Vec::new();
    for (files, state) in [
        (&args.removed, Pendulum::Removed),
        (&args.locked, Pendulum::Locked),
        (&args.alone, Pendulum::Alone),
        (&args.driven, Pendulum::Driven),
    ] {
        let [read, _] = (args.recorded).load_from(files, &[], (&rig, state), &mut notices)?;
        beside.extend(read.into_iter().map(|recording| (state, recording)));
    }
    args.recorded.foretell(Task::Calibrate, samples_used(&data));
    let options = Options {
        free: args.free.clone(),
        hold: args.hold.clone(),
        profile: args.profile.clone(),
        horizon: args.horizon,
        body_length: args.body_length,
        pendulum: args.pendulum,
        same_zero: args.same_zero,
        beside,
    };
    let mut outcome = calibrate(&data, &rig, &options)?;
    if !unseen.is_empty() {
        let options = validate::Options {
            pendulum: args.pendulum,
            same_zero: args.same_zero,
        };
        outcome.verify(&unseen, &rig, options)?;
    }
    outcome.calibration.notices.splice(0..0, notices);
    if let Some(path) = &args.report {
        path.write(report::calibration(&outcome));
    }
    if let Some(path) = &args.write_rig {
        path.write(outcome.rig.to_toml());
    }
    let c = &outcome.calibration;
    args.recorded.answer(|| c.to_json(), || c.summary())
}
