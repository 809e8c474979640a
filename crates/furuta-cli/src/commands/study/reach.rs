//! `furuta study reach`: how near to upright any command brings a hanging pendulum.

use std::io::Write;

use furuta_design::reach::Search;
use serde_json::json;

use super::rig_with;
use crate::commands::emulate::positive;
use crate::commands::progress::bar;
use crate::failure::Failure;
use crate::streams;

/// Search all commands within the command limit for those that bring the hanging pendulum nearest to upright: what
/// no swing-up can better.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Built-in rig or rig file.
    #[arg(long, value_name = "RIG")]
    rig: String,
    /// Replace a value of the rig file, for example motor.command_limit=15; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// The arm may go so far either way.
    #[arg(long, value_name = "RAD", default_value_t = std::f64::consts::TAU, value_parser = positive)]
    arm: f64,
    /// How long the pendulum may take.
    #[arg(long, value_name = "SECONDS", default_value_t = 2.5, value_parser = positive)]
    seconds: f64,
    /// Searches from different draws.
    #[arg(long, value_name = "N", default_value_t = 4)]
    restarts: u64,
    /// Print one line of JSON in place of text.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let rig = rig_with(&args.rig, &args.set)?;
    let search = Search {
        seconds: args.seconds,
        restarts: args.restarts,
        ..Search::new(args.arm)
    };
    let bar = bar(search.restarts * search.rounds);
    let r = search.run(&rig, &|done| bar.set_position(done))?;
    bar.finish_and_clear();
    let mut out = streams::output();
    if args.json {
        let line = json!({
            "rig": rig.name, "set": args.set, "arm_range": args.arm, "nearest": {"value": r.nearest, "unit": "rad"},
            "at": {"value": r.at, "unit": "s"},
            "work": {"value": r.work, "unit": "J"}, "friction": {"value": r.friction, "unit": "J"},
            "needed": {"value": r.needed, "unit": "J"},
            "arm": {"value": r.arm, "unit": "rad"},
        });
        writeln!(out, "{line}")?;
        return Ok(());
    }
    writeln!(
        out,
        "{}: nearest to upright {:.3} rad, after {:.2} s, the arm within {:.2} rad\n  \
         the arm put {:.4} J into the pendulum, its hinge's friction took {:.4} J of them; upright takes {:.4} J",
        rig.name, r.nearest, r.at, r.arm, r.work, r.friction, r.needed
    )?;
    Ok(())
}
