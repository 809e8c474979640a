//! The commands: one file each, with `Args` and `run`.

mod convert;
mod demo;
mod diagnose;
mod emulate;
mod run;

use crate::failure::Failure;

/// What the program can do.
#[derive(clap::Subcommand, Debug)]
pub(crate) enum Command {
    Demo(demo::Args),
    Diagnose(diagnose::Args),
    Emulate(emulate::Args),
    Run(run::Args),
    Convert(convert::Args),
}

impl Command {
    /// Runs the command.
    pub(crate) fn run(&self) -> Result<(), Failure> {
        match self {
            Self::Demo(args) => demo::run(args),
            Self::Diagnose(args) => diagnose::run(args),
            Self::Emulate(args) => emulate::run(args),
            Self::Run(args) => run::run(args),
            Self::Convert(args) => convert::run(args),
        }
    }
}
