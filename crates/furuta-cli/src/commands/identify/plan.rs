//! `furuta identify plan`: what to record so that the parameters of a rig become known.

use furuta_ident::calibrate::{Options, plan};
use furuta_model::Rig;

use crate::commands::recorded::answer;
use crate::failure::Failure;
use crate::outputs::{self, Output};

/// Propose recordings by what they would tell about the parameters of a rig file (D-optimal over a family of test
/// signals), with the commands that make them.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Built-in rig or rig file, effects included; its limits on voltage, arm angle and speeds are kept.
    #[arg(long, value_name = "RIG")]
    rig: String,
    /// Parameters that are to become known, by their keys; all that any of the signals would show if not given.
    #[arg(long, value_name = "KEY,KEY,...", value_delimiter = ',')]
    free: Vec<String>,
    /// Parameters that a ruler or a balance knows better.
    #[arg(
        long = "fix",
        alias = "hold",
        value_name = "KEY,KEY,...",
        value_delimiter = ','
    )]
    hold: Vec<String>,
    /// Samples per second of the recordings.
    #[arg(long, value_name = "HZ", default_value_t = 500.0)]
    rate: f64,
    /// How many experiments to propose, each chosen to add most to those before.
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u8).range(1..=10))]
    experiments: u8,
    /// Length of the predictions that the calibration will fit, s.
    #[arg(long, value_name = "SECONDS", default_value_t = 2.0)]
    horizon: f64,
    /// Print JSON in place of text.
    #[arg(long)]
    json: bool,
    /// Write the same JSON to this file.
    #[arg(long, value_name = "OUT.json", value_parser = outputs::json())]
    json_file: Option<Output>,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let rig = Rig::load(&args.rig)?;
    let options = Options {
        free: args.free.clone(),
        hold: args.hold.clone(),
        horizon: args.horizon,
        ..Options::default()
    };
    let plan = plan(&rig, &options, args.rate, args.experiments.into())?;
    answer(
        args.json,
        args.json_file.as_ref(),
        || plan.to_json(),
        || plan.summary(&args.rig),
    )
}
