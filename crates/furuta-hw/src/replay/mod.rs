//! A log through its pilot again: the very estimator, supervisor and controller that made it, rebuilt from what the log
//! says of itself, on the logged measurements and their timing. What it commands must be what is logged, bit for bit;
//! where it is not, the log was changed, or the program was.
//!
//! With another controller or another rig file it is shown what they would have commanded at the same measurements.
//! That is no simulation: the logged motion does not follow the other commands.
//!
//! ```
//! use furuta_hw::{
//!     EmulatedRig, EmulatedTransport, Emulation, LoopSettings, Reference, ReplayOptions, Session, SwingUpBalance,
//!     Task, provenance, replay,
//! };
//! use furuta_ctrl::ControllerFile;
//! use std::time::Duration;
//!
//! let rig = furuta_model::Rig::builtin("shahzad2022-srv02").ok_or("no such rig")?;
//! let emulated = EmulatedRig::new(&rig, &Emulation::default())?;
//! let mut session = Session::connect(EmulatedTransport::new(emulated))?;
//! let (file, reference) = (ControllerFile::default(), Reference::Constant(0.0));
//! let pilot = SwingUpBalance::from_config(&file.config, &rig, session.period(), reference)?;
//! let settings = LoopSettings::new(&rig, session.period(), Duration::from_secs(2));
//! let said = provenance::metadata(&rig, Some(&file), &Task::Balance { reference }, pilot.describe(), session.hello());
//! let path = std::env::temp_dir().join(format!("furuta-replay-{}.mcap", std::process::id()));
//! session.run(&pilot, &settings, Some((&path, &said)))?;
//!
//! let mut log = furuta_log::read(&path)?;
//! # std::fs::remove_file(&path)?;
//! let same = replay(&log, &ReplayOptions::default())?;
//! assert!(same.is_identical());
//! assert!(same.to_string().starts_with("1001 of 1001 commands equal, bit for bit"));
//!
//! log.records[500].command = log.records[500].command.next_up();
//! let other = replay(&log, &ReplayOptions::default())?;
//! assert!(other.to_string().contains("sample 500") && other.to_string().contains("1 ULP"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod difference;
mod error;
mod evidence;
mod source;

use furuta_ctrl::ControllerFile;
use furuta_log::{Log, Mode, Record};
use furuta_model::Rig;
use furuta_wire::Status;

pub use difference::{Difference, Quantity, ulps};
pub use error::ReplayError;
pub use evidence::Impossible;

use crate::pilot::{Measurement, Pilot};
use crate::run_error::RunError;
use crate::safety::SafetyMonitor;
use evidence::Evidence;
use source::{AnyPilot, Source};

/// What to replay a log with; by default, what made it.
#[derive(Clone, Debug, Default)]
pub struct ReplayOptions {
    /// Another controller: what it would have commanded.
    pub controller: Option<ControllerFile>,
    /// Another rig file to design it for.
    pub rig: Option<Rig>,
    /// Take that rig file even where it is of another rig than the log's.
    pub any_rig: bool,
    /// Compare even where another version of furuta wrote the log.
    pub any_version: bool,
}

/// One sample of a log, replayed.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Replayed {
    /// Voltage answered (V).
    pub command: f64,
    /// Arm speed, estimated (rad/s).
    pub theta_dot: f64,
    /// Pendulum speed, estimated (rad/s).
    pub alpha_dot: f64,
    /// Arm angle asked for (rad).
    pub reference: f64,
    /// What the pilot was doing.
    pub mode: Mode,
}

/// The first thing that is not as it should be.
#[derive(Clone, Debug, PartialEq)]
pub enum Finding {
    /// The log says what no run of this rig can have given.
    Impossible(Impossible),
    /// The pilot answers otherwise than is logged.
    Differs(Difference),
}

impl Finding {
    /// Index of its sample in the log, from 0.
    #[must_use]
    pub fn index(&self) -> usize {
        match self {
            Self::Impossible(found) => found.index,
            Self::Differs(found) => found.index,
        }
    }
}

/// Records that the log does not have though the loop had their samples: its writer did not keep up.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Hole {
    /// Index of the first record behind it.
    pub index: usize,
    /// How many are missing.
    pub records: u32,
    /// Time of the last record before it (s).
    pub t: f64,
}

/// A log, replayed.
#[derive(Debug)]
pub struct Replay {
    /// Whether it was replayed with what made it: only then must everything be equal.
    pub same_pilot: bool,
    /// The pilot in words.
    pub pilot: String,
    /// One for each record, up to the first hole where there is one and the pilot is the log's own.
    pub samples: Vec<Replayed>,
    /// Commands that are equal, bit for bit.
    pub equal: usize,
    /// The first thing that is not as it should be.
    pub first: Option<Finding>,
    /// The largest difference between two commands (V), and the index of its sample.
    pub largest: Option<(usize, f64)>,
    /// The first place where records are missing.
    pub hole: Option<Hole>,
    /// What ended the run by the replay, and the index of the sample at which it did.
    pub fault: Option<(usize, RunError)>,
}

impl Replay {
    /// Whether the log's own pilot answered every record of it as is logged, bit for bit: commands, modes, estimates
    /// and references.
    #[must_use]
    pub fn is_identical(&self) -> bool {
        self.same_pilot && self.first.is_none() && self.hole.is_none()
    }
}

/// Replays a log.
///
/// A log that was cut off is replayed as far as it goes. Samples lost on the line are known to the log and bridged as
/// they were; records that are missing ([`Hole`]) are not, so that an exact replay ends there.
///
/// # Errors
/// [`ReplayError`] where the log does not hold what it takes, or is of another version or another rig.
pub fn replay(log: &Log, options: &ReplayOptions) -> Result<Replay, ReplayError> {
    let source = Source::of(log, options)?;
    Ok(match &source.pilot {
        AnyPilot::Balance(pilot) => replay_with(pilot, &source, &log.records),
        AnyPilot::Excite(pilot) => replay_with(pilot, &source, &log.records),
    })
}

fn replay_with<P: Pilot>(pilot: &P, source: &Source, records: &[Record]) -> Replay {
    let mut replay = Replay {
        same_pilot: source.same_pilot,
        pilot: source.pilot.describe(),
        samples: Vec::with_capacity(records.len()),
        equal: 0,
        first: None,
        largest: None,
        hole: None,
        fault: None,
    };
    let mut evidence = Evidence::new(&source.hello);
    let mut state = pilot.start();
    let mut monitor = SafetyMonitor::new(source.limits, source.brake);
    for (index, record) in records.iter().enumerate() {
        let before = index.checked_sub(1).and_then(|k| records.get(k));
        let periods = before.map_or(1, |before| record.seq.wrapping_sub(before.seq));
        if let Some(hole) = hole(index, record, before, periods) {
            replay.hole.get_or_insert(hole);
            if replay.same_pilot {
                break;
            }
        }
        let (answer, fault) = answer(pilot, &mut state, &mut monitor, record, periods);
        if let Some(fault) = fault {
            replay.fault.get_or_insert((index, fault));
        }
        replay.take(index, record, answer, evidence.impossible(index, records));
    }
    replay
}

/// As in the loop.
fn answer<P: Pilot>(
    pilot: &P,
    state: &mut P::State,
    monitor: &mut SafetyMonitor,
    record: &Record,
    periods: u32,
) -> (Replayed, Option<RunError>) {
    let measurement = Measurement {
        t: record.t,
        periods,
        theta: record.theta,
        alpha: record.alpha,
        held: record.u,
    };
    let decision = pilot.process(state, &measurement);
    let status = Status::from_bits(record.status);
    let safe = monitor.check(status, &measurement, &decision);
    let replayed = Replayed {
        command: safe.volts,
        theta_dot: decision.theta_dot,
        alpha_dot: decision.alpha_dot,
        reference: decision.reference,
        mode: safe.mode,
    };
    (replayed, safe.end)
}

/// A rig counts from its power-on and the log from the run's first sample: only the time tells whether that is here.
fn hole(index: usize, record: &Record, before: Option<&Record>, periods: u32) -> Option<Hole> {
    let Some(before) = before else {
        return (record.t > 0.0).then_some(Hole {
            index,
            records: 1, // at least
            t: 0.0,
        });
    };
    let records = periods.checked_sub(record.lost.saturating_add(1))?;
    (records > 0 && periods <= u32::MAX / 2).then_some(Hole {
        index,
        records,
        t: before.t,
    })
}

impl Replay {
    fn take(
        &mut self,
        index: usize,
        record: &Record,
        answer: Replayed,
        impossible: Option<Impossible>,
    ) {
        self.samples.push(answer);
        self.equal += usize::from(difference::same(record.command, answer.command));
        let apart = (record.command - answer.command).abs();
        if apart > self.largest.map_or(0.0, |(_, largest)| largest) {
            self.largest = Some((index, apart));
        }
        if self.first.is_none() {
            self.first = impossible
                .map(Finding::Impossible)
                .or_else(|| Difference::between(index, record, &answer).map(Finding::Differs));
        }
    }
}

/// In words: how many commands are equal, and the first thing that is not as it should be.
impl std::fmt::Display for Replay {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let n = self.samples.len();
        if !self.same_pilot {
            write!(
                f,
                "another pilot ({}) on the same measurements: {} of {n} commands equal",
                self.pilot, self.equal
            )?;
            if let Some((index, volts)) = self.largest {
                write!(f, "; largest difference {volts:.4} V, at sample {index}")?;
            }
            if let Some((index, fault)) = &self.fault {
                write!(
                    f,
                    "; it would have ended the run at sample {index}: {fault}"
                )?;
            }
            return Ok(());
        }
        write!(f, "{} of {n} commands equal, bit for bit", self.equal)?;
        match &self.first {
            None => write!(f, ", and so are modes, estimates and references")?,
            Some(Finding::Differs(found)) => write!(f, "; the first that differs: {found}")?,
            Some(Finding::Impossible(found)) => write!(f, "; {found}")?,
        }
        if let Some(Hole { index, records, t }) = self.hole {
            write!(
                f,
                "; at least {records} records are missing before record {index}, after t = {t:.3} s (its \
                 writer did not keep up): what follows cannot be replayed"
            )?;
        }
        Ok(())
    }
}
