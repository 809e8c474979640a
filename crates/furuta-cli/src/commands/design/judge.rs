//! `furuta design judge`: the closed loop of a controller file.

use std::io::Write;
use std::path::PathBuf;

use furuta_ctrl::{ControllerFile, Site};
use furuta_design::rig_loop::Law;
use furuta_model::Rig;
use serde_json::json;

use super::closed::{JudgeArgs, poles_json};
use super::gains;
use crate::failure::Failure;
use crate::streams;

/// Poles, margins and a rehearsal of any controller file that is linear near upright: what a design says of its own
/// gain. An `mpc` is judged as the regulator that it is where no limit is met, a `pid` without its low pass, a
/// `scheduled_lqr` while the arm rests.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Built-in rig or rig file.
    #[arg(long, value_name = "RIG")]
    rig: String,
    /// Controller file.
    #[arg(long, value_name = "CONTROLLER.toml")]
    controller: PathBuf,
    /// Samples per second; the command is held between samples.
    #[arg(long, value_name = "HZ", default_value_t = 500.0, value_parser = super::rate)]
    rate: f64,
    #[command(flatten)]
    judge: JudgeArgs,
    /// Print one line of JSON in place of text.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let rig = Rig::load(&args.rig)?;
    let file = ControllerFile::load(&args.controller)?;
    let controller = &file.config.controller;
    let law = Law::of_controller(controller, &Site::of(&rig, 1.0 / args.rate))
        .map_err(|e| Failure::new(format!("{}: {e}", args.controller.display())))?;
    let judged = args
        .judge
        .judge_system(&rig, law, Some(args.rate), &file.config)?;
    let k = [&law.gain[..], &[law.integral]].concat();
    let k = &k[..if law.integral == 0.0 { 4 } else { 5 }];
    let kind = controller.spec().id;
    let mut out = streams::output();
    if args.json {
        let mut line = json!({
            "rig": rig.name, "rate": args.rate, "kind": kind, "k": k, "poles": poles_json(&judged),
        });
        judged.extend(&mut line);
        return Ok(writeln!(out, "{line}")?);
    }
    writeln!(
        out,
        "{}: {kind}, near upright u = -K [theta, alpha, theta_dot, alpha_dot]",
        rig.name
    )?;
    gains(&mut out, k, &rig)?;
    judged.print(&mut out)
}
