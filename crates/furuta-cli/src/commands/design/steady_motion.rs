//! `furuta design steady-motion`: the regulator equation's solution.

use std::io::Write;

use furuta_design::largest_sine;
use furuta_design::steady_motion::Motion;
use furuta_model::Rig;
use furuta_model::linear_plant::{Hold, Load, equilibrium, rigid_remarks, smooth};
use furuta_model::params::Coefficients;
use serde_json::{Value, json};

use crate::commands::emulate::positive;
use crate::failure::Failure;
use crate::print::significant;
use crate::streams;

/// Steady motion on which the pendulum follows alpha = w2, a sine: the arm's angle and the command as power series in
/// w1 and w2, with w1' = lambda w2, w2' = -lambda w1 (the regulator equation of Francis, Byrnes and Isidori). Springs
/// and cables of the rig file take part by their slopes at rest; effects that cannot are listed.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Built-in rig or rig file.
    #[arg(long, value_name = "RIG")]
    rig: String,
    /// Frequency of the sine.
    #[arg(long, value_name = "RAD/S", default_value_t = 1.0, value_parser = positive)]
    lambda: f64,
    /// Amplitude at which the series is judged.
    #[arg(long, value_name = "RAD", default_value_t = 0.05, value_parser = positive)]
    amplitude: f64,
    /// Order of the series, 1 to 15; a controller file takes at most 7.
    #[arg(long, value_name = "N", default_value_t = 5)]
    order: usize,
    /// Without the sin^2(alpha) inertia, as in the planar model of Ramos-Velasco et al. (whose beta is -alpha).
    #[arg(long)]
    planar: bool,
    /// Print one line of JSON in place of text.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let rig = Rig::load(&args.rig)?;
    let failure = |e: &dyn std::fmt::Display| Failure::new(format!("rig {}: {e}", rig.name));
    let plant = rig.try_plant().map_err(|e| failure(&e))?;
    let load = Load::of(&plant, Hold::Arm(0.0)).map_err(|e| failure(&e))?;
    let remarks = rigid_remarks(&plant);
    let rest = equilibrium(&smooth(&plant), Hold::Arm(0.0)).map_err(|e| failure(&e))?;
    let full = plant.coefficients;
    let c = Coefficients {
        swing: if args.planar { 0.0 } else { full.swing },
        ..full
    };
    let steady =
        Motion::solve_under(&c, &load, args.lambda, args.order).map_err(|e| failure(&e))?;
    let residual = steady.residual(&c, args.amplitude);
    let largest = largest_sine::amplitude(&c, args.lambda);
    let mut out = streams::output();
    if args.json {
        let line = json!({
            "rig": rig.name, "planar": args.planar, "lambda": args.lambda, "order": args.order,
            "theta": terms(&steady, 0), "theta_dot": terms(&steady, 1), "u": terms(&steady, 2),
            "remarks": remarks
                .iter()
                .map(|r| json!({"effect": r.effect, "text": r.to_string()}))
                .collect::<Vec<_>>(),
            "rest": {"alpha": rest.x.alpha, "command": rest.command},
            "amplitude": args.amplitude, "residual": residual, "largest_amplitude": largest,
        });
        return Ok(writeln!(out, "{line}")?);
    }
    writeln!(
        out,
        "{}{}: alpha = w2, alpha' = -lambda w1, lambda = {} rad/s",
        rig.name,
        if args.planar { ", planar" } else { "" },
        args.lambda
    )?;
    writeln!(
        out,
        "  w1 w2        theta [rad]  theta' [rad/s]{:>15}",
        format!("u [{}]", rig.params.motor.actuation.unit())
    )?;
    for (i, j) in exponents(args.order) {
        let [a, s, u] = steady.coefficients(i, j).map(significant);
        writeln!(out, "  {i:2} {j:2}   {a:>16}{s:>16}{u:>15}")?;
    }
    writeln!(
        out,
        "at {} rad the series misses the arm's acceleration by {} of its largest",
        args.amplitude,
        significant(residual)
    )?;
    match largest {
        Some(largest) => writeln!(
            out,
            "the largest sine that this pendulum can follow at all (no friction or spring in the hinge): {} rad",
            significant(largest)
        )?,
        None => writeln!(out, "any sine up to 1.5 rad can be followed")?,
    }
    if rest.command != 0.0 || rest.x.alpha != 0.0 {
        writeln!(
            out,
            "with the arm at 0 the rig rests at alpha = {} rad under {} {}: the series is about there",
            significant(rest.x.alpha),
            significant(rest.command),
            rig.params.motor.actuation.unit()
        )?;
    }
    for remark in &remarks {
        writeln!(out, "  {remark}")?;
    }
    Ok(())
}

/// Exponents of `w1`, `w2` of the terms that are not zero for any model.
fn exponents(order: usize) -> impl Iterator<Item = (usize, usize)> {
    (1..=order)
        .step_by(2)
        .flat_map(|degree| (0..=degree).map(move |j| (degree - j, j)))
}

/// `[[i, j, coefficient], ...]` of the arm's angle (`which` 0), its speed (1) or the command (2).
fn terms(motion: &Motion, which: usize) -> Value {
    exponents(motion.order())
        .map(|(i, j)| json!([i, j, motion.coefficients(i, j)[which]]))
        .filter(|term| term[2] != json!(0.0))
        .collect()
}
