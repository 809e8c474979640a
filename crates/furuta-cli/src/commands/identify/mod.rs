//! `furuta identify`: a rig's model from its recordings.

mod frf;

use crate::failure::Failure;

/// Models from recordings: frequency responses.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(clap::Subcommand, Debug)]
enum What {
    Frf(frf::Args),
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    match &args.what {
        What::Frf(args) => frf::run(args),
    }
}
