//! `furuta run`: the real-time loop on a rig, real or emulated.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::ValueEnum;
use clap::builder::PossibleValue;
use furuta_ctrl::ControllerFile;
use furuta_hw::{
    EmulatedRig, Emulation, End, LoopSettings, OpenLoop, Pace, PtyRig, Recorded, RigClock,
    SerialTransport, Session, SessionError, Summary, SwingUpBalance, Task as LoggedTask,
    identity::printable, provenance,
};
use furuta_log::LogError;
use furuta_model::Rig;
use serde_json::json;

use super::emulate::{EmulationArgs, positive};
use super::foresight::Foresight;
use super::signal::{ArmArgs, Built, Kind, SignalArgs, not_without_controller};
use crate::failure::Failure;
use crate::interrupt;
use crate::outputs::{self, Output, RecordingKind};
use crate::real_time::{RealTimeArgs, times};
use crate::streams::{self, note};

/// Swing a pendulum up and balance it, or drive it with a test signal, and log the run.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Serial port of the rig.
    #[arg(long, value_name = "PORT", required_unless_present = "emulated")]
    port: Option<String>,
    /// Emulate a rig instead: built-in rig or rig file.
    #[arg(long, value_name = "RIG", conflicts_with = "port")]
    emulated: Option<String>,
    #[command(flatten)]
    emulation: EmulationArgs,
    /// Rig that the controller is designed for: built-in rig or rig file. An emulated rig's own if not given.
    #[arg(long, value_name = "RIG", required_unless_present = "emulated")]
    rig: Option<String>,
    /// Run a rig that is not the one of the rig file all the same.
    #[arg(long)]
    any_rig: bool,
    /// Run a rig whose clock is not the host's all the same: an emulated one on a busy machine, or one that waits for
    /// its host.
    #[arg(long, conflicts_with = "emulated")]
    any_clock: bool,
    /// Run a controller that falls in the rehearsal all the same. Before anything moves, the closed loop is tried on
    /// the nonlinear model of the rig file with its effects, encoders and one sample of delay.
    #[arg(long)]
    any_loop: bool,
    /// Controller file; the standard control system of the rig if not given.
    #[arg(long, value_name = "FILE.toml")]
    controller: Option<PathBuf>,
    /// What to do.
    #[arg(long, value_enum, default_value_t = Task::Balance)]
    task: Task,
    /// Length of the run.
    #[arg(long, value_name = "SECONDS", default_value_t = 20.0, value_parser = positive)]
    duration: f64,
    #[command(flatten)]
    signal: SignalArgs,
    #[command(flatten)]
    arm: ArmArgs,
    /// Log file (MCAP); none is written if not given.
    #[arg(long, value_name = "OUT.mcap", value_parser = outputs::data())]
    log: Option<Output>,
    /// Bits per second of the serial port.
    #[arg(long, default_value_t = SerialTransport::BAUD, conflicts_with = "emulated")]
    baud: u32,
    #[command(flatten)]
    real_time: RealTimeArgs,
    /// Print JSON in place of text.
    #[arg(long)]
    json: bool,
}

/// What to do with the rig.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) enum Task {
    /// Swing up and balance.
    Balance,
    /// Drive the hanging pendulum with a test signal.
    Test(Kind),
}

impl ValueEnum for Task {
    fn value_variants<'a>() -> &'a [Self] {
        &[
            Self::Balance,
            Self::Test(Kind::Zero),
            Self::Test(Kind::Step),
            Self::Test(Kind::Steps),
            Self::Test(Kind::Ramp),
            Self::Test(Kind::Chirp),
            Self::Test(Kind::Multisine),
            Self::Test(Kind::Prbs),
            Self::Test(Kind::Noise),
        ]
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        match self {
            Self::Balance => Some(PossibleValue::new("balance").help("Swing up and balance")),
            Self::Test(kind) => kind.to_possible_value(),
        }
    }
}

/// Amplitude of a test signal, as a part of the command limit, if none is given.
const AMPLITUDE: f64 = 0.2;

/// The arm's steps while balancing, if nothing else is asked for, rad.
const STEPS: f64 = 0.2;

impl Args {
    /// Refuses options that have no use in the run asked for.
    fn check(&self) -> Result<(), Failure> {
        if self.port.is_some() {
            self.emulation.not_on_a_port()?;
        }
        if let Some(log) = &self.log {
            log.must_be(RecordingKind::Mcap)?;
        }
        match self.task {
            Task::Balance => self.signal.not_without_signal(self.arm.uses(), "--task"),
            Task::Test(_) => not_without_controller(
                self.arm.given().into_iter().chain([
                    ("--controller", self.controller.is_some()),
                    ("--any-loop", self.any_loop),
                ]),
                "--task balance",
            ),
        }
    }
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    args.check()?;
    let name = args
        .rig
        .as_deref()
        .or(args.emulated.as_deref())
        .unwrap_or_default();
    let rig = Rig::load(name)?;
    // Before the rig is disturbed.
    let file = load_controller(args.controller.as_deref())?;
    // Lives as long as the run: dropping it switches the emulated rig off.
    let emulated = match &args.emulated {
        Some(true_rig) => {
            let on: EmulatedRig = args.emulation.rig(&Rig::load(true_rig)?)?;
            Some(PtyRig::start(on, Pace::Patient)?)
        }
        None => None,
    };
    let port = emulated
        .as_ref()
        .map(PtyRig::path)
        .or(args.port.as_deref())
        .unwrap_or_default();
    let mut session = Session::open(port, args.baud)?;
    // An emulated rig is the one that was asked for, and nothing of it can break.
    if args.any_rig || emulated.is_some() {
        for mismatch in session.mismatches(&rig) {
            note!("warning: {mismatch}");
        }
    } else {
        session.check(&rig)?;
    }
    if !args.json {
        note!(
            "{} on {port} at {:.0} Hz; Ctrl-C ends the run",
            printable(&session.hello().rig),
            1.0 / session.period()
        );
    }

    let duration = Duration::from_secs_f64(args.duration);
    let settings = LoopSettings {
        stop: Some(interrupt::flag()),
        probe: Some(LoopSettings::PROBE),
        clock: if args.any_clock || emulated.is_some() {
            RigClock::Emulated
        } else {
            RigClock::Real
        },
        real_time: args.real_time.asked(),
        ..LoopSettings::new(&rig, session.period(), duration)
    };
    let mut foresight = None;
    let (summary, recorded) = match args.task {
        Task::Test(kind) => {
            let Built {
                excitation,
                centring,
                notes,
            } = args.signal.build(kind, args.duration, &rig, AMPLITUDE)?;
            excitation.check_sample_period(session.period())?;
            if !args.json {
                for note in notes {
                    note!("{note}");
                }
            }
            let pilot = OpenLoop::new(&rig, session.period(), excitation.clone()).centred(centring);
            let words = pilot.describe();
            let task = LoggedTask::Excite {
                excitation: Box::new(excitation),
                centring,
            };
            let metadata = provenance::metadata(&rig, None, &task, words, session.hello());
            let log = args.log.as_ref().map(|log| (log.path(), &metadata));
            session.run(&pilot, &settings, log)
        }
        Task::Balance => {
            let reference = args.arm.reference(STEPS, &args.signal)?;
            warn_of_another(&file, &rig, 1.0 / session.period());
            let pilot =
                SwingUpBalance::from_config(&file.config, &rig, session.period(), reference)
                    .map_err(|e| of_controller(args.controller.as_deref(), &e))?;
            let emulation = Emulation {
                period_us: session.hello().period_us,
                ..Emulation::default()
            };
            foresight = Foresight::of(&rig, &emulation, &file.config, reference);
            if let Some(warning) = foresight.as_ref().and_then(Foresight::warning) {
                if !args.any_loop && foresight.as_ref().is_some_and(Foresight::falls) {
                    return Err(Failure::new(format!(
                        "{warning}; nothing was moved, and --any-loop runs it all the same"
                    )));
                }
                note!("note: {warning}");
            }
            let (words, task) = (pilot.describe(), LoggedTask::Balance { reference });
            let metadata = provenance::metadata(&rig, Some(&file), &task, words, session.hello());
            let log = args.log.as_ref().map(|log| (log.path(), &metadata));
            session.run(&pilot, &settings, log)
        }
    }
    .map_err(|e| match e {
        SessionError::Log(e) => of_log(args.log.as_ref(), e),
        other => Failure::from(other),
    })?;

    let kept = recorded
        .as_ref()
        .zip(args.log.as_ref())
        .map(|(recorded, path)| kept(recorded, path));
    let explanation = foresight.and_then(|f| f.explanation(&summary));
    if args.json {
        writeln!(
            streams::output(),
            "{}",
            report(&summary, recorded.as_ref(), explanation.as_deref(), args)
        )?;
    } else {
        writeln!(streams::output(), "{}", text(&summary, emulated.is_some()))?;
        if let Some(explanation) = &explanation {
            writeln!(streams::output(), "{explanation}")?;
        }
        if let Some(kept) = &kept {
            writeln!(streams::output(), "{kept}")?;
        }
    }
    match (&summary.end, recorded.and_then(|r| r.error)) {
        (End::Failed(error), _) => Err(match kept {
            Some(kept) => Failure::new(format!("{error} ({kept})")),
            None => Failure::from(error),
        }),
        (End::Finished | End::Stopped, Some(error)) => Err(of_log(args.log.as_ref(), error)),
        (End::Finished | End::Stopped, None) => Ok(()),
    }
}

/// The controller file at this path, or the standard one.
pub(crate) fn load_controller(path: Option<&Path>) -> Result<ControllerFile, Failure> {
    match path {
        Some(path) => Ok(ControllerFile::load(path)?),
        None => Ok(ControllerFile::default()),
    }
}

/// What is wrong with a log, under its name.
fn of_log(log: Option<&Output>, error: LogError) -> Failure {
    match (log, error) {
        // These name the file themselves.
        (_, error @ (LogError::Create { .. } | LogError::Keep { .. })) => Failure::from(error),
        (Some(log), error) => log.failure(&error),
        (None, error) => Failure::from(error),
    }
}

/// What is wrong with a controller, under the name of its file.
pub(crate) fn of_controller(path: Option<&Path>, error: &dyn std::fmt::Display) -> Failure {
    match path {
        Some(path) => Failure::new(format!("{}: {error}", path.display())),
        None => Failure::new(error.to_string()),
    }
}

/// Says so where a controller file was made for another rig or another rate (Hz).
pub(crate) fn warn_of_another(file: &ControllerFile, rig: &Rig, rate: f64) {
    if let Some(made_for) = file.made_for.rig.as_ref().filter(|name| **name != rig.name) {
        note!(
            "warning: the controller was made for the rig {made_for}, not for {}",
            rig.name
        );
    }
    // Two periods of whole microseconds may stand for one rate.
    if let Some(made_for) = file
        .made_for
        .rate
        .filter(|made_for| (made_for / rate - 1.0).abs() > 0.01)
    {
        note!("warning: the controller was made for {made_for} Hz, not for {rate:.0} Hz");
    }
}

fn kept(recorded: &Recorded, path: &Output) -> String {
    if recorded.records == 0 {
        return format!("nothing logged: {path} is not written");
    }
    format!("{} samples logged in {}", recorded.records, path)
}

/// What happened, for a person. The clock of an emulated rig waits for this machine, so that nothing is late.
fn text(s: &Summary, emulated: bool) -> String {
    let late = if emulated {
        String::new()
    } else {
        format!("{} late, ", s.late)
    };
    let mut lines = vec![format!(
        "{:.2} s, {} samples: {} lost, {late}{} commands missed, {} bad frames, {} not logged",
        s.seconds, s.samples, s.lost, s.held, s.bad_frames, s.unlogged
    )];
    if s.old > 0 {
        lines.push(format!(
            "{} samples were repeated or old, and got no command",
            s.old
        ));
    }
    if s.watchdog > 0 {
        lines.push(format!(
            "the rig's watchdog had the motor off for {} periods",
            s.watchdog
        ));
    }
    let shown = s
        .modes
        .iter()
        .map(|m| format!("{} at {:.2} s", m.mode, m.t))
        .collect::<Vec<_>>()
        .join(", ");
    let more = s.mode_changes.saturating_sub(s.modes.len() as u64);
    lines.push(if more > 0 {
        format!("modes: {shown}, and {more} more changes")
    } else {
        format!("modes: {shown}")
    });
    lines.push(format!("real time: {}", s.granted));
    lines.push(times(&s.timing));
    if emulated {
        lines.push(
            "the emulated rig shares this machine: its own lateness is in wake-up and round trip"
                .to_owned(),
        );
    }
    lines.join("\n")
}

fn report(
    s: &Summary,
    recorded: Option<&Recorded>,
    explanation: Option<&str>,
    args: &Args,
) -> serde_json::Value {
    json!({
        "end": match &s.end { End::Finished => "finished", End::Stopped => "stopped", End::Failed(_) => "failed" },
        "error": s.error().map(ToString::to_string),
        "seconds": s.seconds,
        "samples": s.samples,
        "lost": s.lost,
        "old": s.old,
        "late": s.late,
        "commands_missed": s.held,
        "watchdog": s.watchdog,
        "bad_frames": s.bad_frames,
        "not_logged": s.unlogged,
        "timing": s.timing.summary(),
        "real_time": s.granted,
        "modes": s.modes.iter().map(|m| json!({ "t": m.t, "mode": m.mode.name() })).collect::<Vec<_>>(),
        "mode_changes": s.mode_changes,
        "explanation": explanation,
        "log": args.log.as_ref().map(Output::to_string),
        "logged": recorded.map(|r| r.records),
    })
}
