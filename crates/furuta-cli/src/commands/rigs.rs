//! `furuta rigs`: what rigs there are, and what one is.

mod published;
mod show;

use std::io::Write;

use furuta_model::Rig;
use serde_json::{Value, json};

use crate::failure::Failure;
use crate::streams;

/// List the built-in rigs, or show one: parameters, limits, effects, linearisation, poles and controllability upright
/// and hanging, and where it comes from a paper, the paper's figures beside ours.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Built-in rig or rig file to show; all built-in rigs are listed if not given.
    #[arg(value_name = "NAME")]
    name: Option<String>,
    /// Print the rig as a rig file, to start an own one from.
    #[arg(long, requires = "name", conflicts_with = "json")]
    toml: bool,
    /// Print JSON in place of text.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut out = streams::output();
    match &args.name {
        None => list(args.json),
        Some(name) if args.toml => {
            let text = match Rig::builtin_text(name) {
                Some(text) => text.to_owned(),
                None => Rig::load(name)?.to_toml(),
            };
            Ok(out.write_all(text.as_bytes())?)
        }
        Some(name) if args.json => {
            let line = show::json(&Rig::load(name)?)?;
            Ok(writeln!(out, "{line}")?)
        }
        Some(name) => {
            let text = show::text(&Rig::load(name)?)?;
            Ok(out.write_all(text.as_bytes())?)
        }
    }
}

fn list(as_json: bool) -> Result<(), Failure> {
    let mut out = streams::output();
    let rigs = Rig::BUILTIN.iter().filter_map(|name| Rig::builtin(name));
    if as_json {
        let rigs: Value = rigs
            .map(|r| json!({"name": r.name, "source": r.source}))
            .collect();
        writeln!(out, "{rigs}")?;
    } else {
        for rig in rigs {
            writeln!(out, "{:20} {}", rig.name, rig.source)?;
        }
    }
    Ok(())
}
