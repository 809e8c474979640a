//! `furuta study limit-cycle`: how far a balanced rig wanders, its effects known or not.

use std::io::Write;

use furuta_chart::{Chart, Line, Panel};
use furuta_design::limit_cycle::{Knowing, Wandering, run as experiment, typical};
use furuta_design::supervised::Sample;
use furuta_hw::emulate::hidden_effect;
use furuta_model::{Effect, Rig};
use serde_json::json;

use super::{hertz, seconds};
use crate::failure::Failure;
use crate::outputs::{self, Output};
use crate::streams;

/// How far a balanced rig wanders that has an effect: with a control system that does not know it, with one whose rig
/// file names it and that makes up for it, and with one that observes that something acts.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Built-in rig or rig file.
    #[arg(long, value_name = "RIG", default_value = "shahzad2022-srv02")]
    rig: String,
    /// The effects, together: ID or ID:NAME=VALUE,... in SI units; may be repeated. If not given, several, one after
    /// the other.
    #[arg(long, value_name = "EFFECT")]
    hide: Vec<String>,
    /// Rig file that `compensated` is designed by, as `furuta diagnose --write-rig` makes one; what is hidden, exactly,
    /// if not given.
    #[arg(long, value_name = "RIG", requires = "hide")]
    known: Option<String>,
    /// Samples per second.
    #[arg(long, value_name = "HZ", default_value = "500", value_parser = hertz)]
    rate: f64,
    /// Length of each run; its last half counts.
    #[arg(long, value_name = "SECONDS", default_value = "20", value_parser = seconds)]
    duration: f64,
    /// Draw arm and command over the last half (SVG).
    #[arg(long, value_name = "OUT.svg", requires = "hide", value_parser = outputs::picture())]
    plot: Option<Output>,
    /// Print one line of JSON in place of text.
    #[arg(long)]
    json: bool,
}

/// Looked at where nothing else is asked for, at this many times the size that would be noticed.
const USUAL: [(&str, f64); 8] = [
    ("arm.coulomb", 1.0),
    ("arm.stribeck", 1.0),
    ("motor.deadzone", 1.0),
    ("motor.bias", 1.0),
    ("arm.spring", 1.0),
    ("arm.cable", 1.0),
    ("motor.delay", 4.0),
    ("motor.delay", 8.0),
];

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let rig = Rig::load(&args.rig)?;
    let known = args.known.as_deref().map(Rig::load).transpose()?;
    let cases: Vec<Vec<Effect<f64>>> = if args.hide.is_empty() {
        USUAL
            .iter()
            .filter_map(|(id, size)| Some(vec![typical(&rig, id, *size)?]))
            .collect()
    } else {
        let parse = |text: &String| Ok(hidden_effect(text, &rig.params)?);
        vec![
            args.hide
                .iter()
                .map(parse)
                .collect::<Result<_, Failure>>()?,
        ]
    };
    let mut rows = Vec::new();
    let mut last = Vec::new();
    for effects in &cases {
        for knowing in Knowing::ALL {
            let period = 1.0 / args.rate;
            let samples = experiment(
                &rig,
                effects,
                known.as_ref(),
                knowing,
                period,
                args.duration,
            )
            .map_err(|e| Failure::new(e.to_string()))?;
            rows.push((effects, knowing, Wandering::of(&samples)));
            last.push((knowing, samples));
        }
    }
    if let Some(path) = &args.plot {
        path.write(chart(&rig, 1.0 / args.rate, &last).svg());
    }
    let mut out = streams::output();
    if args.json {
        let rows: Vec<_> = rows
            .iter()
            .map(|(effects, knowing, w)| {
                json!({
                    "effects": effects.iter().map(name).collect::<Vec<_>>(), "control": knowing.name(), "arm": w.arm,
                    "pendulum": w.pendulum, "offset": w.offset, "command_rms": w.command, "up": w.up,
                })
            })
            .collect();
        return Ok(writeln!(out, "{}", json!({"rig": rig.name, "runs": rows}))?);
    }
    let mut text = format!(
        "{} balanced at {} Hz; half of what the arm and the pendulum sweep, where the arm stands on average\n",
        rig.name, args.rate
    );
    text += "  effect                       control system         arm [rad]   pendulum     offset   command\n";
    for (effects, knowing, w) in &rows {
        let names: Vec<_> = effects.iter().map(name).collect();
        text += &format!(
            "  {:28} {:21} {:>10.4} {:>10.4} {:>+10.4} {:>7.3} V{}\n",
            names.join(" "),
            knowing.name(),
            w.arm,
            w.pendulum,
            w.offset,
            w.command,
            if w.up == 1.0 { "" } else { "  fell" }
        );
    }
    out.write_all(text.as_bytes())?;
    Ok(())
}

/// The effect and its first number.
fn name(effect: &Effect<f64>) -> String {
    let (spec, values) = (effect.spec(), effect.values());
    match (spec.parameters.first(), values.first()) {
        (Some(p), Some(value)) => {
            format!(
                "{} {} {}",
                spec.id,
                crate::print::significant(*value),
                p.unit
            )
        }
        _ => spec.id.to_owned(),
    }
}

fn chart(rig: &Rig, period: f64, runs: &[(Knowing, Vec<Sample>)]) -> Chart {
    let lines = |of: fn(&Sample) -> f64| {
        runs.iter()
            .map(|(knowing, samples)| {
                let half = samples.len() / 2;
                let points = samples.iter().enumerate().skip(half);
                Line::new(
                    knowing.name(),
                    points.map(|(k, s)| (k as f64 * period, of(s))),
                )
            })
            .collect()
    };
    Chart::new(
        &format!(
            "{} balanced: the effect not known, made up for, observed",
            rig.name
        ),
        "t [s]",
        vec![
            Panel::new("arm [rad]", lines(|s| s.x.theta)),
            Panel::new("command [V]", lines(|s| s.held)),
        ],
    )
}
