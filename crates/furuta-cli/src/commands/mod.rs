//! The commands: one file each, with `Args` and `run`.

mod controllers;
mod convert;
mod demo;
mod design;
mod diagnose;
mod effects;
mod emulate;
mod export;
mod foresight;
mod identify;
mod latency;
mod progress;
mod recorded;
mod replay;
mod rigs;
mod run;
mod signal;
mod simulate;
mod study;

use crate::failure::Failure;

/// What the program can do.
#[derive(clap::Subcommand, Debug)]
pub(crate) enum Command {
    Demo(demo::Args),
    Rigs(rigs::Args),
    Effects(effects::Args),
    Simulate(simulate::Args),
    Design(design::Args),
    Controllers(controllers::Args),
    Identify(identify::Args),
    Diagnose(diagnose::Args),
    Emulate(emulate::Args),
    Run(run::Args),
    Latency(latency::Args),
    Convert(convert::Args),
    Export(export::Args),
    Replay(replay::Args),
    Study(study::Args),
}

impl Command {
    /// Runs the command.
    pub(crate) fn run(&self) -> Result<u8, Failure> {
        match self {
            Self::Demo(args) => demo::run(args)?,
            Self::Rigs(args) => rigs::run(args)?,
            Self::Effects(args) => effects::run(args)?,
            Self::Simulate(args) => simulate::run(args)?,
            Self::Design(args) => design::run(args)?,
            Self::Controllers(args) => controllers::run(args)?,
            Self::Identify(args) => identify::run(args)?,
            Self::Diagnose(args) => return diagnose::run(args),
            Self::Emulate(args) => emulate::run(args)?,
            Self::Run(args) => run::run(args)?,
            Self::Latency(args) => latency::run(args)?,
            Self::Convert(args) => convert::run(args)?,
            Self::Export(args) => export::run(args)?,
            Self::Replay(args) => replay::run(args)?,
            Self::Study(args) => study::run(args)?,
        }
        Ok(crate::DONE)
    }
}
