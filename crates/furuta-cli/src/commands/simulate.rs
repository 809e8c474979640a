//! `furuta simulate`: a rig's model, driven and recorded.

use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use clap::builder::PossibleValue;
use furuta_chart::{Chart, Line, Panel};
use furuta_ctrl::controllers::{Controller, StateFeedback};
use furuta_ctrl::design::balance_weights;
use furuta_ctrl::supervisor::{Mode, Supervisor};
use furuta_ctrl::{Site, wrap};
use furuta_design::closed_loop::{self, ClosedLoop, Sensing};
use furuta_design::supervised::Supervised;
use furuta_hw::emulate::hidden_effect;
use furuta_hw::{Excitation, Reference};
use furuta_log::Mode as Logged;
use furuta_model::signals::Centring;
use furuta_model::{Rig, State};
use serde_json::json;

use super::design::{four, regulator};
use super::emulate::positive;
use super::run::{load_controller, of_controller, warn_of_another};
use super::signal::{ArmArgs, Built, Kind, SignalArgs, in_unit, not_without_controller};
use crate::failure::Failure;
use crate::outputs::{self, Output, RecordingKind};
use crate::streams::{self, note};

/// Simulate a rig and write a recording: what sensors without error or steps would see, with the true speeds beside it.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Built-in rig or rig file, with the effects it names.
    #[arg(long, value_name = "RIG")]
    rig: String,
    /// Add an effect: ID or ID:NAME=VALUE,... in SI units, or a law of your own: FILE.toml or FILE.toml:NAME=VALUE,...;
    /// may be repeated.
    #[arg(long, value_name = "EFFECT")]
    hide: Vec<String>,
    /// Initial theta, alpha, theta_dot, alpha_dot (rad, rad/s); alpha is 0 upright, 3.14159 hanging. Hanging at rest if
    /// not given, 0.1 rad from upright for the input `lqr`.
    #[arg(
        long,
        value_name = "A,B,C,D",
        value_parser = four,
        allow_hyphen_values = true
    )]
    start: Option<[f64; 4]>,
    /// Motor command.
    #[arg(long, value_enum, default_value_t = Input::Test(Kind::Zero))]
    input: Input,
    #[command(flatten)]
    signal: SignalArgs,
    /// Controller file: the whole control system, swing-up included, on the encoders' readings, a command acting one
    /// sample after it is decided as on a real rig. `furuta design ... --write-controller` writes one; an empty file is
    /// the standard one.
    #[arg(long, value_name = "FILE.toml", conflicts_with = "input")]
    controller: Option<PathBuf>,
    /// The file's controller alone, from near upright, on the true state and without delay, as papers simulate it.
    #[arg(long)]
    ideal: bool,
    #[command(flatten)]
    arm: ArmArgs,
    /// Length of the run.
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, value_parser = positive)]
    duration: f64,
    /// Samples per second; the command is held and the motion integrated (RK4) from one to the next.
    #[arg(long, value_name = "HZ", default_value_t = 500.0, value_parser = positive)]
    rate: f64,
    /// Recording to write (CSV); standard output if not given.
    #[arg(long, short, value_name = "OUT.csv", value_parser = outputs::data())]
    output: Option<Output>,
    /// Print one line of JSON, an array for each column, in place of CSV.
    #[arg(long, conflicts_with = "output")]
    json: bool,
    /// Draw arm, pendulum and command (SVG); without an output no recording is written then.
    #[arg(long, value_name = "OUT.svg", value_parser = outputs::picture())]
    plot: Option<Output>,
}

/// Motor command during a simulation.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
enum Input {
    /// A test signal.
    Test(Kind),
    /// State feedback from the true state, with the gain `furuta design lqr` gives.
    Lqr,
}

impl ValueEnum for Input {
    fn value_variants<'a>() -> &'a [Self] {
        &[
            Self::Test(Kind::Zero),
            Self::Test(Kind::Step),
            Self::Test(Kind::Steps),
            Self::Test(Kind::Ramp),
            Self::Test(Kind::Chirp),
            Self::Test(Kind::Multisine),
            Self::Test(Kind::Prbs),
            Self::Test(Kind::Noise),
            Self::Lqr,
        ]
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        match self {
            Self::Test(kind) => kind.to_possible_value(),
            Self::Lqr => Some(PossibleValue::new("lqr").help(
                "State feedback from the true state, with the gain `furuta design lqr` gives",
            )),
        }
    }
}

/// Amplitude of a test signal, as a part of the command limit, if none is given.
const AMPLITUDE: f64 = 0.1;

/// Where the command comes from.
enum Source {
    Open(Box<Excitation>, Option<Centring>),
    Feedback(StateFeedback<f64>),
}

impl Source {
    fn command(&self, t: f64, x: &State<f64>, h: f64) -> f64 {
        match self {
            Self::Open(signal, None) => signal.volts(t),
            Self::Open(signal, Some(pull)) => pull.volts(signal.volts(t), x.theta),
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

impl Source {
    /// The test signal in the arm's unit, where a pull stands beside it.
    fn asked(&self, t: f64) -> Option<(f64, &'static str)> {
        match self {
            Self::Open(signal, Some(pull)) => {
                Some((pull.reference(signal.volts(t)), Logged::Excite.name()))
            }
            _ => None,
        }
    }
}

impl std::fmt::Display for Source {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Open(signal, None) => signal.fmt(f),
            Self::Open(signal, Some(pull)) => {
                write!(f, "{signal}; {pull}")
            }
            Self::Feedback(_) => f.write_str("state feedback (LQR)"),
        }
    }
}

/// One row.
#[derive(Copy, Clone, Debug)]
struct Row {
    /// t, u, theta, alpha, theta_dot, alpha_dot.
    numbers: [f64; 6],
    /// Under a controller or a pull of the arm: where the arm is asked to be (rad), and the supervisor's mode.
    asked: Option<(f64, &'static str)>,
}

const COLUMNS: [&str; 6] = ["t", "u", "theta", "alpha", "theta_dot", "alpha_dot"];

/// Samples that fit into memory without a second thought: a day at 1 kHz would not.
const MOST_SAMPLES: f64 = 2e7;

impl Args {
    /// Refuses options that have no use in the run asked for.
    fn check(&self) -> Result<(), Failure> {
        // A pull of the arm can stand beside no command at all.
        let used: Option<&[&str]> = match (&self.controller, self.input) {
            (Some(_), _) => Some(self.arm.uses()),
            (None, Input::Lqr) => Some(&[]),
            (None, Input::Test(Kind::Zero)) => Some(&["--centre"]),
            (None, Input::Test(_)) => None,
        };
        if let Some(used) = used {
            self.signal.not_without_signal(used, "--input")?;
        }
        if self.controller.is_none() {
            let ideal = [("--ideal", self.ideal)];
            let options = self.arm.given().into_iter().chain(ideal);
            not_without_controller(options, "--controller FILE.toml")?;
        }
        match &self.output {
            Some(output) => output.must_be(RecordingKind::Csv),
            None => Ok(()),
        }
    }
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    args.check()?;
    let known = Rig::load(&args.rig)?;
    let mut rig = known.clone();
    for text in &args.hide {
        rig.effects.push(hidden_effect(text, &rig.params)?);
    }
    let Course {
        input,
        rows,
        fallen,
    } = match &args.controller {
        Some(path) => controlled(&known, &rig, path, args)?,
        None => simulate(&rig, args)?,
    };
    hand_out(args, &rig, &input, &rows)?;
    match fallen {
        Some(t) => Err(Failure::new(format!(
            "the pendulum fell {t:.3} s after the start: start nearer to upright, or leave out --ideal for the swing-up"
        ))),
        None => Ok(()),
    }
}

/// A run.
struct Course {
    /// What the command was, in words.
    input: String,
    rows: Vec<Row>,
    /// When an ideal controller lost the pendulum, s.
    fallen: Option<f64>,
}

impl Course {
    fn new(input: String, rows: Vec<Row>) -> Self {
        Self {
            input,
            rows,
            fallen: None,
        }
    }
}

/// Writes what was asked for.
fn hand_out(args: &Args, rig: &Rig, input: &str, rows: &[Row]) -> Result<(), Failure> {
    if let Some(path) = &args.plot {
        path.write(chart(rig, input, rows).svg());
        if args.output.is_none() && !args.json {
            return Ok(());
        }
    }
    if args.json {
        let mut columns: serde_json::Map<_, _> = COLUMNS
            .iter()
            .enumerate()
            .map(|(i, name)| {
                let values: Vec<f64> = rows.iter().map(|row| row.numbers[i]).collect();
                ((*name).to_owned(), json!(values))
            })
            .collect();
        if rows.iter().any(|r| r.asked.is_some()) {
            let (reference, mode): (Vec<_>, Vec<_>) = rows.iter().filter_map(|r| r.asked).unzip();
            columns.insert("reference".to_owned(), json!(reference));
            columns.insert("mode".to_owned(), json!(mode));
        }
        writeln!(
            streams::output(),
            "{}",
            json!({"rig": rig.name, "input": input, "columns": columns})
        )?;
        return Ok(());
    }
    match &args.output {
        None => write_csv(streams::output(), rig, input, rows)?,
        Some(path) => {
            path.write_by(|file| write_csv(file, rig, input, rows))?;
            note!("{path}: {} samples, {:.3} s", rows.len(), args.duration);
        }
    }
    Ok(())
}

fn chart(rig: &Rig, input: &str, rows: &[Row]) -> Chart {
    let column = |name: &str, i: usize| {
        let points = rows.iter().map(|r| (r.numbers[0], r.numbers[i]));
        Line::new(name, points).colour(0)
    };
    let mut arm = vec![column("", 2)];
    if rows.iter().any(|r| r.asked.is_some()) {
        let asked = rows.iter().filter_map(|r| Some((r.numbers[0], r.asked?.0)));
        arm.push(Line::new("reference", asked).dashed().colour(6));
    }
    let u = format!("u [{}]", rig.params.motor.actuation.unit());
    Chart::new(
        &format!("{}: {input}", rig.name),
        "t [s]",
        vec![
            Panel::new("theta [rad]", arm),
            Panel::new("alpha [rad]", vec![column("", 3)]),
            Panel::new(&u, vec![column("", 1)]),
        ],
    )
}

fn samples(args: &Args) -> Result<u64, Failure> {
    let samples = (args.duration * args.rate).round();
    if samples > MOST_SAMPLES {
        return Err(Failure::new(format!(
            "{samples} samples are too many for one run (at most {MOST_SAMPLES}): give a shorter \
             --duration or a lower --rate"
        )));
    }
    Ok(samples as u64)
}

/// The rig under a controller file's control system, which knows of the rig what `known` says.
fn controlled(known: &Rig, rig: &Rig, path: &Path, args: &Args) -> Result<Course, Failure> {
    let h = 1.0 / args.rate;
    let file = load_controller(Some(path))?;
    warn_of_another(&file, known, args.rate);
    let reference = args.arm.reference(0.0, &args.signal)?;
    let supervisor = Supervisor::design(&file.config, &Site::of(known, h))
        .map_err(|e| of_controller(Some(path), &e))?;
    let samples = samples(args)?;
    let input = format!("controller {}; {reference}", supervisor.balance.spec().id);
    if args.ideal {
        let (rows, fallen) = ideal(rig, &supervisor, reference, args)?;
        return Ok(Course {
            input,
            rows,
            fallen,
        });
    }
    let bench = Supervised::new(&supervisor, rig, h)?;
    let mut run = bench.start(args.start.map_or(State::hanging(), State::from));
    let mut since = None;
    let mut rows = Vec::new();
    for k in 0..samples {
        let t = k as f64 * h;
        let [theta, alpha] = bench.angles(&run);
        let s = bench.sample(&mut run, reference.at(since.map_or(0.0, |since| t - since)));
        since = match s.output.mode {
            Mode::Balance => since.or(Some(t)),
            _ => None,
        };
        rows.push(Row {
            numbers: [t, s.held, theta, alpha, s.x.theta_dot, s.x.alpha_dot],
            asked: Some((s.output.reference, s.output.mode.name())),
        });
        if let Some(fault) = s.fault {
            note!("{fault} at t = {t:.3} s: motor off");
            break;
        }
    }
    Ok(Course::new(input, rows))
}

/// The controller alone, on the true state and without delay; and when the pendulum fell, s.
fn ideal(
    rig: &Rig,
    supervisor: &Supervisor<f64>,
    reference: Reference,
    args: &Args,
) -> Result<(Vec<Row>, Option<f64>), Failure> {
    let h = 1.0 / args.rate;
    let plant = rig.try_plant::<f64>()?;
    plant.check_period(h)?;
    let experiment = ClosedLoop {
        plants: vec![(0.0, plant.into())],
        start: args
            .start
            .map_or(State::new(0.0, 0.1, 0.0, 0.0), State::from),
        period: h,
        substeps: 1,
        duration: args.duration,
        sensing: Sensing::Perfect,
    };
    let arm = |t| State::new(reference.at(t), 0.0, 0.0, 0.0);
    let samples = experiment.run(&supervisor.balance, arm);
    let end = samples.last().map(|s| s.t);
    let fallen = end.filter(|t| *t < args.duration - 1.5 * h);
    let row = |s: &closed_loop::Sample| Row {
        numbers: [s.t, s.u, s.x.theta, s.x.alpha, s.x.theta_dot, s.x.alpha_dot],
        asked: Some((s.reference.theta, Mode::Balance.name())),
    };
    Ok((samples.iter().map(row).collect(), fallen))
}

/// The rig under a test signal or the LQR.
fn simulate(rig: &Rig, args: &Args) -> Result<Course, Failure> {
    let h = 1.0 / args.rate;
    let plant = rig.try_plant::<f64>()?;
    plant.check_period(h)?;
    let samples = samples(args)?;
    let start = match args.start {
        Some(start) => State::from(start),
        None if args.input == Input::Lqr => State::new(0.0, 0.1, 0.0, 0.0),
        None => State::hanging(),
    };
    let limit = rig.params.motor.command_limit;
    let source = match args.input {
        Input::Test(kind) => {
            let Built {
                excitation,
                centring,
                notes,
            } = args.signal.build(kind, args.duration, rig, AMPLITUDE)?;
            excitation.check_sample_period(h)?;
            for note in notes {
                note!("{note}");
            }
            Source::Open(Box::new(excitation), centring)
        }
        Input::Lqr => {
            let gain = regulator(rig, &balance_weights(&rig.params), Some(args.rate))?;
            Source::Feedback(StateFeedback::new(&gain, limit))
        }
    };
    let mut state = plant.rest(start);
    let mut rows = Vec::new();
    for k in 0..samples {
        let t = k as f64 * h;
        let u = source.command(t, &state.x, h).clamp(-limit, limit);
        let [theta, alpha] = plant.measure(&state);
        rows.push(Row {
            numbers: [t, u, theta, alpha, state.x.theta_dot, state.x.alpha_dot],
            asked: source.asked(t),
        });
        plant.step(&mut state, u, h);
        if !state.x.is_finite() {
            return Err(Failure::new(format!(
                "the simulation blew up {t:.4} s after the start: give a higher --rate"
            )));
        }
    }
    let unit = rig.params.motor.actuation.unit();
    Ok(Course::new(in_unit(&source, unit), rows))
}

fn write_csv(out: impl Write, rig: &Rig, input: &str, rows: &[Row]) -> std::io::Result<()> {
    let mut out = BufWriter::new(out);
    writeln!(out, "# simulated: {}, {input}", rig.name)?;
    let asked = rows.first().is_some_and(|row| row.asked.is_some());
    let more = if asked { ",reference,mode" } else { "" };
    writeln!(out, "{}{more}", COLUMNS.join(","))?;
    for row in rows {
        let [t, u, theta, alpha, theta_dot, alpha_dot] = row.numbers;
        write!(out, "{t:.6},{u},{theta},{alpha},{theta_dot},{alpha_dot}")?;
        match row.asked {
            Some((reference, mode)) => writeln!(out, ",{reference},{mode}")?,
            None => writeln!(out)?,
        }
    }
    out.flush()
}
