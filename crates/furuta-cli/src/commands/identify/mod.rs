//! `furuta identify`: a rig's model from its recordings.

mod calibrate;
mod compare;
mod frf;
mod plan;
pub(crate) mod tf;
mod validate;

use crate::failure::Failure;

/// Models from recordings: frequency responses, transfer functions and what they know that a rig file does not, the
/// parameters of the rig file, and how well they predict.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(clap::Subcommand, Debug)]
enum What {
    Frf(frf::Args),
    Tf(tf::Args),
    Compare(compare::Args),
    Calibrate(calibrate::Args),
    Validate(validate::Args),
    Plan(plan::Args),
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    match &args.what {
        What::Frf(args) => frf::run(args),
        What::Tf(args) => tf::run(args),
        What::Compare(args) => compare::run(args),
        What::Calibrate(args) => calibrate::run(args),
        What::Validate(args) => validate::run(args),
        What::Plan(args) => plan::run(args),
    }
}
