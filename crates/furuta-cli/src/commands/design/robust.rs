//! `furuta design robust`: one gain for every rig within a range.

use std::io::Write;

use furuta_ctrl::controllers::StateFeedback;
use furuta_ctrl::design::{Weights, balance_weights};
use furuta_design::polytope::{LENGTHS_AND_MASS, key};
use furuta_design::robust_rig::robust_rig;
use furuta_model::Rig;
use furuta_model::linear_plant::Remark;
use serde_json::json;

use super::closed::{JudgeArgs, poles_json};
use super::{gains, law, weights, write_controller};
use crate::commands::emulate::positive;
use crate::failure::Failure;
use crate::outputs::{self, Output};
use crate::print::significant;
use crate::streams;

/// Robust linear-quadratic regulator about upright: one gain with one Lyapunov function and a guaranteed cost for every
/// rig whose parameters are within a range, all of them off at once (a linear matrix inequality over the vertices of
/// their models).
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Built-in rig or rig file.
    #[arg(long, value_name = "RIG")]
    rig: String,
    /// How far each parameter may be off, as a share of its value.
    #[arg(long, value_name = "SHARE", default_value_t = 0.2, value_parser = positive)]
    spread: f64,
    /// Which parameters, with commas between them. Those of Ramos-Velasco et al. if not given: the arm's length, the
    /// pendulum's length and mass.
    #[arg(long, value_name = "KEYS", value_delimiter = ',')]
    parameters: Vec<String>,
    /// Diagonal of Q for theta, alpha, theta_dot, alpha_dot. If neither Q nor R is given: what `furuta run` balances
    /// with.
    #[arg(long, value_name = "A,B,C,D", value_parser = weights, allow_hyphen_values = true, requires = "r")]
    q: Option<[f64; 4]>,
    /// Weight of the command.
    #[arg(long, value_name = "R", value_parser = positive, requires = "q")]
    r: Option<f64>,
    /// Samples per second at which the gain, designed in continuous time, is judged.
    #[arg(long, value_name = "HZ", default_value_t = 500.0, value_parser = super::rate)]
    rate: f64,
    /// Write the gain into a controller file, for `--controller` of `furuta run` and `furuta simulate`.
    #[arg(long, value_name = "OUT.toml", value_parser = outputs::data())]
    write_controller: Option<Output>,
    #[command(flatten)]
    judge: JudgeArgs,
    /// Print one line of JSON in place of text.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let rig = Rig::load(&args.rig)?;
    let weights = match (args.q, args.r) {
        (Some(q), Some(r)) => Weights::diagonal(q, [r]),
        _ => balance_weights(&rig.params),
    };
    let keys = if args.parameters.is_empty() {
        LENGTHS_AND_MASS.to_vec()
    } else {
        let known = args.parameters.iter().map(|name| key(name.trim()));
        known.collect::<Result<_, _>>()?
    };
    let found = robust_rig(&rig, &keys, args.spread, &weights)
        .map_err(|e| Failure::new(format!("rig {}: {e}", rig.name)))?;
    let (k, nominal) = (found.regulator.gain, found.nominal);
    let slowest = [found.slowest(&nominal), found.slowest(&k)];
    let sampled = [nominal, k].map(|k| found.largest_sampled(&k, 1.0 / args.rate));
    let settings = StateFeedback::<f64>::settings();
    let settings = settings.with("gain", k.as_slice())?;
    let judged = args
        .judge
        .judge(&rig, law(k.as_slice()), Some(args.rate), &settings)?;
    if let Some(path) = &args.write_controller {
        write_controller(path, &rig, Some(args.rate), settings);
    }
    let left_out = found.remarks();
    let corners = found.polytope.corners.len();
    let mut out = streams::output();
    if args.json {
        let mut line = json!({
            "rig": rig.name, "spread": args.spread, "parameters": keys, "q": weights.q.diagonal().as_slice(),
            "r": weights.r[0],
            "k": k.as_slice(), "k_nominal": nominal.as_slice(), "guaranteed_cost": found.regulator.guaranteed,
            "gap": found.regulator.gap,
            "guarantee_without": left_out.iter().map(|r| r.effect).collect::<Vec<_>>(),
            "corners": corners, "vertices": found.polytope.control_points.len(),
            "slowest_pole": {"nominal": slowest[0], "robust": slowest[1]},
            "rate": args.rate, "largest_sampled_pole": {"nominal": sampled[0], "robust": sampled[1]},
            "poles": poles_json(&judged),
        });
        judged.extend(&mut line);
        return Ok(writeln!(out, "{line}")?);
    }
    writeln!(
        out,
        "{}: u = -K [theta, alpha, theta_dot, alpha_dot], {} within {} % of their values",
        rig.name,
        keys.join(", "),
        significant(100.0 * args.spread)
    )?;
    gains(&mut out, k.as_slice(), &rig)?;
    writeln!(
        out,
        "  from x on the cost is at most x'Xx for every rig within the range{}; trace X = {}",
        unqualified(&left_out),
        significant(found.regulator.guaranteed)
    )?;
    writeln!(
        out,
        "  the worst of the {corners} corners       LQR      robust"
    )?;
    writeln!(
        out,
        "    slowest pole [rad/s]  {:>12}{:>12}",
        significant(slowest[0]),
        significant(slowest[1])
    )?;
    writeln!(
        out,
        "    largest |z| at {} Hz {:>12}{:>12}",
        args.rate,
        significant(sampled[0]),
        significant(sampled[1])
    )?;
    writeln!(out, "  the rig as its file says, at {} Hz:", args.rate)?;
    judged.print(&mut out)
}

/// For which of them the guarantee says nothing.
fn unqualified(left_out: &[Remark]) -> String {
    if left_out.is_empty() {
        return String::new();
    }
    let ids: Vec<&str> = left_out.iter().map(|r| r.effect).collect();
    format!(
        " that has no {}: no guarantee is made for the file's own rig",
        ids.join(", no ")
    )
}
