//! `furuta design`: controllers from a rig's model.

mod closed;
mod judge;
mod lqi;
mod pid;
mod place;
mod robust;
mod steady_motion;
mod swing_up;

use std::io::Write;

use furuta_ctrl::controllers::StateFeedback;
use furuta_ctrl::design::{Regulator, Weights, balance_weights, dlqr, lqr};
use furuta_ctrl::file::MadeFor;
use furuta_ctrl::settings::Settings;
use furuta_ctrl::{Config, ControllerFile};
use furuta_design::rehearsal::RATES;
use furuta_design::rig_loop::Law;
use furuta_model::discretize::zero_order_hold;
use furuta_model::linear_plant::{Hold, rigid};
use furuta_model::{Actuation, Linear, Rig};
use nalgebra::Complex;
use serde_json::json;

use super::emulate::positive;
use crate::failure::Failure;
use crate::outputs::{self, Output};
use crate::print;
use crate::streams::{self, note};

/// Design a controller from a rig's model.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    #[command(subcommand)]
    method: Method,
}

#[derive(clap::Subcommand, Debug)]
enum Method {
    Lqr(LqrArgs),
    Lqi(lqi::Args),
    Pid(pid::Args),
    Judge(judge::Args),
    Place(place::Args),
    Robust(robust::Args),
    SteadyMotion(steady_motion::Args),
    SwingUp(swing_up::Args),
}

/// The rig of a design, its rate, and where the answer goes.
#[derive(clap::Args, Debug)]
struct CommonArgs {
    /// Built-in rig or rig file.
    #[arg(long, value_name = "RIG")]
    rig: String,
    /// Samples per second; the command is held between samples. Continuous time if not given.
    #[arg(long, value_name = "HZ", value_parser = rate)]
    rate: Option<f64>,
    /// Write the gain into a controller file, for `--controller` of `furuta run` and `furuta simulate`.
    #[arg(long, value_name = "OUT.toml", value_parser = outputs::data())]
    write_controller: Option<Output>,
    #[command(flatten)]
    judge: closed::JudgeArgs,
    /// Print one line of JSON in place of text.
    #[arg(long)]
    json: bool,
}

/// Linear-quadratic regulator about upright: u = -K x minimises the integral (sum) of x'Qx + R u^2.
#[derive(clap::Args, Debug)]
struct LqrArgs {
    #[command(flatten)]
    common: CommonArgs,
    /// Diagonal of Q for theta, alpha, theta_dot, alpha_dot. If neither Q nor R is given: what `furuta run` balances
    /// with.
    #[arg(long, value_name = "A,B,C,D", value_parser = weights, allow_hyphen_values = true, requires = "r")]
    q: Option<[f64; 4]>,
    /// Weight of the command.
    #[arg(long, value_name = "R", value_parser = positive, requires = "q")]
    r: Option<f64>,
}

/// The rate of a control loop, Hz.
pub(crate) fn rate(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(hz) if RATES.contains(&hz) => Ok(hz),
        _ => Err(format!(
            "must be a number from {} to {} Hz",
            RATES.start(),
            RATES.end()
        )),
    }
}

/// Four weights with commas between them.
pub(crate) fn weights(text: &str) -> Result<[f64; 4], String> {
    match four(text)? {
        q if q.iter().all(|w| *w >= 0.0) => Ok(q),
        _ => Err("a weight is at least 0".to_owned()),
    }
}

/// Four numbers with commas between them.
pub(crate) fn four(text: &str) -> Result<[f64; 4], String> {
    numbers(text).ok_or_else(|| "must be four finite numbers with commas between them".to_owned())
}

/// `N` finite numbers with commas between them.
fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let numbers: Vec<f64> = text
        .split(',')
        .map_while(|part| part.trim().parse().ok())
        .filter(|x: &f64| x.is_finite())
        .collect();
    let whole = text.matches(',').count() + 1 == N;
    numbers.try_into().ok().filter(|_| whole)
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    match &args.method {
        Method::Lqr(args) => run_lqr(args),
        Method::Lqi(args) => lqi::run(args),
        Method::Pid(args) => pid::run(args),
        Method::Judge(args) => judge::run(args),
        Method::Place(args) => place::run(args),
        Method::Robust(args) => robust::run(args),
        Method::SteadyMotion(args) => steady_motion::run(args),
        Method::SwingUp(args) => swing_up::run(args),
    }
}

/// The model that a state feedback is designed for: the rig upright with the effects that have a slope there.
fn upright(rig: &Rig) -> Result<Linear, Failure> {
    let failure = |e: &dyn std::fmt::Display| Failure::new(format!("rig {}: {e}", rig.name));
    let plant = rig.try_plant().map_err(|e| failure(&e))?;
    rigid(&plant, Hold::Arm(0.0)).map_err(|e| failure(&e))
}

/// A row of gains as a law.
fn law(k: &[f64]) -> Law {
    let at = |i: usize| k.get(i).copied().unwrap_or(0.0);
    Law {
        gain: [at(0), at(1), at(2), at(3)],
        integral: at(4),
    }
}

/// The regulator for a rig about upright: sampled at `rate` (Hz), or continuous.
pub(crate) fn regulator(
    rig: &Rig,
    weights: &Weights<f64, 4, 1>,
    rate: Option<f64>,
) -> Result<Regulator<f64, 4, 1>, Failure> {
    let linear = upright(rig)?;
    let designed = match rate {
        Some(rate) => {
            let (a, b) = zero_order_hold(&linear.a, &linear.b, 1.0 / rate);
            dlqr(&a, &b, weights)
        }
        None => lqr(&linear.a, &linear.b, weights),
    };
    designed.map_err(|e| Failure::new(format!("rig {}: {e}", rig.name)))
}

/// Writes a controller file for this rig, standard but for its controller.
pub(crate) fn write_controller(
    output: &Output,
    rig: &Rig,
    rate: Option<f64>,
    controller: Settings,
) {
    let file = ControllerFile {
        made_for: MadeFor {
            rig: Some(rig.name.clone()),
            rate,
        },
        config: Config::with_controller(controller),
    };
    if output.write(file.to_toml()) {
        note!("{output} written");
    }
}

fn run_lqr(args: &LqrArgs) -> Result<(), Failure> {
    let rig = Rig::load(&args.common.rig)?;
    let weights = match (args.q, args.r) {
        (Some(q), Some(r)) => Weights::diagonal(q, [r]),
        _ => balance_weights(&rig.params),
    };
    let regulator = regulator(&rig, &weights, args.common.rate)?;
    let k = regulator.gain;
    let settings = StateFeedback::<f64>::settings().with("gain", k.as_slice())?;
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
            "k": k.as_slice(), "poles": print::poles_json(&judged.poles),
        });
        judged.extend(&mut line);
        writeln!(out, "{line}")?;
        return Ok(());
    }
    writeln!(
        out,
        "{}: u = -K [theta, alpha, theta_dot, alpha_dot]",
        rig.name
    )?;
    gains(&mut out, k.as_slice(), &rig)?;
    judged.print(&mut out)
}

/// A line for each gain, the integral's last.
fn gains(out: &mut impl Write, k: &[f64], rig: &Rig) -> Result<(), Failure> {
    let names = ["theta", "alpha", "theta_dot", "alpha_dot", "integral"];
    let [angle, speed, integral] = match rig.params.motor.actuation {
        Actuation::Voltage => ["V/rad", "V s/rad", "V/(rad s)"],
        Actuation::Current => ["A/rad", "A s/rad", "A/(rad s)"],
        Actuation::Torque => ["N m/rad", "N m s/rad", "N m/(rad s)"],
        Actuation::Acceleration => ["1/s2", "1/s", "1/s3"],
    };
    let units = [angle, angle, speed, speed, integral];
    for ((name, unit), k) in names.into_iter().zip(units).zip(k) {
        writeln!(out, "  K {name:10} {:>12} {unit}", print::significant(*k))?;
    }
    Ok(())
}

/// Poles of a closed loop, sampled ones in continuous time as well.
fn print_poles(
    out: &mut impl Write,
    poles: &[Complex<f64>],
    rate: Option<f64>,
) -> Result<(), Failure> {
    match rate {
        None => writeln!(out, "  poles  {} rad/s", print::poles(poles)),
        Some(rate) => {
            // ln(z)/h: the continuous poles that decay and turn alike.
            // A pole at 0 is a command that is forgotten.
            let lasting = poles.iter().filter(|z| z.norm() > 1e-9);
            let alike: Vec<_> = lasting.map(|z| z.ln() * rate).collect();
            writeln!(
                out,
                "  poles  z = {}\n         ln(z)/h = {} rad/s",
                print::poles(poles),
                print::poles(&alike)
            )
        }
    }?;
    Ok(())
}
