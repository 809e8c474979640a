//! What goes wrong, and what then happens: rows of docs/faults.md. Without a port or a clock where the fault allows it, so that each run is the same every time.

mod common;

use std::io::{self, Cursor, Seek, SeekFrom, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use common::settings;
use furuta_hw::{
    EmulatedRig, EmulatedTransport, Emulation, End, FaultRates, FaultyTransport, Link, Measurement,
    Pace, Pilot, PtyRig, RecordSender, Recorder, Reference, RunError, SerialTransport, Session,
    SessionError, Summary, SwingUpBalance, Transport, TransportError, run,
};
use furuta_log::{LogError, LogWriter, Metadata, Mode};
use furuta_model::Rig;
use furuta_wire::Hello;

fn srv02() -> Rig {
    Rig::builtin("shahzad2022-srv02").expect("built in")
}

fn emulated() -> EmulatedRig {
    EmulatedRig::new(&srv02(), &Emulation::default()).expect("valid")
}

fn pilot() -> SwingUpBalance {
    SwingUpBalance::design(&srv02(), 0.002, Reference::Constant(0.0)).expect("stabilisable")
}

fn link<T: Transport>(transport: T) -> (Link<T>, Hello) {
    Link::connect(transport, Duration::from_secs(20)).expect("it answers")
}

/// Share of the samples after the first three seconds in which the pendulum was balanced, and the largest angle then (rad).
fn balanced(log: &furuta_log::Log) -> (f64, f64) {
    let late = log.records.iter().filter(|r| r.t > 3.0);
    let (all, up) = late.fold((0, 0), |(all, up), r| {
        (all + 1, up + i32::from(r.mode == Mode::Balance))
    });
    let lean = log
        .records
        .iter()
        .filter(|r| r.t > 3.0 && r.mode == Mode::Balance);
    let lean = lean.fold(0.0_f64, |max, r| max.max(furuta_ctrl::wrap(r.alpha).abs()));
    (f64::from(up) / f64::from(all), lean)
}

fn tempfile(name: &str) -> std::path::PathBuf {
    std::env::temp_dir().join(format!(
        "furuta-hw-faults-{name}-{}.mcap",
        std::process::id()
    ))
}

/// Ten seconds over a faulty line, logged.
fn over_a_line(name: &str, rates: FaultRates, seed: u64) -> (Summary, furuta_log::Log, u64) {
    let mut line = FaultyTransport::new(EmulatedTransport::new(emulated()), rates, seed);
    let path = tempfile(name);
    let log = LogWriter::create(&path, &Metadata::default()).expect("writable");
    let (mut sender, recorder) = Recorder::start(log).expect("a thread");
    let summary = {
        let (mut link, hello) = link(&mut line);
        run(&mut link, &hello, &pilot(), &settings(10.0), &mut sender)
    };
    drop(sender);
    let recorded = recorder.finish();
    assert!(recorded.error.is_none());
    let log = furuta_log::read(&path).expect("own log");
    std::fs::remove_file(&path).expect("written above");
    assert!(matches!(summary.end, End::Finished), "{summary:?}");
    assert_eq!(log.notice, None);
    assert_eq!(log.records.len() as u64, summary.samples);
    // Each gap in the numbers is one that was counted: nothing is lost without being told.
    let told: u64 = log.records.iter().map(|r| u64::from(r.lost)).sum();
    assert_eq!(told, summary.lost);
    for pair in log.records.windows(2) {
        assert_eq!(pair[1].seq - pair[0].seq, pair[1].lost + 1);
        // What the motor gets is the newest command that came through, the one before while none does, or nothing. Never anything else.
        assert!(pair[1].u.abs() <= srv02().params.motor.command_limit);
    }
    let commands: std::collections::HashSet<u32> = log
        .records
        .iter()
        .map(|r| (r.command as f32).to_bits())
        .collect();
    for record in log.records.iter().skip(2) {
        let held = (record.u as f32).to_bits();
        assert!(
            record.u == 0.0 || commands.contains(&held),
            "t = {}",
            record.t
        );
    }
    (summary, log, line.frames_lost())
}

#[test]
fn bytes_lost_flipped_doubled_and_delayed_are_survived() {
    let rates = FaultRates {
        lost: 0.001,
        flipped: 0.001,
        doubled: 0.001,
        delayed: 0.01,
        ..FaultRates::default()
    };
    let (summary, log, _) = over_a_line("bytes", rates, 11);
    assert!(
        summary.bad_frames > 100 && summary.lost > 100 && summary.held > 50,
        "{summary:?}"
    );
    let (share, lean) = balanced(&log);
    assert!(share == 1.0 && lean < 0.2, "{share} {lean}");
}

#[test]
fn one_frame_in_a_hundred_lost_while_balancing() {
    let rates = FaultRates {
        frame_lost: 0.01,
        ..FaultRates::default()
    };
    let (summary, log, lost) = over_a_line("one-percent", rates, 12);
    // 5,000 samples and as many commands: 50 +- 7 of each; five deviations.
    assert!(
        (15..90).contains(&summary.lost) && (50..150).contains(&lost),
        "{summary:?}"
    );
    assert_eq!((summary.bad_frames, summary.watchdog), (0, 0));
    let (share, lean) = balanced(&log);
    assert!(share == 1.0 && lean < 0.05, "{share} {lean}");
}

#[test]
fn one_frame_in_ten_lost_while_balancing() {
    let rates = FaultRates {
        frame_lost: 0.1,
        ..FaultRates::default()
    };
    let (summary, log, lost) = over_a_line("ten-percent", rates, 13);
    assert!(
        (400..600).contains(&summary.lost) && lost > 800,
        "{summary:?}"
    );
    assert_eq!(summary.bad_frames, 0);
    let (share, lean) = balanced(&log);
    assert!(share == 1.0 && lean < 0.1, "{share} {lean}");
}

#[test]
fn a_cable_put_back_makes_a_new_run() {
    let start = || PtyRig::start(emulated(), Pace::HostLed).expect("a port");
    let rig = start();
    let mut session = Session::open(rig.path(), SerialTransport::BAUD).expect("there");
    let pilot = pilot();
    let (summary, _) = session
        .run(&pilot, &settings(0.2), None)
        .expect("no log to fail");
    assert!(matches!(summary.end, End::Finished), "{summary:?}");
    rig.unplug();
    match session.run(&pilot, &settings(0.2), None) {
        Err(SessionError::Link(error)) => {
            assert!(error.to_string().contains("unplugged"), "{error}")
        }
        other => panic!("{other:?}"),
    }
    let rig = start();
    let mut session = Session::open(rig.path(), SerialTransport::BAUD).expect("there again");
    let (summary, _) = session
        .run(&pilot, &settings(0.2), None)
        .expect("no log to fail");
    assert!(matches!(summary.end, End::Finished), "{summary:?}");
}

/// A transport that does something to the rig at a time of the test's choosing: after so many reads.
struct Meanwhile<F> {
    transport: EmulatedTransport,
    reads: u32,
    at: u32,
    what: Option<F>,
}

impl<F: FnOnce(&mut EmulatedTransport)> Transport for Meanwhile<F> {
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, TransportError> {
        self.reads += 1;
        if self.reads > self.at
            && let Some(what) = self.what.take()
        {
            what(&mut self.transport);
        }
        self.transport.read(buffer, timeout)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        self.transport.write(bytes)
    }

    fn discard_input(&mut self) -> Result<(), TransportError> {
        self.transport.discard_input()
    }
}

#[test]
fn a_rig_that_resets_ends_the_run() {
    let mut line = Meanwhile {
        transport: EmulatedTransport::new(emulated()),
        reads: 0,
        at: 1500,
        what: Some(|t: &mut EmulatedTransport| *t.rig() = emulated()),
    };
    let (mut link, hello) = link(&mut line);
    let summary = run(
        &mut link,
        &hello,
        &pilot(),
        &settings(60.0),
        &mut RecordSender::nowhere(),
    );
    match summary.error() {
        Some(error @ RunError::RigReset { seq: 0, last, .. }) => {
            assert!(*last > 1400);
            assert!(error.to_string().contains("the rig restarted"));
        }
        other => panic!("{other:?}"),
    }
    // What the rig then holds is the host's last word.
    assert_eq!(line.transport.rig().tick().volts, 0.0);
}

/// What the rig says, with its clock altered.
struct Stepped {
    transport: EmulatedTransport,
    decoder: furuta_wire::Decoder,
    samples: u32,
    by_us: i64,
}

impl Transport for Stepped {
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, TransportError> {
        let mut raw = [0; 64];
        let n = self.transport.read(&mut raw, timeout)?;
        let mut filled = 0;
        for message in raw[..n]
            .iter()
            .filter_map(|&byte| self.decoder.push(byte))
            .flatten()
        {
            let message = match message {
                furuta_wire::Message::Sample(mut sample) => {
                    self.samples += 1;
                    if self.samples > 500 {
                        sample.t_us = sample.t_us.saturating_add_signed(self.by_us);
                    }
                    furuta_wire::Message::Sample(sample)
                }
                other => other,
            };
            let mut frame = [0; furuta_wire::MAX_FRAME];
            let frame = furuta_wire::encode(&message, &mut frame).expect("fits");
            buffer[filled..filled + frame.len()].copy_from_slice(frame);
            filled += frame.len();
        }
        Ok(filled)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        self.transport.write(bytes)
    }

    fn discard_input(&mut self) -> Result<(), TransportError> {
        self.transport.discard_input()
    }
}

/// The host's own clock is monotonic: what an administrator or NTP does to the time of day is not seen by the loop. The rig's clock is what can step.
#[test]
fn a_clock_that_steps_ends_the_run() {
    for by_us in [3_600_000_000, -700_000] {
        let line = Stepped {
            transport: EmulatedTransport::new(emulated()),
            decoder: furuta_wire::Decoder::new(),
            samples: 0,
            by_us,
        };
        let (mut link, hello) = link(line);
        let summary = run(
            &mut link,
            &hello,
            &pilot(),
            &settings(60.0),
            &mut RecordSender::nowhere(),
        );
        match summary.error() {
            Some(error @ RunError::RigClock { step, t }) => {
                assert!(
                    (step - by_us as f64 * 1e-6).abs() < 1e-6 && *t < 1.0,
                    "{error:?}"
                );
                assert!(error.to_string().contains("clock stepped"));
            }
            other => panic!("{other:?}"),
        }
    }
}

/// A pilot whose estimator fails at the second second.
struct Nan(SwingUpBalance);

impl Pilot for Nan {
    type State = <SwingUpBalance as Pilot>::State;

    fn start(&self) -> Self::State {
        self.0.start()
    }

    fn process(&self, state: &mut Self::State, m: &Measurement) -> furuta_hw::Decision {
        let mut decision = self.0.process(state, m);
        if m.t >= 2.0 {
            decision.alpha_dot = f64::NAN;
        }
        decision
    }
}

#[test]
fn nan_from_an_estimator_ends_the_run_with_the_motor_off() {
    let mut line = EmulatedTransport::new(emulated());
    let path = tempfile("nan");
    let log = LogWriter::create(&path, &Metadata::default()).expect("writable");
    let (mut sender, recorder) = Recorder::start(log).expect("a thread");
    let (mut link, hello) = link(&mut line);
    let summary = run(
        &mut link,
        &hello,
        &Nan(pilot()),
        &settings(60.0),
        &mut sender,
    );
    drop(sender);
    match summary.error() {
        Some(error @ RunError::NotFinite { quantity, t }) => {
            assert_eq!((*quantity, *t), ("pendulum speed", 2.0));
            assert!(error.to_string().contains("motor off"));
        }
        other => panic!("{other:?}"),
    }
    assert_eq!(line.rig().tick().volts, 0.0);
    assert!(recorder.finish().error.is_none());
    // The sample at which it happened is the log's last; its command is the 0 V that was sent.
    let log = furuta_log::read(&path).expect("own log");
    std::fs::remove_file(&path).expect("written above");
    let last = log.records.last().expect("records");
    assert!(
        last.t == 2.0 && last.alpha_dot.is_nan() && last.command == 0.0,
        "{last:?}"
    );
}

/// A disk that takes so many bytes.
struct SmallDisk {
    bytes: Cursor<Vec<u8>>,
    room: usize,
}

impl Write for SmallDisk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.bytes.get_ref().len() + bytes.len() > self.room {
            return Err(io::ErrorKind::StorageFull.into());
        }
        self.bytes.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for SmallDisk {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.bytes.seek(to)
    }
}

#[test]
fn a_full_disk_costs_the_log_and_not_the_run() {
    let disk = SmallDisk {
        bytes: Cursor::default(),
        room: 60_000,
    };
    let log = LogWriter::new(disk, &Metadata::default()).expect("room for the metadata");
    let (mut sender, recorder) = Recorder::start(log).expect("a thread");
    let (mut link, hello) = link(EmulatedTransport::new(emulated()));
    let summary = run(&mut link, &hello, &pilot(), &settings(10.0), &mut sender);
    drop(sender);
    assert!(matches!(summary.end, End::Finished), "{summary:?}");
    assert_eq!((summary.samples, summary.held), (5001, 0));
    assert!(
        summary
            .modes
            .last()
            .is_some_and(|m| m.mode == Mode::Balance)
    );
    let recorded = recorder.finish();
    assert!(
        recorded.records > 100 && recorded.records < 5001,
        "{recorded:?}"
    );
    match recorded.error {
        Some(error @ LogError::Write(_)) => assert!(error.to_string().contains("log"), "{error}"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_wrong_rig_on_the_port_is_refused() {
    let qube = Rig::builtin("qube-servo-2").expect("built in");
    let other = EmulatedRig::new(&qube, &Emulation::default()).expect("valid");
    let mut line = EmulatedTransport::new(emulated());
    let mut session = Session::connect(&mut line).expect("it answers");
    assert_eq!(session.mismatches(&srv02()), []);
    let mismatches = session.mismatches(&qube);
    assert!(
        mismatches.iter().any(|m| m.quantity == "name"),
        "{mismatches:?}"
    );
    // Refused, unless told otherwise; with all that differs, and what to do.
    assert_eq!(session.check(&srv02()), Ok(()));
    let refused = session.check(&qube).expect_err("another rig");
    assert_eq!(refused.mismatches, mismatches);
    let says = refused.to_string();
    for part in [
        "name = shahzad2022-srv02, its rig file qube-servo-2",
        "pendulum_counts_per_rev = 4096, its rig file 2048",
        "give the file of this rig",
        "--any-rig",
    ] {
        assert!(says.contains(part), "{says}");
    }
    // A repaired rig's file is still this rig's; one with other encoders is not, whatever its name.
    let mut repaired = Rig {
        name: "shahzad2022-srv02 (repaired)".into(),
        ..srv02()
    };
    assert_eq!(session.check(&repaired), Ok(()));
    repaired.sensors.arm_counts_per_rev *= -1.0;
    let refused = session.check(&repaired).expect_err("other encoders");
    assert_eq!(refused.mismatches.len(), 1);
    assert_eq!(refused.mismatches[0].quantity, "arm_counts_per_rev");
    // Exchanged between two runs: the second does not begin.
    let (summary, _) = session
        .run(&pilot(), &settings(0.2), None)
        .expect("no log to fail");
    assert!(matches!(summary.end, End::Finished));
    let mut line = Meanwhile {
        transport: line,
        reads: 0,
        at: 200,
        what: Some(move |t: &mut EmulatedTransport| *t.rig() = other),
    };
    let mut session = Session::connect(&mut line).expect("it answers");
    // The same run sees a reset, the next another rig.
    let (summary, _) = session
        .run(&pilot(), &settings(1.0), None)
        .expect("no log to fail");
    assert!(
        matches!(summary.error(), Some(RunError::RigReset { .. })),
        "{summary:?}"
    );
    match session.run(&pilot(), &settings(1.0), None) {
        Err(error @ SessionError::AnotherRig { .. }) => {
            assert!(error.to_string().contains("qube-servo-2"), "{error}");
        }
        other => panic!("{other:?}"),
    }
}

/// Half an hour of the rig's time, balancing, with every fault of the line and every record kept.
#[test]
fn soak_half_an_hour_of_random_faults() {
    const SECONDS: f64 = 1800.0;
    let rates = FaultRates {
        frame_lost: 0.01,
        delayed: 0.005,
        lost: 0.0005,
        flipped: 0.0005,
        doubled: 0.0005,
    };
    let mut line = FaultyTransport::new(EmulatedTransport::new(emulated()), rates, 14);
    let written = Arc::new(AtomicU64::new(0));
    let disk = Counted(Arc::clone(&written), Cursor::new(Vec::new()));
    let log = LogWriter::new(disk, &Metadata::default()).expect("memory");
    let (mut sender, recorder) = Recorder::start(log).expect("a thread");
    let (mut link, hello) = link(&mut line);
    let pilot = Watched {
        pilot: pilot(),
        limit: srv02().params.motor.command_limit,
        written,
    };
    let summary = run(&mut link, &hello, &pilot, &settings(SECONDS), &mut sender);
    drop(sender);
    let recorded = recorder.finish();
    println!("{summary:?}");
    assert!(matches!(summary.end, End::Finished), "{:?}", summary.end);
    assert!(summary.samples + summary.lost >= 900_000);
    assert!(
        summary.lost > 10_000 && summary.bad_frames > 10_000,
        "{summary:?}"
    );
    assert!(recorded.error.is_none());
    assert_eq!((recorded.records, summary.unlogged), (summary.samples, 0));
    // Up once and for good.
    assert!(summary.mode_changes <= 4, "{:?}", summary.modes);
    assert_eq!(summary.modes.last().map(|m| m.mode), Some(Mode::Balance));
}

/// A disk in memory that tells how much it has got.
struct Counted(Arc<AtomicU64>, Cursor<Vec<u8>>);

impl Write for Counted {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.fetch_add(bytes.len() as u64, Ordering::Relaxed);
        self.1.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Counted {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.1.seek(to)
    }
}

/// Sees that no command and no voltage is one that a motor must not get. A run that is two hundred times faster than real time waits for the log's writer now and then.
struct Watched {
    pilot: SwingUpBalance,
    limit: f64,
    written: Arc<AtomicU64>,
}

impl Pilot for Watched {
    type State = (<SwingUpBalance as Pilot>::State, u32, u64);

    fn start(&self) -> Self::State {
        (self.pilot.start(), 0, 0)
    }

    fn process(&self, state: &mut Self::State, m: &Measurement) -> furuta_hw::Decision {
        let (state, calls, before) = state;
        let decision = self.pilot.process(state, m);
        assert!(
            decision.volts.abs() <= self.limit && m.held.abs() <= self.limit,
            "t = {}",
            m.t
        );
        *calls += 1;
        if calls.is_multiple_of(4000) {
            // Until it has begun to write what came since, and has come to an end with it; the ring holds twice as many.
            let mut last = *before;
            for _ in 0..500 {
                std::thread::sleep(Duration::from_millis(10));
                let now = self.written.load(Ordering::Relaxed);
                if now != *before && now == last {
                    break;
                }
                last = now;
            }
            *before = last;
        }
        decision
    }
}
