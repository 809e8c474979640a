//! The `furuta` command: simulate, design, run and diagnose rotary inverted pendulums.

// See [`streams`], [`outputs`].
#![warn(clippy::print_stdout, clippy::print_stderr, clippy::disallowed_methods)]

mod commands;
mod cyclictest;
mod failure;
mod interrupt;
mod outputs;
mod print;
mod real_time;
mod streams;

use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches};

use crate::streams::note;

/// Rotary inverted (Furuta) pendulum: simulate it, control it, and find out what its model is missing.
#[derive(clap::Parser, Debug)]
#[command(name = "furuta", version)]
struct Cli {
    #[command(subcommand)]
    command: commands::Command,
    /// Replace files that are there already, inputs of the command included. Without it only pages, pictures and JSON
    /// are replaced.
    #[arg(long, global = true)]
    force: bool,
}

/// The same command for which a negative number is a value, whatever option it stands behind: the option's range check
/// answers, not a word about an unknown flag.
fn negative_numbers(command: clap::Command) -> clap::Command {
    command
        .mut_args(|arg| match arg.get_action().takes_values() {
            true => arg.allow_negative_numbers(true),
            false => arg,
        })
        .mut_subcommands(negative_numbers)
}

/// Exit code 0: done; 1: failed, with one line that says what and what to do; 2: not a valid command line; 130: a
/// diagnosis that Ctrl-C (or SIGTERM, SIGHUP) interrupted, with what was found by then. A run, an emulated rig that
/// such a signal ends is done: 0.
fn main() -> ExitCode {
    interrupt::survive_file_limits();
    let mut command = negative_numbers(Cli::command());
    let matches = command.get_matches_mut();
    let cli = Cli::from_arg_matches(&matches).unwrap_or_else(|e| e.format(&mut command).exit());
    let done = outputs::check(&command, &matches, cli.force).and_then(|()| cli.command.run());
    let (code, failure) = match done {
        Ok(code) => (code, None),
        Err(failure) => (ExitCode::FAILURE, Some(failure.to_string())),
    };
    let failures: Vec<String> = failure.into_iter().chain(outputs::failed()).collect();
    if failures.is_empty() {
        return code;
    }
    note!("furuta: {}", failures.join("; "));
    ExitCode::FAILURE
}
