//! `furuta design lqi`: a regulator with integral action.

use std::io::Write;

use furuta_ctrl::controllers::Lqi;
use furuta_ctrl::design::{Weights, balance_weights_with_integral, lqi, sampled_lqi};
use furuta_model::Rig;
use nalgebra::RowVector4;
use serde_json::json;

use super::{CommonArgs, gains, law, numbers, upright, write_controller};
use crate::commands::emulate::positive;
use crate::failure::Failure;
use crate::print;
use crate::streams;

/// Linear-quadratic regulator about upright with the integral of the arm's angle as a fifth state: u = -K [x, integral
/// of theta] minimises the integral (sum) of x'Qx + R u^2.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    #[command(flatten)]
    common: CommonArgs,
    /// Diagonal of Q for theta, alpha, theta_dot, alpha_dot, integral of theta. If neither Q nor R is given: what
    /// `kind = "lqi"` takes.
    #[arg(long, value_name = "A,B,C,D,E", value_parser = weights, allow_hyphen_values = true, requires = "r")]
    q: Option<[f64; 5]>,
    /// Weight of the command.
    #[arg(long, value_name = "R", value_parser = positive, requires = "q")]
    r: Option<f64>,
}

fn weights(text: &str) -> Result<[f64; 5], String> {
    numbers(text)
        .filter(|q: &[f64; 5]| q.iter().all(|w| *w >= 0.0))
        .ok_or_else(|| {
            "must be five finite numbers of at least 0 with commas between them".to_owned()
        })
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let rig = Rig::load(&args.common.rig)?;
    let weights = match (args.q, args.r) {
        (Some(q), Some(r)) => Weights::diagonal(q, [r]),
        _ => balance_weights_with_integral(&rig.params),
    };
    let linear = upright(&rig)?;
    let arm = RowVector4::new(1.0, 0.0, 0.0, 0.0);
    let designed = match args.common.rate {
        Some(rate) => sampled_lqi::<f64, 4, 5>(&linear.a, &linear.b, &arm, 1.0 / rate, &weights),
        None => lqi::<f64, 4, 5, 1>(&linear.a, &linear.b, &arm, &weights),
    };
    let regulator = designed.map_err(|e| Failure::new(format!("rig {}: {e}", rig.name)))?;
    let k = regulator.gain;
    let settings = Lqi::<f64>::settings();
    let settings = settings
        .with("gain", &k.as_slice()[..4])?
        .with("integral_gain", &k.as_slice()[4..])?;
    let judged = args
        .common
        .judge
        .judge(&rig, law(k.as_slice()), args.common.rate, &settings)?;
    if let Some(path) = &args.common.write_controller {
        write_controller(path, &rig, args.common.rate, settings);
    }
    let mut out = streams::output();
    if args.common.json {
        let mut line = json!({
            "rig": rig.name, "rate": args.common.rate, "q": weights.q.diagonal().as_slice(), "r": weights.r[0],
            "k": k.as_slice(),
            "poles": print::poles_json(&judged.poles),
        });
        judged.extend(&mut line);
        return Ok(writeln!(out, "{line}")?);
    }
    writeln!(
        out,
        "{}: u = -K [theta, alpha, theta_dot, alpha_dot, integral of theta]",
        rig.name
    )?;
    gains(&mut out, k.as_slice(), &rig)?;
    judged.print(&mut out)
}
