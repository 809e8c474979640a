//! `furuta simulate`: a rig's model, driven and recorded.

use std::io::{BufWriter, Write};
use std::path::PathBuf;

use furuta_ctrl::controllers::{Controller, StateFeedback};
use furuta_ctrl::design::balance_weights;
use furuta_ctrl::wrap;
use furuta_hw::Chirp;
use furuta_hw::emulate::hidden_effect;
use furuta_model::{Rig, State};
use serde_json::json;

use super::design::{four, regulator};
use super::emulate::positive;
use crate::failure::Failure;

/// Simulate a rig and write a recording: what sensors without error or steps would see, with the true speeds beside it.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Built-in rig or rig file, with the effects it names.
    #[arg(long, value_name = "RIG")]
    rig: String,
    /// Add an effect: ID or ID:NAME=VALUE,... in SI units; may be repeated.
    #[arg(long, value_name = "EFFECT")]
    hide: Vec<String>,
    /// Initial theta, alpha, theta_dot, alpha_dot (rad, rad/s); alpha is 0 upright, 3.14159 hanging. Hanging at rest if not given,
    /// 0.1 rad from upright for the input `lqr`.
    #[arg(
        long,
        value_name = "A,B,C,D",
        value_parser = four,
        allow_hyphen_values = true
    )]
    start: Option<[f64; 4]>,
    /// Motor command.
    #[arg(long, value_enum, default_value_t = Input::Zero)]
    input: Input,
    /// Size of a step or chirp. A tenth of the command limit if not given.
    #[arg(long, value_name = "VOLTS", allow_hyphen_values = true)]
    amplitude: Option<f64>,
    /// Length of the run.
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, value_parser = positive)]
    duration: f64,
    /// Samples per second; the command is held and the motion integrated (RK4) from one to the next.
    #[arg(long, value_name = "HZ", default_value_t = 500.0, value_parser = positive)]
    rate: f64,
    /// Recording to write (CSV); standard output if not given.
    #[arg(long, short, value_name = "OUT.csv")]
    output: Option<PathBuf>,
    /// Print one line of JSON, an array for each column, in place of CSV.
    #[arg(long, conflicts_with = "output")]
    json: bool,
}

/// Motor command during a simulation.
#[derive(clap::ValueEnum, Copy, Clone, Debug, PartialEq, Eq)]
enum Input {
    /// None: the pendulum swings freely.
    Zero,
    /// A step at the start.
    Step,
    /// A sine whose frequency falls from 8 Hz to 0.
    Chirp,
    /// State feedback from the true state, with the gain `furuta design lqr` gives.
    Lqr,
}

/// Where the command comes from.
enum Source {
    Constant(f64),
    Chirp(Chirp),
    Feedback(StateFeedback<f64>),
}

impl Source {
    fn command(&self, t: f64, x: &State<f64>, h: f64) -> f64 {
        match self {
            Self::Constant(u) => *u,
            Self::Chirp(signal) => signal.volts(t),
            Self::Feedback(c) => {
                let x = State {
                    alpha: wrap(x.alpha),
                    ..*x
                };
                c.update(&mut (), &x, &State::upright(), h)
            }
        }
    }
}

/// One row: t, u, theta, alpha, theta_dot, alpha_dot.
type Row = [f64; 6];

const COLUMNS: [&str; 6] = ["t", "u", "theta", "alpha", "theta_dot", "alpha_dot"];

/// Samples that fit into memory without a second thought: a day at 1 kHz would not.
const MOST_SAMPLES: f64 = 2e7;

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut rig = Rig::load(&args.rig)?;
    for text in &args.hide {
        rig.effects.push(hidden_effect(text, &rig.params)?);
    }
    let rows = simulate(&rig, args)?;
    if args.json {
        let columns: serde_json::Map<_, _> = COLUMNS
            .iter()
            .enumerate()
            .map(|(i, name)| {
                let values: Vec<f64> = rows.iter().map(|row| row[i]).collect();
                ((*name).to_owned(), json!(values))
            })
            .collect();
        writeln!(
            std::io::stdout().lock(),
            "{}",
            json!({"rig": rig.name, "columns": columns})
        )?;
        return Ok(());
    }
    match &args.output {
        None => write_csv(std::io::stdout().lock(), &rig, &rows)?,
        Some(path) => {
            let text = |e: std::io::Error| Failure::new(format!("{}: {e}", path.display()));
            let file = std::fs::File::create(path).map_err(text)?;
            write_csv(file, &rig, &rows).map_err(text)?;
            eprintln!(
                "{}: {} samples, {:.3} s",
                path.display(),
                rows.len(),
                args.duration
            );
        }
    }
    Ok(())
}

fn simulate(rig: &Rig, args: &Args) -> Result<Vec<Row>, Failure> {
    let h = 1.0 / args.rate;
    let plant = rig.try_plant::<f64>()?;
    plant.check_period(h)?;
    let samples = (args.duration * args.rate).round();
    if samples > MOST_SAMPLES {
        return Err(Failure::new(format!(
            "{samples} samples are too many for one run (at most {MOST_SAMPLES}): give a shorter --duration or a lower --rate"
        )));
    }
    let start = match args.start {
        Some(start) => State::from(start),
        None if args.input == Input::Lqr => State::new(0.0, 0.1, 0.0, 0.0),
        None => State::hanging(),
    };
    let limit = rig.params.motor.command_limit;
    let amplitude = args.amplitude.unwrap_or(0.1 * limit);
    if amplitude.is_nan() || amplitude.abs() > limit {
        return Err(Failure::new(format!(
            "--amplitude {amplitude} V is beyond the rig's command limit of {limit} V"
        )));
    }
    let source = match args.input {
        Input::Zero => Source::Constant(0.0),
        Input::Step => Source::Constant(amplitude),
        Input::Chirp => Source::Chirp(Chirp {
            amplitude,
            from: 8.0,
            to: 0.0,
            duration: args.duration,
        }),
        Input::Lqr => {
            let gain = regulator(rig, &balance_weights(&rig.params), Some(args.rate))?;
            Source::Feedback(StateFeedback::new(&gain, limit))
        }
    };
    let mut state = plant.rest(start);
    let mut rows = Vec::new();
    for k in 0..samples as u64 {
        let t = k as f64 * h;
        let u = source.command(t, &state.x, h);
        let [theta, alpha] = plant.measure(&state);
        rows.push([t, u, theta, alpha, state.x.theta_dot, state.x.alpha_dot]);
        plant.step(&mut state, u, h);
        if !state.x.is_finite() {
            return Err(Failure::new(format!(
                "the simulation blew up {t:.4} s after the start: give a higher --rate"
            )));
        }
    }
    Ok(rows)
}

fn write_csv(out: impl Write, rig: &Rig, rows: &[Row]) -> std::io::Result<()> {
    let mut out = BufWriter::new(out);
    writeln!(out, "# simulated: {}", rig.name)?;
    writeln!(out, "{}", COLUMNS.join(","))?;
    for [t, u, theta, alpha, theta_dot, alpha_dot] in rows {
        writeln!(out, "{t:.6},{u},{theta},{alpha},{theta_dot},{alpha_dot}")?;
    }
    out.flush()
}
