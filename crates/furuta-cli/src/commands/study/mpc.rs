//! `furuta study mpc`: what knowing the limits is worth.

use std::io::Write;

use furuta_chart::{Chart, Line, Panel};
use furuta_design::arm_step::{Experiment, Run, Study};
use furuta_design::closed_loop::Sample;
use furuta_model::Rig;
use serde_json::json;

use crate::commands::design::weights;
use crate::commands::emulate::positive;
use crate::failure::Failure;
use crate::outputs::{self, Output};
use crate::print::significant;
use crate::streams;

/// A step of the arm under four controllers with the same weights: LQR, sliding mode, model predictive control that
/// lets the pendulum lean only so far, solved by an interior-point method (Clarabel) and by the controller itself
/// (active set, as on a microcontroller). Nonlinear model, perfect states.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Built-in rig or rig file.
    #[arg(long, value_name = "RIG", default_value = "qube-servo-2")]
    rig: String,
    /// Where the arm is to go from rest at zero.
    #[arg(
        long,
        value_name = "RAD",
        default_value_t = 0.5,
        allow_hyphen_values = true
    )]
    step: f64,
    /// How far the pendulum may lean. Half of what it leans under the LQR if not given.
    #[arg(long, value_name = "RAD", value_parser = positive)]
    pendulum_angle: Option<f64>,
    /// Diagonal of Q for theta, alpha, theta_dot, alpha_dot. If neither Q nor R is given: what `furuta run` balances
    /// with, the arm so stiff that the step asks for twice the full command.
    #[arg(long, value_name = "A,B,C,D", value_parser = weights, allow_hyphen_values = true, requires = "r")]
    q: Option<[f64; 4]>,
    /// Weight of the command.
    #[arg(long, value_name = "R", value_parser = positive, requires = "q")]
    r: Option<f64>,
    /// Samples per second.
    #[arg(long, value_name = "HZ", default_value_t = 500.0, value_parser = positive)]
    rate: f64,
    /// How long each run is.
    #[arg(long, value_name = "SECONDS", default_value_t = 5.0, value_parser = positive)]
    duration: f64,
    /// Largest number of changes of the active limits in each sample.
    #[arg(long, value_name = "N", default_value_t = 200)]
    iterations: usize,
    /// Draw the four runs: arm, pendulum, command (SVG).
    #[arg(long, value_name = "OUT.svg", value_parser = outputs::picture())]
    plot: Option<Output>,
    /// Print one line of JSON in place of text.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let rig = Rig::load(&args.rig)?;
    let study = Experiment {
        step: args.step,
        rate: args.rate,
        duration: args.duration,
        weights: args.q.zip(args.r),
        pendulum: args.pendulum_angle,
        iterations: args.iterations,
    }
    .run(&rig)?;
    if let Some(path) = &args.plot {
        path.write(chart(&rig, args.step, &study).svg());
    }
    let mut out = streams::output();
    if args.json {
        let runs: Vec<_> = study.runs.iter().map(line).collect();
        let line = json!({
            "rig": rig.name, "step": args.step, "rate": args.rate, "q": study.weights.0, "r": study.weights.1,
            "pendulum_limit": study.pendulum,
            "command_limit": study.command, "iterations": args.iterations, "runs": runs,
        });
        return Ok(writeln!(out, "{line}")?);
    }
    out.write_all(text(&rig, args, &study).as_bytes())?;
    Ok(())
}

fn line(run: &Run) -> serde_json::Value {
    let f = &run.figures;
    json!({
        "controller": run.contender.name(), "settle": f.settle, "overshoot": f.overshoot, "alpha_max": f.alpha,
        "u_max": f.command,
        "violations": f.violations, "saturated": f.saturated, "effort": f.effort, "cost": f.cost, "up": f.up,
        "update_us": 1e6 * f.time.as_secs_f64(),
    })
}

fn text(rig: &Rig, args: &Args, study: &Study) -> String {
    let (q, r) = study.weights;
    let mut text = format!(
        "{}: the arm steps by {} rad; pendulum within {} rad, command within {} V; Q = diag({}), R = {}\n",
        rig.name,
        args.step,
        significant(study.pendulum),
        study.command,
        q.map(significant).join(", "),
        significant(r),
    );
    text += "  controller      settle  overshoot  pendulum  command  beyond  at limit    effort      cost    update\n";
    text += "                       s          %       rad        V  samples  samples     V^2 s                  us\n";
    for run in &study.runs {
        let f = &run.figures;
        let settle = f
            .settle
            .map_or_else(|| "-".to_owned(), |s| format!("{s:.3}"));
        text += &format!(
            "  {:15}{settle:>7} {:>10.2} {:>9.4} {:>8.3} {:>7} {:>9} {:>9.4} {:>9.4} {:>9.2}{}\n",
            run.contender.name(),
            100.0 * f.overshoot,
            f.alpha,
            f.command,
            f.violations,
            f.saturated,
            f.effort,
            f.cost,
            1e6 * f.time.as_secs_f64(),
            if f.up { "" } else { "  fell" }
        );
    }
    text += "settle: the arm stays within 2 % of the step; beyond: the pendulum leans by more than 1 % \
        above its limit; at limit: the command\n";
    text += "effort: integral of the command's square; cost: integral of e'Qe + R u^2; update: mean time \
        of one on this machine\n";
    text
}

fn chart(rig: &Rig, step: f64, study: &Study) -> Chart {
    // Until the slowest has settled: afterwards there is nothing to see.
    let settled = study.runs.iter().map(|run| run.figures.settle);
    let end = settled
        .map(|s| s.map_or(f64::INFINITY, |s| 1.5 * s))
        .fold(0.0, f64::max);
    let shown = |samples: &[Sample], value: fn(&Sample) -> f64| -> Vec<(f64, f64)> {
        samples
            .iter()
            .filter(|s| s.t <= end)
            .map(|s| (s.t, value(s)))
            .collect()
    };
    let lines = |value: fn(&Sample) -> f64| -> Vec<Line> {
        study
            .runs
            .iter()
            .enumerate()
            .map(|(k, run)| {
                let line = Line::new(run.contender.name(), shown(&run.samples, value)).colour(k);
                // Two solvers of one problem: dashed above the other, both are seen.
                if k == 3 { line.dashed() } else { line }
            })
            .collect()
    };
    let mut pendulum = lines(|s| s.x.alpha);
    if let Some(run) = study.runs.first() {
        let level = |angle: f64| {
            let times = shown(&run.samples, |s| s.u).into_iter();
            times.map(move |(t, _)| (t, angle))
        };
        let allowed = Line::between("allowed", level(-study.pendulum), level(study.pendulum));
        pendulum.insert(0, allowed.colour(5));
    }
    Chart::new(
        &format!(
            "{}: the arm steps by {step} rad, with and without limits in mind",
            rig.name
        ),
        "t [s]",
        vec![
            Panel::new("arm [rad]", lines(|s| s.x.theta)),
            Panel::new("pendulum [rad]", pendulum),
            Panel::new("command [V]", lines(|s| s.u)),
        ],
    )
}
