//! `furuta study frequency-coverage`: how often intervals of fitted poles hold the truth.

use std::io::Write;

use furuta_ident::frequency::coverage::{Drive, Outcome, Row, Study};
use furuta_model::Rig;
use serde_json::{Value, json};

use super::{hertz, seconds};
use crate::commands::emulate::positive;
use crate::commands::progress::bar;
use crate::failure::Failure;
use crate::streams;

/// Coverage of frequency-domain identification: each rig, its effects left out, hangs, is driven many times, measured
/// by its encoder and fitted; how often do the 95 % intervals of poles and the 95 % circles of lines hold the truth?
///
/// Without --swing, the swing is the largest (by steps of 1.4) at which the rig is linear: there the bias that large
/// angles cause is half of a standard deviation at most, which leaves a 95 % interval 92.1 %.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Built-in rig or rig file; may be repeated; the four published rigs if not given.
    #[arg(long, value_name = "RIG")]
    rig: Vec<String>,
    /// What drives the rig.
    #[arg(long, value_enum, default_value_t = By::Noise)]
    signal: By,
    /// RMS of the pendulum's angle in degrees.
    #[arg(long, value_name = "DEGREES", value_parser = positive)]
    swing: Option<f64>,
    /// Distance of lines under noise; may be repeated; 0.05, 0.1 and 0.2 if not given.
    #[arg(long, value_name = "HZ", value_parser = positive)]
    resolution: Vec<f64>,
    /// Recordings.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u64).range(2..=100_000))]
    seeds: u64,
    /// Length of a recording, s.
    #[arg(long, value_name = "SECONDS", default_value_t = 180.0, value_parser = seconds)]
    duration: f64,
    /// Samples per second.
    #[arg(long, value_name = "HZ", default_value_t = 200.0, value_parser = hertz)]
    rate: f64,
    /// Print one line of JSON in place of text.
    #[arg(long)]
    json: bool,
}

/// What drives the rig.
#[derive(clap::ValueEnum, Copy, Clone, Debug, PartialEq, Eq)]
enum By {
    /// Band-limited noise up to 23 Hz; the response by the local rational method.
    Noise,
    /// Odd multisines with detection lines and random phases; the response from periods, distortion told from noise.
    Multisine,
}

/// The published rigs.
const RIGS: [&str; 4] = [
    "fong2014-emecs",
    "shahzad2022-srv02",
    "ramos-velasco",
    "qube-servo-2",
];

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut study = Study {
        drive: match args.signal {
            By::Noise => Drive::Noise,
            By::Multisine => Drive::Multisine,
        },
        seeds: args.seeds,
        duration: args.duration,
        rate: args.rate,
        swing: args.swing.map(f64::to_radians),
        ..Study::default()
    };
    if !args.resolution.is_empty() {
        study.resolutions.clone_from(&args.resolution);
    }
    let names: Vec<&str> = if args.rig.is_empty() {
        RIGS.to_vec()
    } else {
        args.rig.iter().map(String::as_str).collect()
    };
    let bar = bar(args.seeds * names.len() as u64);
    let mut found = Vec::new();
    for (i, name) in names.iter().enumerate() {
        let rig = Rig::load(name)?;
        bar.set_prefix(rig.name.clone());
        let before = i as u64 * args.seeds;
        let outcome = study.run(&rig, &|done, _| bar.set_position(before + done))?;
        found.push((rig, outcome));
    }
    bar.finish_and_clear();
    let mut out = streams::output();
    if args.json {
        let rigs: Vec<Value> = found.iter().map(|(rig, o)| as_json(rig, o)).collect();
        let line = json!({"seeds": args.seeds, "duration": args.duration, "rate": args.rate, "rigs": rigs});
        return Ok(writeln!(out, "{line}")?);
    }
    for (rig, outcome) in &found {
        out.write_all(text(rig, outcome).as_bytes())?;
    }
    Ok(())
}

fn text(rig: &Rig, outcome: &Outcome) -> String {
    let mut text = format!(
        "{}: {:.4} {} RMS, the pendulum swings by {:.2} degrees RMS\n",
        rig.name,
        outcome.rms,
        rig.params.motor.actuation.unit(),
        outcome.swing.to_degrees()
    );
    text += "  lines [Hz]  held %  circles %  part of a pole          held %       bias    scatter        std\n";
    for row in &outcome.rows {
        let mut start = format!(
            "  {:>10} {:>7.1} {:>10.1}",
            row.resolution,
            100.0 * row.held,
            100.0 * row.circles
        );
        for p in &row.parts {
            let (name, value) = if p.imaginary {
                ("Im", p.pole.im)
            } else {
                ("Re", p.pole.re)
            };
            text += &format!(
                "{start:30}  {name} = {value:<17.5} {:>6.1} {:>10.5} {:>10.5} {:>10.5}\n",
                100.0 * p.held,
                p.bias,
                p.scatter,
                p.std
            );
            start.clear();
        }
        if row.failed > 0 {
            text += &format!("  {} fits failed; they count as not held\n", row.failed);
        }
    }
    text
}

fn as_json(rig: &Rig, outcome: &Outcome) -> Value {
    let row = |r: &Row| {
        let parts: Vec<Value> = r
            .parts
            .iter()
            .map(|p| {
                json!({"pole": {"re": p.pole.re, "im": p.pole.im}, "part": if p.imaginary { "im" } else { "re" },
                    "held": p.held, "bias": p.bias, "scatter": p.scatter, "std": p.std})
            })
            .collect();
        json!({"resolution": r.resolution, "held": r.held, "circles": r.circles, "failed": r.failed, "parts": parts})
    };
    let rows: Vec<Value> = outcome.rows.iter().map(row).collect();
    json!({"rig": rig.name, "rms": outcome.rms, "swing": outcome.swing, "rows": rows})
}
