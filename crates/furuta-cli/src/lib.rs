//! The `furuta` command: simulate, design, run and diagnose rotary inverted pendulums. A library, so that the Python
//! package carries the command as well.

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

use std::ffi::OsString;
use std::io::Write;

use clap::{CommandFactory, FromArgMatches};

use crate::streams::note;

/// Exit codes, as shells have them.
const DONE: u8 = 0;
const FAILED: u8 = 1;

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

/// Runs the command with these arguments, of which the first is the program's name.
///
/// Exit code 0: done; 1: failed, with one line that says what and what to do; 2: not a valid command line; 130: a
/// diagnosis that Ctrl-C (or SIGTERM, SIGHUP) interrupted, with what was found by then. A run, an emulated rig that
/// such a signal ends is done: 0. A mistyped command line and `--help` end the process.
///
/// ```
/// assert_eq!(furuta_cli::main(["furuta", "rigs"].map(Into::into)), 0);
/// ```
pub fn main(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    interrupt::survive_file_limits();
    let mut command = negative_numbers(Cli::command());
    let matches = command
        .try_get_matches_from_mut(arguments)
        .unwrap_or_else(|e| e.exit());
    let cli = Cli::from_arg_matches(&matches).unwrap_or_else(|e| e.format(&mut command).exit());
    let done = outputs::check(&command, &matches, cli.force).and_then(|()| cli.command.run());
    let (code, failure) = match done {
        Ok(code) => (code, None),
        Err(failure) => (FAILED, Some(failure.to_string())),
    };
    // In another program's process, nothing else writes what a line without its end holds back.
    let held_back = streams::output().flush().err().map(|e| e.to_string());
    let failures = failure.into_iter().chain(held_back);
    let mut failures: Vec<String> = failures.chain(outputs::failed()).collect();
    // A command that failed at standard output fails at the rest of it again.
    failures.dedup();
    if failures.is_empty() {
        return code;
    }
    note!("furuta: {}", failures.join("; "));
    FAILED
}
