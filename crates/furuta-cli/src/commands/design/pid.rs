//! `furuta design pid`: the pair of PID controllers, by the model or by a relay.

use std::io::Write;

use furuta_ctrl::Site;
use furuta_ctrl::controllers::{Design, Pid};
use furuta_design::relay::{Gains, Relay, Ultimate, ultimate};
use furuta_model::Rig;
use serde_json::{Value, json};

use super::{CommonArgs, write_controller};
use crate::commands::emulate::positive;
use crate::failure::Failure;
use crate::print::{self, significant};
use crate::streams;

/// Samples per second where none are given.
const RATE: f64 = 500.0;

/// The pair of PID controllers of `kind = "pid"`: the arm's asks for an angle of the pendulum, the pendulum's turns it
/// into a command. By the model, those of `lqi`; with --relay, from the ultimate gain and period that a relay in place
/// of the pendulum's controller finds on the simulated rig. Margins are those of the pair without its low pass.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    #[command(flatten)]
    common: CommonArgs,
    /// Tune by a relay experiment about upright, on the rig with its effects and encoders.
    #[arg(long)]
    relay: bool,
    /// What the relay commands either way, in the unit of the rig's command. Three tenths of the command limit if not
    /// given.
    #[arg(long, value_name = "COMMAND", value_parser = positive, requires = "relay")]
    amplitude: Option<f64>,
    /// Angle of the pendulum beyond which the relay switches; 0: wherever the encoder shows another sign.
    #[arg(long, value_name = "RAD", default_value_t = 0.0, requires = "relay")]
    hysteresis: f64,
    /// The experiment ends after this time at the latest.
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, value_parser = positive, requires = "relay")]
    time_limit: f64,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let rig = Rig::load(&args.common.rig)?;
    let failure = |e: &dyn std::fmt::Display| Failure::new(format!("rig {}: {e}", rig.name));
    let rate = args.common.rate.unwrap_or(RATE);
    let settings = Pid::<f64>::settings();
    let found = args
        .relay
        .then(|| {
            let relay = Relay {
                amplitude: args.amplitude,
                hysteresis: args.hysteresis,
                period: 1.0 / rate,
                time_limit: args.time_limit,
            };
            relay.run(&rig)
        })
        .transpose()
        .map_err(|e| failure(&e))?;
    let gains = match &found {
        Some(found) => found.gains(&rig, 1.0 / rate).map_err(|e| failure(&e))?,
        None => {
            let pid = Pid::<f64>::design(&settings, &Site::of(&rig, 1.0 / rate));
            let pid = pid.map_err(|e| failure(&e))?;
            Gains {
                pendulum: pid.pendulum,
                arm: pid.arm,
            }
        }
    };
    let settings = settings
        .with("pendulum", &gains.pendulum)?
        .with("arm", &gains.arm)?;
    let judged = args
        .common
        .judge
        .judge(&rig, gains.law(), Some(rate), &settings)?;
    if let Some(path) = &args.common.write_controller {
        write_controller(path, &rig, Some(rate), settings);
    }
    let model = match &found {
        Some(_) => ultimate(&rig, 1.0 / rate, 0.0).map_err(|e| failure(&e))?,
        None => None,
    };
    let mut out = streams::output();
    if args.common.json {
        let mut line = json!({
            "rig": rig.name, "rate": rate, "pendulum": gains.pendulum, "arm": gains.arm,
            "poles": print::poles_json(&judged.poles),
        });
        if let (Some(found), Some(object)) = (&found, line.as_object_mut()) {
            object.insert("relay".to_owned(), experiment(found, model));
        }
        judged.extend(&mut line);
        return Ok(writeln!(out, "{line}")?);
    }
    writeln!(
        out,
        "{}: the arm asks for a lean, the pendulum for a command",
        rig.name
    )?;
    let unit = rig.params.motor.actuation.unit();
    if let Some(u) = &found {
        writeln!(
            out,
            "  relay of {} {unit}, hysteresis {} rad, {} s: ultimate gain {} {unit}/rad, period {} s\n  meanwhile the \
             pendulum within {} rad, the arm within {} rad; the loop turned by {} rad more than half a turn",
            significant(u.amplitude),
            significant(u.hysteresis),
            significant(u.time),
            significant(u.gain),
            significant(u.period),
            significant(u.lean),
            significant(u.arm),
            significant(-u.phase),
        )?;
    }
    if let Some((gain, period)) = model {
        writeln!(
            out,
            "  by the linear model and an ideal relay: {} {unit}/rad, {} s",
            significant(gain),
            significant(period)
        )?;
    }
    let pendulum = ["/rad", "/(rad s)", " s/rad"].map(|per| format!("{unit}{per}"));
    let arm = ["1", "1/s", "s"].map(str::to_owned);
    for (name, units, k) in [
        ("pendulum", pendulum, gains.pendulum),
        ("arm", arm, gains.arm),
    ] {
        let each: Vec<String> = ["kp", "ki", "kd"]
            .into_iter()
            .zip(units)
            .zip(k)
            .map(|((gain, unit), k)| format!("{gain} {} {unit}", significant(k)))
            .collect();
        writeln!(out, "  {name:9} {}", each.join(", "))?;
    }
    judged.print(&mut out)
}

fn experiment(u: &Ultimate, model: Option<(f64, f64)>) -> Value {
    json!({
        "ultimate_gain": u.gain, "ultimate_period": u.period, "described_gain": u.described, "phase": u.phase,
        "amplitude": u.amplitude, "hysteresis": u.hysteresis, "lean": u.lean, "arm": u.arm, "time": u.time,
        "model": model.map(|(gain, period)| json!({"ultimate_gain": gain, "ultimate_period": period})),
    })
}
