//! `furuta study calibration`: whether the 95 % intervals of a calibration hold the truth in 95 of 100 cases.

use std::fmt::Write as _;
use std::io::Write as _;

use furuta_ident::calibrate::{Options, calibrate};
use furuta_ident::recording::Recording;
use furuta_model::Rig;
use furuta_model::signals::random::normal;
use furuta_model::{Plant, State};
use serde_json::{Value, json};

use super::parts::PartArgs;
use super::{hertz, rig_with, seconds};
use crate::commands::progress::bar;
use crate::failure::Failure;
use crate::streams;

/// Coverage of a calibration's intervals: a rig is recorded again and again with fresh noise, each time calibrated from
/// a sheet that is off by up to 20 %, and counted how often the 95 % intervals hold what the rig really is.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Built-in rig or rig file: what the rig really is.
    #[arg(long, value_name = "RIG", default_value = "qube-servo-2")]
    rig: String,
    /// Replace a value of the rig file, as in arm.viscous=4e-4; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// How often it is recorded and calibrated.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u32).range(2..=10_000))]
    repeats: u32,
    /// Length of a recording.
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, value_parser = seconds)]
    seconds: f64,
    /// Samples per second.
    #[arg(long, value_name = "HZ", default_value_t = 500.0, value_parser = hertz)]
    rate: f64,
    /// Noise of the encoders beside their rounding, rad.
    #[arg(long, value_name = "RAD", default_value_t = 0.0)]
    noise: f64,
    #[command(flatten)]
    part: PartArgs,
    /// Print one line of JSON in place of text.
    #[arg(long)]
    json: bool,
}

/// What was counted of one parameter.
#[derive(Default)]
struct Count {
    held: u32,
    known: u32,
    square: f64,
    std: f64,
}

impl Count {
    /// Share of the intervals that hold the truth, mean deviation as a share of the truth, RMS error over the
    /// deviation.
    fn shares(&self) -> [f64; 3] {
        let n = f64::from(self.known);
        [
            f64::from(self.held) / n,
            self.std / n,
            (self.square / n).sqrt(),
        ]
    }

    fn as_json(&self) -> Value {
        let [held, std, error] = self.shares();
        // Where it was never known, these are null.
        json!({"known": self.known, "held": held, "mean_std": std, "rms_error_over_std": error})
    }
}

/// Runs the study.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let real = rig_with(&args.rig, &args.set)?;
    let plant = real.try_plant::<f64>()?;
    let keys = [
        "motor.torque_constant",
        "arm.inertia",
        "arm.viscous",
        "pendulum.inertia",
        "pendulum.viscous",
        "arm.length",
    ];
    let truth = {
        let p = &real.params;
        [
            p.motor.torque_constant,
            p.arm.inertia,
            p.arm.viscous,
            p.pendulum.inertia,
            p.pendulum.viscous,
            p.arm.length,
        ]
    };
    let options = Options {
        free: keys.map(str::to_owned).to_vec(),
        ..Options::default()
    };
    let about = format!(
        "calibration {real:?} {} {} {}",
        args.seconds, args.rate, args.noise
    );
    let found = args
        .part
        .open(false)?
        .runs(&about, args.repeats as usize, |repeats| {
            let bar = bar(repeats.len() as u64);
            let mut found = Vec::new();
            for repeat in repeats {
                let repeat = repeat as u64;
                let recording = record(&real, &plant, args, repeat)?;
                let c = calibrate(&[recording], &sheet(&real, repeat), &options)?.calibration;
                found.push(keys.map(|key| {
                    let p = c.parameters.get(key)?;
                    let [low, high] = p.interval?;
                    Some([low, high, p.fitted, p.std])
                }));
                bar.inc(1);
            }
            bar.finish_and_clear();
            Ok(found)
        })?;
    let Some(found) = found else {
        return Ok(());
    };
    let mut counts: [Count; 6] = Default::default();
    for repeat in &found {
        for ((found, truth), count) in repeat.iter().zip(truth).zip(&mut counts) {
            let Some([low, high, fitted, std]) = *found else {
                continue;
            };
            count.known += 1;
            count.held += u32::from(low <= truth && truth <= high);
            count.square += ((fitted - truth) / std).powi(2);
            count.std += std / truth;
        }
    }
    let mut all = Count::default();
    for c in &counts {
        all.held += c.held;
        all.known += c.known;
        all.square += c.square;
        all.std += c.std;
    }
    let rows = keys.iter().copied().zip(&counts).chain([("all", &all)]);
    if args.json {
        let rows: serde_json::Map<_, _> = rows
            .map(|(name, c)| (name.to_owned(), c.as_json()))
            .collect();
        let line = json!({
            "rig": real.name, "repeats": args.repeats, "seconds": args.seconds, "rate": args.rate, "parameters": rows,
        });
        return Ok(writeln!(streams::output(), "{line}")?);
    }
    let mut out = format!(
        "{} recordings of {}, {} s at {} Hz, sheet off by up to 20 %\n  {:<26} {:>9} {:>12} {:>18}\n",
        args.repeats,
        real.name,
        args.seconds,
        args.rate,
        "",
        "held by",
        "mean std",
        "RMS error / std"
    );
    for (name, c) in rows {
        let [held, std, error] = c.shares();
        // Writing to a String cannot fail.
        let _ = writeln!(
            out,
            "  {name:<26} {:>7.1} % {:>10.4} % {error:>18.2}",
            100.0 * held,
            100.0 * std
        );
    }
    streams::output().write_all(out.as_bytes())?;
    Ok(())
}

/// The rig under a sweep with a phase of its own, read by its encoders.
fn record(real: &Rig, plant: &Plant<f64>, args: &Args, repeat: u64) -> Result<Recording, Failure> {
    let h = 1.0 / args.rate;
    let limit = real.params.motor.command_limit;
    let amplitude = 0.25 * if limit.is_finite() { limit } else { 10.0 };
    let mut s = plant.rest(State::hanging());
    let mut samples = Vec::new();
    for k in 0..(args.seconds * args.rate).round() as u64 {
        let t = k as f64 * h;
        let sweep = t % 10.0;
        let u = amplitude * (2.0 * sweep + 1.2 * sweep * sweep + 0.37 * repeat as f64).sin();
        let y = plant.measure(&s);
        let noisy = std::array::from_fn(|c| y[c] + args.noise * normal(2 * repeat + c as u64, k));
        let [theta, alpha] = real.sensors.quantised(noisy);
        samples.push([t, u, theta, alpha]);
        plant.step(&mut s, u, h);
    }
    Ok(Recording::from_samples("repeat", samples)?.0)
}

/// A sheet that is off by up to 20 % either way in each of what is fitted but the length.
fn sheet(real: &Rig, repeat: u64) -> Rig {
    let mut sheet = real.clone();
    // Equally spread by an irrational step.
    let off = |k: u64| {
        let x = (0.618_033_988_75 * (5 * repeat + k) as f64).fract();
        1.0 + 0.2 * (2.0 * x - 1.0)
    };
    let p = &mut sheet.params;
    p.arm.inertia *= off(0);
    p.arm.viscous *= off(1);
    p.pendulum.viscous *= off(2);
    p.motor.torque_constant *= off(3);
    p.pendulum.inertia *= off(4);
    if real.params.pendulum.inertia_transverse == real.params.pendulum.inertia {
        p.pendulum.inertia_transverse = p.pendulum.inertia;
    }
    sheet
}
