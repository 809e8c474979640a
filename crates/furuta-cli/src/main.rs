//! The `furuta` command: simulate, design, run and diagnose rotary inverted pendulums.

// See [`streams`].
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod commands;
mod cyclictest;
mod failure;
mod interrupt;
mod print;
mod real_time;
mod streams;

use std::process::ExitCode;

use clap::Parser;

use crate::streams::note;

/// Rotary inverted (Furuta) pendulum: simulate it, control it, and find out what its model is missing.
#[derive(clap::Parser, Debug)]
#[command(name = "furuta", version)]
struct Cli {
    #[command(subcommand)]
    command: commands::Command,
}

/// Exit code 0: done; 1: failed, with one line that says what and what to do; 2: not a valid command line; 130: a diagnosis that Ctrl-C
/// (or SIGTERM, SIGHUP) interrupted, with what was found by then. A run, an emulated rig that such a signal ends is done: 0.
fn main() -> ExitCode {
    interrupt::survive_file_limits();
    match Cli::parse().command.run() {
        Ok(code) => code,
        Err(failure) => {
            note!("furuta: {failure}");
            ExitCode::FAILURE
        }
    }
}
