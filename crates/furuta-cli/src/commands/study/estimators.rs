//! `furuta study estimators`: who knows the speeds best.

use std::io::Write;

use furuta_design::estimation::{compare, record};
use furuta_design::limit_cycle::typical;
use furuta_model::Rig;
use serde_json::json;

use super::{hertz, seconds};
use crate::failure::Failure;
use crate::streams;

/// How well each estimator knows the speeds that no encoder measures: all watch the same run of a rig with dry friction
/// on both axes, arm steps while balanced; once with the friction in their rig file and once without.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Built-in rig or rig file.
    #[arg(long, value_name = "RIG", default_value = "shahzad2022-srv02")]
    rig: String,
    /// Samples per second.
    #[arg(long, value_name = "HZ", default_value = "500", value_parser = hertz)]
    rate: f64,
    /// Length of the run.
    #[arg(long, value_name = "SECONDS", default_value = "12", value_parser = seconds)]
    duration: f64,
    /// Print one line of JSON in place of text.
    #[arg(long)]
    json: bool,
}

/// What rubs, in sizes that would be noticed.
const FRICTION: [(&str, f64); 2] = [("arm.coulomb", 1.0), ("pendulum.coulomb", 0.3)];

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let rig = Rig::load(&args.rig)?;
    let period = 1.0 / args.rate;
    let effects: Vec<_> = FRICTION
        .iter()
        .filter_map(|(id, size)| typical(&rig, id, *size))
        .collect();
    let said = |e: furuta_ctrl::ConfigError| Failure::new(e.to_string());
    let samples = record(&rig, &effects, period, args.duration).map_err(said)?;
    let without = compare(&rig, &samples, period).map_err(said)?;
    let mut named = rig.clone();
    named.effects.extend_from_slice(&effects);
    let with = compare(&named, &samples, period).map_err(said)?;
    let mut out = streams::output();
    if args.json {
        let rows: Vec<_> = [(false, &without), (true, &with)]
            .into_iter()
            .flat_map(|(known, rows)| {
                rows.iter().map(move |e| {
                    json!({
                        "estimator": e.id, "friction_known": known, "arm_speed": e.arm_speed,
                        "pendulum_speed": e.pendulum_speed, "alpha_ahead": e.ahead,
                    })
                })
            })
            .collect();
        return Ok(writeln!(
            out,
            "{}",
            json!({"rig": rig.name, "estimators": rows})
        )?);
    }
    let mut text = format!(
        "{} at {} Hz, balanced, arm steps; RMS errors\n",
        rig.name, args.rate
    );
    text += "                              friction not in the rig file               friction in the rig file\n";
    text += "                           arm     pendulum        alpha           arm     pendulum        alpha\n";
    text += "  estimator              rad/s        rad/s    ahead rad         rad/s        rad/s    ahead rad\n";
    for (a, b) in without.iter().zip(&with) {
        text += &format!(
            "  {:20} {:>7.4}      {:>7.4}      {:>7.5}       {:>7.4}      {:>7.4}      {:>7.5}\n",
            a.id, a.arm_speed, a.pendulum_speed, a.ahead, b.arm_speed, b.pendulum_speed, b.ahead
        );
    }
    text += "ahead: a period later, when a command given at the sample begins to act\n";
    out.write_all(text.as_bytes())?;
    Ok(())
}
