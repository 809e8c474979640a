//! `furuta design swing-up`: a swing-up by optimisation, as a controller file.

use std::io::Write;

use furuta_ctrl::file::MadeFor;
use furuta_ctrl::trajectory::WhenLost;
use furuta_ctrl::{Config, ControllerFile};
use furuta_design::optimal::{SwingUp, SwingUpProblem};
use furuta_model::Rig;
use serde_json::json;

use crate::commands::emulate::positive;
use crate::commands::progress::bar;
use crate::commands::run::load_controller;
use crate::failure::Failure;
use crate::outputs::{self, Output};
use crate::print::significant;
use crate::streams::{self, note};
use std::path::PathBuf;

/// Swing-up by optimisation: states, commands and gains from hanging to upright, for a controller file that `furuta
/// run` and `furuta simulate` follow. Where the rig leaves them, energy swing-up takes over.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Built-in rig or rig file.
    #[arg(long, value_name = "RIG")]
    rig: String,
    /// Controller file to write.
    #[arg(long, value_name = "OUT.toml", value_parser = outputs::data())]
    out: Option<Output>,
    /// Controller file whose other sections are kept; the standard ones if not given.
    #[arg(long, value_name = "FILE.toml")]
    controller: Option<PathBuf>,
    /// Share of the command limit left to the feedback.
    #[arg(long, value_name = "SHARE")]
    reserve: Option<f64>,
    /// Weight of the command against the time.
    #[arg(long, value_name = "WEIGHT")]
    effort: Option<f64>,
    /// Largest arm angle either way; eight tenths of the rig file's limit (else of a turn) if not given.
    #[arg(long, value_name = "RAD", value_parser = positive)]
    arm_limit: Option<f64>,
    /// Largest arm speed; nine tenths of the rig file's limit if not given (else a little more than the arm reaches
    /// with the full command).
    #[arg(long, value_name = "RAD/S", value_parser = positive)]
    arm_speed: Option<f64>,
    /// Largest pendulum speed; nine tenths of the rig file's limit (else of ten times its small-angle frequency) if not
    /// given.
    #[arg(long, value_name = "RAD/S", value_parser = positive)]
    pendulum_speed: Option<f64>,
    /// Intervals in which the command is held, 10 to 127.
    #[arg(long, value_name = "N", default_value_t = 100)]
    intervals: usize,
    /// Where the rig has left the trajectory: switch the motor off in place of energy swing-up.
    #[arg(long)]
    stop_when_lost: bool,
    /// Print one line of JSON in place of text.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let rig = Rig::load(&args.rig)?;
    let standard = SwingUpProblem::new(rig.clone());
    let problem = SwingUpProblem {
        reserve: args.reserve.unwrap_or(standard.reserve),
        effort: args.effort.unwrap_or(standard.effort),
        arm_angle: args.arm_limit.unwrap_or(standard.arm_angle),
        arm_speed: args.arm_speed.unwrap_or(standard.arm_speed),
        pendulum_speed: args.pendulum_speed.unwrap_or(standard.pendulum_speed),
        intervals: args.intervals,
        ..standard
    };
    let config = load_controller(args.controller.as_deref())?.config;
    let progress = bar(problem.programs());
    let found = problem.solve(&|done| progress.set_position(done));
    progress.finish_and_clear();
    let found = found.map_err(|e| Failure::new(format!("rig {}: {e}", rig.name)))?;
    let when_lost = if args.stop_when_lost {
        WhenLost::Stop
    } else {
        WhenLost::Energy
    };
    if let Some(output) = &args.out {
        let file = ControllerFile {
            made_for: MadeFor {
                rig: Some(rig.name.clone()),
                rate: None,
            },
            config: Config {
                trajectory: Some(found.trajectory(when_lost)?),
                ..config
            },
        };
        if output.write(file.to_toml()) {
            note!("{output} written");
        }
    }
    if args.json {
        return print_json(&rig, &found);
    }
    print_text(&rig, &found)
}

fn print_json(rig: &Rig, s: &SwingUp) -> Result<(), Failure> {
    let states: Vec<_> = s.states.iter().map(|x| x.to_array()).collect();
    let line = json!({
        "rig": rig.name, "seconds": s.seconds(), "interval": s.interval, "arm": {"largest": s.arm(), "unit": "rad"},
        "gap": s.gap, "cost": s.cost, "optimal": s.optimal, "left_out": s.left_out, "states": states,
        "commands": s.commands, "gains": s.gains,
    });
    writeln!(streams::output(), "{line}")?;
    Ok(())
}

fn print_text(rig: &Rig, s: &SwingUp) -> Result<(), Failure> {
    let mut out = streams::output();
    let largest = s.commands.iter().map(|u| u.abs()).fold(0.0, f64::max);
    writeln!(
        out,
        "{}: hanging to upright in {:.3} s, within 0.2 rad of it from {:.3} s on; arm to {:.2} rad, command to \
         {:.2} {}",
        rig.name,
        s.seconds(),
        s.arrival(0.2),
        s.arm(),
        largest,
        rig.params.motor.actuation.unit()
    )?;
    writeln!(
        out,
        "  cost {}; largest gap of the equations of motion {:.1e}; {}",
        significant(s.cost),
        s.gap,
        if s.optimal {
            "no step lowers the cost: a local optimum"
        } else {
            "the search ended before it was optimal"
        }
    )?;
    if !s.left_out.is_empty() {
        writeln!(
            out,
            "  left out of the optimisation: {}; `furuta simulate --controller` tries the whole rig",
            s.left_out.join(", ")
        )?;
    }
    Ok(())
}
