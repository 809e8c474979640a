//! Runs on the emulated rig, replayed: the very commands, bit for bit; and what was changed afterwards, found at its
//! sample.

use crate::common;

use std::io::Cursor;
use std::path::Path;
use std::time::Duration;

use common::{TempLog, srv02};
use furuta_ctrl::ControllerFile;
use furuta_hw::replay::Finding;
use furuta_hw::{
    EmulatedRig, EmulatedTransport, Emulation, End, Excitation, FaultRates, FaultyTransport,
    LoopSettings, OpenLoop, Pilot, Reference, Replay, ReplayError, ReplayOptions, Session,
    SwingUpBalance, Task, provenance, replay,
};
use furuta_log::{Log, LogWriter, Metadata, Mode};
use furuta_model::signals::{Centring, Chirp, Noise, Sweep};
use furuta_model::{Limits, Rig, State};
use proptest::prelude::*;

/// One frame in fifty lost, some late, some bytes damaged.
const LINE: FaultRates = FaultRates {
    frame_lost: 0.02,
    delayed: 0.01,
    lost: 1e-4,
    flipped: 1e-4,
    doubled: 1e-4,
};

/// A run over a line with faults; the pendulum is pushed over twice where `push` is set.
fn fly<P: Pilot + Sync>(
    rig: &Rig,
    seconds: f64,
    push: bool,
    make: impl FnOnce(f64) -> (P, Option<ControllerFile>, Task, String),
    path: &Path,
) -> (End, Metadata) {
    let emulated = EmulatedRig::new(rig, &Emulation::default()).expect("valid");
    let line = FaultyTransport::new(Pushed::new(emulated, push), LINE, 7);
    let mut session = Session::connect(line).expect("it answers");
    let (pilot, file, task, words) = make(session.period());
    let said = provenance::metadata(rig, file.as_ref(), &task, words, session.hello());
    let duration = Duration::from_secs_f64(seconds);
    let settings = LoopSettings {
        silence: Duration::from_secs(5),
        ..LoopSettings::new(rig, session.period(), duration)
    };
    let (summary, recorded) = session
        .run(&pilot, &settings, Some((path, &said)))
        .expect("writable");
    let recorded = recorded.expect("logged");
    assert!(recorded.error.is_none() && summary.unlogged == 0);
    (summary.end, said)
}

fn balance(
    rig: &Rig,
    controller: &str,
    reference: Reference,
    push: bool,
    name: &str,
) -> (End, Log) {
    let file = ControllerFile::from_toml(controller).expect("valid");
    let log = TempLog::new(&format!("replay-{name}"));
    let (end, _) = fly(
        rig,
        8.0,
        push,
        |period| {
            let pilot = SwingUpBalance::from_config(&file.config, rig, period, reference)
                .expect("has a controller");
            let words = pilot.describe();
            (
                pilot,
                Some(file.clone()),
                Task::Balance { reference },
                words,
            )
        },
        &log.0,
    );
    (end, log.read())
}

/// An emulated rig whose pendulum is pushed over, after 4 and after 6 seconds.
struct Pushed {
    transport: EmulatedTransport,
    reads: u32,
    push: bool,
}

impl Pushed {
    fn new(rig: EmulatedRig, push: bool) -> Self {
        Self {
            transport: EmulatedTransport::new(rig),
            reads: 0,
            push,
        }
    }
}

impl furuta_hw::Transport for Pushed {
    fn read(
        &mut self,
        buffer: &mut [u8],
        timeout: Duration,
    ) -> Result<usize, furuta_hw::TransportError> {
        self.reads += 1;
        if self.push && matches!(self.reads, 2000 | 3000) {
            let rig = self.transport.rig();
            let x = rig.state();
            rig.set_state(State {
                alpha_dot: x.alpha_dot + 12.0,
                ..x
            });
        }
        self.transport.read(buffer, timeout)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), furuta_hw::TransportError> {
        self.transport.write(bytes)
    }

    fn discard_input(&mut self) -> Result<(), furuta_hw::TransportError> {
        self.transport.discard_input()
    }

    fn now(&self) -> std::time::Instant {
        self.transport.now()
    }
}

fn again(log: &Log) -> Replay {
    replay(log, &ReplayOptions::default()).expect("all that it takes is there")
}

fn identical(log: &Log) {
    let replayed = again(log);
    assert!(replayed.is_identical(), "{replayed}");
    assert_eq!(
        (replayed.samples.len(), replayed.equal),
        (log.records.len(), log.records.len())
    );
}

fn modes(log: &Log) -> Vec<Mode> {
    let mut modes: Vec<_> = log.records.iter().map(|r| r.mode).collect();
    modes.dedup();
    modes
}

const STEPS: Reference = Reference::Steps {
    amplitude: 0.3,
    hold: 1.0,
};

/// Swing-up, every kind of controller with every kind of estimator, on a line that loses frames, pushed over twice.
#[test]
fn every_controller_and_estimator_is_replayed_bit_for_bit() {
    let controllers = furuta_ctrl::controllers::CATALOGUE;
    let estimators = furuta_ctrl::estimators::CATALOGUE;
    let n = controllers.len().max(estimators.len());
    assert!(n >= 4, "LQR, sliding mode, MPC and more");
    for k in 0..n {
        let controller = controllers[k % controllers.len()].id;
        let estimator = estimators[k % estimators.len()].id;
        let name = format!("{controller}-{estimator}");
        let text =
            format!("[controller]\nkind = \"{controller}\"\n[estimator]\nkind = \"{estimator}\"\n");
        let (end, log) = balance(&srv02(), &text, STEPS, true, &name);
        println!(
            "{name}: {} samples, {end:?}, {:?}",
            log.records.len(),
            modes(&log)
        );
        let lost: u32 = log.records.iter().map(|r| r.lost).sum();
        assert!(lost > 20, "{name}: the line lost {lost} samples");
        assert!(modes(&log).contains(&Mode::SwingUp), "{name}");
        identical(&log);
    }
}

#[test]
fn mode_changes_and_references_are_replayed() {
    let noise = Reference::Noise(Noise::new(0.1, 0.2, 3.0, 5).expect("valid"));
    let (end, log) = balance(&srv02(), "", noise, true, "modes");
    assert!(matches!(end, End::Finished), "{end:?}");
    use Mode::{Balance, SwingUp};
    // Pushed over while it balances, it swings up once more.
    assert!(
        modes(&log).starts_with(&[SwingUp, Balance, SwingUp, Balance]),
        "{:?}",
        modes(&log)
    );
    assert!(log.records.iter().any(|r| r.reference.abs() > 0.05));
    identical(&log);
}

#[test]
fn a_run_that_ended_at_a_fault_is_replayed() {
    let rig = Rig {
        limits: Limits {
            arm_angle: Some(0.2),
            ..Limits::default()
        },
        ..srv02()
    };
    let (end, log) = balance(&rig, "", STEPS, false, "fault");
    assert!(matches!(end, End::Failed(_)), "{end:?}");
    let last = log.records.last().expect("samples");
    assert_eq!(last.command, 0.0);
    identical(&log);
    let (index, fault) = again(&log).fault.expect("the same fault");
    assert_eq!(index, log.records.len() - 1);
    assert!(fault.to_string().contains("arm"), "{fault}");
}

#[test]
fn a_test_signal_is_replayed() {
    let rig = srv02();
    let log = TempLog::new("replay-chirp");
    let chirp = Chirp::new(1.5, 0.2, 5.0, 4.0, Sweep::Logarithmic).expect("valid");
    let excitation = Excitation::new(chirp, 4.0)
        .and_then(|e| e.faded(0.3, 0.3))
        .expect("valid");
    let (end, _) = fly(
        &rig,
        4.0,
        false,
        |period| {
            let centring = Some(Centring::new(0.4).expect("valid"));
            let pilot = OpenLoop::new(&rig, period, excitation.clone()).centred(centring);
            let words = pilot.describe();
            let task = Task::Excite {
                excitation: Box::new(excitation),
                centring,
            };
            (pilot, None, task, words)
        },
        &log.0,
    );
    assert!(matches!(end, End::Finished), "{end:?}");
    identical(&log.read());
}

/// A file cut off is replayed as far as it goes; flipped bits of the file itself are found by its checksums.
#[test]
fn a_log_cut_off_or_damaged_is_replayed_as_far_as_it_goes() {
    let (_, log) = balance(&srv02(), "", STEPS, false, "cut");
    let mut bytes = written(&log);
    let whole = log.records.len();
    let cut = furuta_log::read_from(&bytes[..bytes.len() / 2]).expect("readable");
    assert!(cut.notice.is_some() && cut.records.len() > whole / 4);
    identical(&cut);
    let middle = middle_of_a_chunk(&bytes);
    bytes[middle] ^= 4;
    let damaged = furuta_log::read_from(&bytes[..]).expect("readable");
    assert!(damaged.notice.is_some() && damaged.records.len() < whole);
    identical(&damaged);
}

/// Within the first chunk that begins in the second half: the index between chunks holds no records.
fn middle_of_a_chunk(bytes: &[u8]) -> usize {
    const CHUNK: u8 = 6;
    let mut at = 8; // behind the magic bytes
    loop {
        let length = bytes[at + 1..at + 9].try_into().map(u64::from_le_bytes);
        let length = usize::try_from(length.expect("eight bytes")).expect("of this file");
        if bytes[at] == CHUNK && at > bytes.len() / 2 {
            break at + 9 + length / 2;
        }
        at += 9 + length;
    }
}

fn written(log: &Log) -> Vec<u8> {
    let metadata = log.metadata.clone().expect("metadata");
    let mut writer = LogWriter::new(Cursor::new(Vec::new()), &metadata).expect("memory");
    for record in &log.records {
        writer.write(record).expect("memory");
    }
    writer.finish().expect("memory").into_inner()
}

/// Records that the writer could not keep up with: exact up to there, and said so.
#[test]
fn a_hole_in_the_log_is_told() {
    let (_, mut log) = balance(&srv02(), "", STEPS, false, "hole");
    log.records.drain(1000..1010);
    let replayed = again(&log);
    let hole = replayed.hole.expect("found");
    assert_eq!((hole.index, replayed.samples.len()), (1000, 1000));
    assert!(hole.records >= 10 && replayed.first.is_none() && !replayed.is_identical());
    assert!(
        replayed
            .to_string()
            .contains("are missing before record 1000"),
        "{replayed}"
    );
    log.records.drain(..1);
    assert_eq!(again(&log).hole.map(|hole| hole.index), Some(0));
}

#[test]
fn another_controller_shows_what_it_would_have_commanded() {
    let (_, log) = balance(&srv02(), "", STEPS, false, "other");
    let sliding =
        ControllerFile::from_toml("[controller]\nkind = \"lqr_sliding\"\n").expect("valid");
    let options = ReplayOptions {
        controller: Some(sliding),
        ..ReplayOptions::default()
    };
    let other = replay(&log, &options).expect("replayed");
    assert!(!other.same_pilot && other.samples.len() == log.records.len());
    assert!(
        other.largest.is_some_and(|(_, volts)| volts > 0.1),
        "{other}"
    );
    // The very same file is the same controller, whoever gives it; and so is the same rig.
    let own = log.metadata.as_ref().expect("metadata").extra[provenance::CONTROLLER_FILE].clone();
    let options = ReplayOptions {
        controller: Some(ControllerFile::from_toml(&own).expect("own")),
        rig: Some(srv02()),
        ..ReplayOptions::default()
    };
    assert!(replay(&log, &options).expect("replayed").is_identical());
    // A rig file with another friction makes another estimator.
    let mut repaired = srv02();
    repaired.params.arm.viscous *= 2.0;
    let options = ReplayOptions {
        rig: Some(repaired),
        ..ReplayOptions::default()
    };
    assert!(!replay(&log, &options).expect("replayed").same_pilot);
}

#[test]
fn a_log_that_cannot_be_replayed_is_refused_in_words() {
    let (_, log) = balance(&srv02(), "", STEPS, false, "refused");
    let with = |change: &dyn Fn(&mut Metadata)| {
        let mut log = log.clone();
        change(log.metadata.as_mut().expect("metadata"));
        replay(&log, &ReplayOptions::default()).expect_err("refused")
    };
    let older = with(&|m| drop(m.extra.remove(provenance::FORMAT)));
    assert!(matches!(older, ReplayError::Older { .. }));
    assert!(older.to_string().contains("older than replay"), "{older}");
    let without = with(&|m| drop(m.extra.remove(provenance::CONTROLLER_FILE)));
    assert!(without.to_string().contains("controller_file"), "{without}");
    let newer = with(&|m| drop(m.extra.insert(provenance::FORMAT.into(), "3".into())));
    assert!(matches!(newer, ReplayError::Format { .. }), "{newer}");
    let version = with(&|m| m.software = "furuta 0.0.9".into());
    assert!(
        version.to_string().contains("furuta 0.0.9")
            && version.to_string().contains("--any-version"),
        "{version}"
    );
    for (key, text) in [
        (provenance::TASK, "swim"),
        (provenance::HELLO, "{}"),
        (
            provenance::CONTROLLER_FILE,
            "[controller]\nkind = \"magic\"\n",
        ),
    ] {
        with(&|m| drop(m.extra.insert(key.into(), text.into())));
    }
    with(&|m| m.rig_file = "[rig]\n".into());
    let nothing = Log {
        metadata: None,
        ..log.clone()
    };
    let error = replay(&nothing, &ReplayOptions::default()).expect_err("refused");
    assert!(matches!(error, ReplayError::NoMetadata), "{error}");

    let qube = Rig::builtin("qube-servo-2").expect("built in");
    let mut options = ReplayOptions {
        rig: Some(qube),
        ..ReplayOptions::default()
    };
    let error = replay(&log, &options).expect_err("another rig").to_string();
    assert!(
        error.contains("another rig") && error.contains("name = shahzad2022-srv02"),
        "{error}"
    );
    options.any_rig = true;
    assert!(!replay(&log, &options).expect("asked for").same_pilot);
}

/// One of the numbers of a record that the pilot gave, or that it was given.
#[derive(Copy, Clone, Debug, PartialEq)]
enum Column {
    Theta,
    Alpha,
    U,
    T,
    Command,
    ThetaDot,
    AlphaDot,
    Reference,
}

use Column::{Alpha, AlphaDot, Command, Reference as Asked, T, Theta, ThetaDot, U};

/// Any single bit of any measurement, time, voltage, command or estimate: found at its sample. (Whether the very last
/// tick came late, nothing after it tells.)
#[test]
fn a_flipped_bit_is_found_at_its_sample() {
    let (_, log) = balance(&srv02(), "", STEPS, false, "bits");
    // Enough for swing-up, catch and a step of the arm, and few enough to be replayed some hundred times.
    let log = Log {
        records: log.records[..1000].to_vec(),
        ..log
    };
    identical(&log);
    let runner = ProptestConfig {
        cases: 1000,
        failure_persistence: None,
        ..ProptestConfig::default()
    };
    let columns =
        prop::sample::select(vec![Theta, Alpha, U, T, Command, ThetaDot, AlphaDot, Asked]);
    proptest!(runner, |(index in 1_usize..999, bit in 0_u32..64, column in columns)| {
        let mut log = log.clone();
        let record = &mut log.records[index];
        let number = match column {
            Theta => &mut record.theta,
            Alpha => &mut record.alpha,
            U => &mut record.u,
            T => &mut record.t,
            Command => &mut record.command,
            ThetaDot => &mut record.theta_dot,
            AlphaDot => &mut record.alpha_dot,
            Asked => &mut record.reference,
        };
        let was = *number;
        *number = f64::from_bits(was.to_bits() ^ (1 << bit));
        // A tick that came early or late by a part of its period is one that a run can have: 2 ms made 0.5 ms.
        let microseconds = *number * 1e6;
        let possible = (*number - was).abs() < 0.002 && (microseconds - microseconds.round()).abs() < 1e-9;
        prop_assume!(!(column == T && possible));
        let replayed = again(&log);
        prop_assert!(!replayed.is_identical());
        let first = replayed.first.as_ref().map(Finding::index);
        prop_assert_eq!(first, Some(index), "{:?} bit {}: {}", column, bit, &replayed);
    });
}
