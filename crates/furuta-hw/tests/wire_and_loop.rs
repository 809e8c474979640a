//! The loop against an emulated rig through a real pseudo-terminal: what is counted, what ends a run, what the rig
//! does meanwhile.

mod common;

use std::f64::consts::PI;
use std::io::Write;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::{Duration, Instant};

use common::{Constant, connect, qube, settings, start};
use furuta_hw::{
    Decision, Emulation, End, FaultRates, FaultyTransport, Link, LinkError, LoopSettings,
    Measurement, Pace, Pilot, RecordSender, Recorder, RunError, SerialTransport, TransportError,
    run,
};
use furuta_log::{LogWriter, Metadata, Mode};
use furuta_model::{Limits, State};
use furuta_wire::{Message, Sample, Status};

#[test]
fn hello_is_the_rig_file() {
    let rig = start(&Emulation::default(), Pace::RealTime);
    let (_, hello) = connect(&rig);
    assert_eq!(
        (hello.rig.as_str(), hello.period_us),
        ("qube-servo-2", 2000)
    );
    assert_eq!(
        (hello.arm_counts_per_rev, hello.pendulum_counts_per_rev),
        (2048.0, 2048.0)
    );
    assert_eq!(hello.command_limit, 10.0);
}

#[test]
fn every_sample_is_answered_one_period_later() {
    let rig = start(&Emulation::default(), Pace::HostLed);
    let (mut link, hello) = connect(&rig);
    let path = tempfile("answered");
    let (mut sender, recorder) =
        Recorder::start(LogWriter::create(&path, &Metadata::default()).expect("writable"))
            .expect("a thread");
    let summary = run(&mut link, &hello, &Sawtooth, &settings(2.0), &mut sender);
    drop(sender);
    assert!(matches!(summary.end, End::Finished), "{:?}", summary.end);
    assert_eq!(
        (
            summary.samples,
            summary.lost,
            summary.held,
            summary.bad_frames
        ),
        (1001, 0, 0, 0)
    );
    assert_eq!(recorder.finish().records, 1001);
    let log = furuta_log::read(&path).expect("own log");
    assert_eq!((log.records.len(), log.notice), (1001, None));
    for pair in log.records.windows(2) {
        assert_eq!(pair[1].seq, pair[0].seq + 1);
        // f32 on the wire.
        assert_eq!(pair[1].u, f64::from(pair[0].command as f32));
    }
    std::fs::remove_file(path).expect("written above");
}

/// Answers with a voltage that tells the samples apart.
struct Sawtooth;

impl Pilot for Sawtooth {
    type State = u32;

    fn start(&self) -> u32 {
        0
    }

    fn process(&self, k: &mut u32, _: &Measurement) -> Decision {
        *k += 1;
        let volts = 1e-3 * f64::from(*k % 100);
        Decision {
            volts,
            theta_dot: 0.0,
            alpha_dot: 0.0,
            reference: 0.0,
            mode: Mode::Excite,
            fault: None,
        }
    }
}

#[test]
fn a_free_run_in_real_time_keeps_the_rigs_period() {
    let rig = start(&Emulation::default(), Pace::RealTime);
    let (mut link, hello) = connect(&rig);
    let begin = Instant::now();
    let summary = run(
        &mut link,
        &hello,
        &Constant(0.0),
        &settings(1.0),
        &mut RecordSender::nowhere(),
    );
    assert!(matches!(summary.end, End::Finished), "{:?}", summary.end);
    // Never faster than the clock; how much slower depends on what else the machine does.
    assert!(
        begin.elapsed() > Duration::from_millis(950),
        "{:?}",
        begin.elapsed()
    );
    assert_eq!(summary.samples + summary.lost, 501);
}

#[test]
fn a_missing_port_is_named() {
    let error =
        SerialTransport::open("/dev/no-such-port", SerialTransport::BAUD).expect_err("not there");
    assert!(
        matches!(error, TransportError::NoSuchPort { .. }),
        "{error:?}"
    );
    assert!(
        error.to_string().contains("/dev/no-such-port")
            && error.to_string().contains("plug the rig in")
    );
    // There, but no serial port.
    let error = SerialTransport::open("/dev/null", SerialTransport::BAUD).expect_err("no port");
    assert!(matches!(error, TransportError::Refused { .. }), "{error:?}");
}

#[test]
fn a_port_in_use_is_refused() {
    let rig = start(&Emulation::default(), Pace::RealTime);
    let _first = connect(&rig);
    let error = SerialTransport::open(rig.path(), SerialTransport::BAUD).expect_err("taken");
    assert!(matches!(error, TransportError::Refused { .. }), "{error:?}");
}

#[test]
fn silence_and_chatter_are_no_hello() {
    for chatter in [&b""[..], b"Arduino ready\r\n\0"] {
        let (mut device, port) = serialport::TTYPort::pair().expect("a pseudo-terminal");
        let name = serialport::SerialPort::name(&port).expect("named");
        let host = SerialTransport::open(&name, SerialTransport::BAUD).expect("there");
        let talker = std::thread::spawn(move || {
            for _ in 0..20 {
                device.write_all(chatter).expect("taken");
                std::thread::sleep(Duration::from_millis(20));
            }
            device
        });
        match Link::connect(host, Duration::from_millis(300)) {
            Err(LinkError::NoHello {
                bytes, bad_frames, ..
            }) => {
                assert_eq!(
                    (bytes > 0, bad_frames > 0),
                    (!chatter.is_empty(), !chatter.is_empty())
                );
            }
            other => panic!("{other:?}"),
        }
        talker.join().expect("no panic");
    }
}

#[test]
fn another_protocol_version_is_named() {
    let (mut device, port) = serialport::TTYPort::pair().expect("a pseudo-terminal");
    let name = serialport::SerialPort::name(&port).expect("named");
    let host = SerialTransport::open(&name, SerialTransport::BAUD).expect("there");
    let talker = std::thread::spawn(move || {
        // Any frame of version 9 whose first field is the version: a Query will do.
        let message = Message::Query(furuta_wire::Query { version: 9 });
        let mut buffer = [0; furuta_wire::MAX_FRAME];
        let frame = furuta_wire::encode(&message, &mut buffer).expect("fits");
        for _ in 0..100 {
            device.write_all(frame).expect("taken");
            std::thread::sleep(Duration::from_millis(20));
        }
    });
    match Link::connect(host, Duration::from_secs(5)) {
        Err(error @ LinkError::Version { found: 9 }) => {
            assert!(error.to_string().contains("version 9"))
        }
        other => panic!("{other:?}"),
    }
    talker.join().expect("no panic");
}

#[test]
fn unplugged_mid_run_keeps_the_log() {
    let rig = start(&Emulation::default(), Pace::RealTime);
    let (mut link, hello) = connect(&rig);
    let path = tempfile("unplugged");
    let (mut sender, recorder) =
        Recorder::start(LogWriter::create(&path, &Metadata::default()).expect("writable"))
            .expect("a thread");
    let seen = AtomicU32::new(0);
    let summary = std::thread::scope(|scope| {
        let (seen, hand) = (&seen, rig);
        scope.spawn(move || {
            while seen.load(Ordering::Relaxed) < 200 {
                std::thread::sleep(Duration::from_millis(1));
            }
            hand.unplug();
        });
        run(
            &mut link,
            &hello,
            &Counting(seen),
            &settings(60.0),
            &mut sender,
        )
    });
    drop(sender);
    let error = summary.error().expect("the cable was pulled");
    assert!(
        matches!(error, RunError::Transport(TransportError::Unplugged { .. })),
        "{error:?}"
    );
    assert!(error.to_string().contains("unplugged"));
    let recorded = recorder.finish();
    assert!(
        recorded.error.is_none() && recorded.records == summary.samples && summary.samples >= 200
    );
    let log = furuta_log::read(&path).expect("own log");
    assert_eq!(
        (log.records.len() as u64, log.notice),
        (summary.samples, None)
    );
    std::fs::remove_file(path).expect("written above");
}

struct Counting<'a>(&'a AtomicU32);

impl Pilot for Counting<'_> {
    type State = ();

    fn start(&self) {}

    fn process(&self, (): &mut (), m: &Measurement) -> Decision {
        self.0.fetch_add(1, Ordering::Relaxed);
        Constant(0.1).process(&mut (), m)
    }
}

#[test]
fn a_rig_that_falls_silent_ends_the_run() {
    let (device, port) = serialport::TTYPort::pair().expect("a pseudo-terminal");
    let name = serialport::SerialPort::name(&port).expect("named");
    let mut host = SerialTransport::open(&name, SerialTransport::BAUD).expect("there");
    let hello = connect(&start(&Emulation::default(), Pace::RealTime)).1;
    let settings = LoopSettings {
        silence: Duration::from_millis(100),
        ..settings(60.0)
    };
    let mut link = Link::new(&mut host);
    let summary = run(
        &mut link,
        &hello,
        &Constant(1.0),
        &settings,
        &mut RecordSender::nowhere(),
    );
    match summary.error() {
        Some(RunError::Silent { samples: 0, waited }) => {
            assert!(*waited >= Duration::from_millis(100))
        }
        other => panic!("{other:?}"),
    }
    drop(device);
}

/// After a run, however it ends, the rig holds 0 V; and it does not need the host for that.
#[test]
fn the_last_word_is_zero_volts() {
    for (pilot, name) in [(Faulty::Nan, "command"), (Faulty::Runaway, "arm angle")] {
        let rig = start(
            &Emulation {
                watchdog_periods: u16::MAX,
                ..Emulation::default()
            },
            Pace::RealTime,
        );
        let (mut link, hello) = connect(&rig);
        let limits = Limits {
            arm_angle: Some(1.0),
            ..Limits::default()
        };
        let settings = LoopSettings {
            limits,
            ..settings(60.0)
        };
        let summary = run(
            &mut link,
            &hello,
            &pilot,
            &settings,
            &mut RecordSender::nowhere(),
        );
        match summary.error() {
            Some(RunError::NotFinite { quantity, .. } | RunError::Limit { quantity, .. }) => {
                assert_eq!(*quantity, name)
            }
            other => panic!("{other:?}"),
        }
        assert_eq!(held_after_a_while(&mut link), 0.0);
    }
}

#[test]
fn a_panicking_pilot_leaves_zero_volts() {
    let rig = start(
        &Emulation {
            watchdog_periods: u16::MAX,
            ..Emulation::default()
        },
        Pace::RealTime,
    );
    let (mut link, hello) = connect(&rig);
    let panicked = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
        run(
            &mut link,
            &hello,
            &Faulty::Panic,
            &settings(60.0),
            &mut RecordSender::nowhere(),
        )
    }));
    assert!(panicked.is_err());
    assert_eq!(held_after_a_while(&mut link), 0.0);
}

enum Faulty {
    Nan,
    Runaway,
    Panic,
}

impl Pilot for Faulty {
    type State = ();

    fn start(&self) {}

    fn process(&self, (): &mut (), m: &Measurement) -> Decision {
        let volts = match self {
            Self::Nan if m.t > 0.1 => f64::NAN,
            Self::Panic if m.t > 0.1 => panic!("meant"),
            Self::Nan | Self::Panic | Self::Runaway => 5.0,
        };
        Decision {
            volts,
            ..Constant(0.0).process(&mut (), m)
        }
    }
}

/// Voltage in the samples that come 100 ms from now.
fn held_after_a_while(link: &mut Link<SerialTransport>) -> f32 {
    let after = Instant::now() + Duration::from_millis(100);
    let deadline = after + Duration::from_secs(5);
    loop {
        match link.receive(deadline).expect("still there") {
            Some(Message::Sample(sample)) if Instant::now() > after => break sample.volts,
            Some(_) => {}
            None => panic!("the rig is silent"),
        }
    }
}

#[test]
fn a_silent_host_trips_the_rigs_watchdog() {
    let rig = start(&Emulation::default(), Pace::RealTime);
    let (mut link, _) = connect(&rig);
    let deadline = Instant::now() + Duration::from_secs(10);
    link.command(0, 2.0).expect("there");
    let mut driven = 0;
    loop {
        match link.receive(deadline).expect("still there") {
            Some(Message::Sample(sample)) if sample.volts == 2.0 => driven += 1,
            Some(Message::Sample(sample)) if driven > 0 => {
                assert!(sample.volts == 0.0 && sample.status.contains(Status::WATCHDOG));
                break;
            }
            Some(_) => {}
            None => panic!("the watchdog did nothing"),
        }
    }
    // The command's own period and those before the watchdog trips: never longer, however slow this machine is.
    assert_eq!(driven, 10);
}

/// A host slower than the rig's clock: a patient rig waits for it and misses nothing; once it is silent, the watchdog
/// trips as ever.
#[test]
fn a_patient_rig_waits_for_a_slow_host() {
    let rig = start(&Emulation::default(), Pace::Patient);
    let (mut link, _) = connect(&rig);
    // What came before anybody answered is read first.
    let mut statuses = Vec::new();
    let mut sample = next_sample(&mut link);
    for _ in 0..400 {
        let slow = statuses.len() > 100; // prompt at first, so as to catch up
        std::thread::sleep(Duration::from_millis(if slow { 7 } else { 0 }));
        link.command(sample.seq, 1.0).expect("there");
        sample = next_sample(&mut link);
        statuses.push((sample.volts, sample.status));
    }
    assert!(
        statuses[110..].iter().all(|s| *s == (1.0, Status::OK)),
        "{statuses:?}"
    );
    let begin = Instant::now();
    while !sample.status.contains(Status::WATCHDOG) {
        assert!(begin.elapsed() < Duration::from_secs(5), "no watchdog");
        sample = next_sample(&mut link);
    }
}

fn next_sample(link: &mut Link<SerialTransport>) -> Sample {
    match link.receive(Instant::now() + Duration::from_secs(5)) {
        Ok(Some(Message::Sample(sample))) => sample,
        other => panic!("{other:?}"),
    }
}

#[test]
fn the_stop_flag_ends_a_run() {
    let rig = start(&Emulation::default(), Pace::RealTime);
    let (mut link, hello) = connect(&rig);
    let stop = AtomicBool::new(true);
    let settings = LoopSettings {
        stop: Some(&stop),
        ..settings(60.0)
    };
    let summary = run(
        &mut link,
        &hello,
        &Constant(0.0),
        &settings,
        &mut RecordSender::nowhere(),
    );
    assert!(matches!(summary.end, End::Stopped));
    assert_eq!(summary.samples, 1);
}

/// What comes through encoders, wire and loop is the model's own trajectory.
#[test]
fn measured_angles_are_the_models() {
    let start_state = State::new(0.0, PI - 0.5, 0.0, 0.0);
    let rig = start(
        &Emulation {
            start: start_state,
            ..Emulation::default()
        },
        Pace::HostLed,
    );
    let (mut link, hello) = connect(&rig);
    let path = tempfile("model");
    let (mut sender, recorder) =
        Recorder::start(LogWriter::create(&path, &Metadata::default()).expect("writable"))
            .expect("a thread");
    run(
        &mut link,
        &hello,
        &Constant(0.7),
        &settings(1.0),
        &mut sender,
    );
    drop(sender);
    assert!(recorder.finish().error.is_none());
    let log = furuta_log::read(&path).expect("own log");
    std::fs::remove_file(path).expect("written above");

    let plant = qube().plant::<f64>();
    let mut x = plant.rest(start_state);
    let mut period = |u: f64| {
        for _ in 0..20 {
            plant.step(&mut x, u, 1e-4); // ten times finer than the emulation's own steps
        }
        x.x
    };
    // The rig has ticked a few times before the run's first sample: it swung freely from its start.
    let mut model = (0..log.records[0].seq).fold(start_state, |_, _| period(0.0));
    let count = std::f64::consts::TAU / 2048.0;
    for record in &log.records {
        let (e, f) = (record.theta - model.theta, record.alpha - model.alpha);
        // Half a count of rounding, and a tenth for the integrators' difference.
        assert!(
            e.abs() < 0.6 * count && f.abs() < 0.6 * count,
            "t = {}: {e} {f}",
            record.t
        );
        model = period(record.u);
    }
    assert_eq!((log.records.len(), log.notice), (501, None));
}

fn tempfile(name: &str) -> std::path::PathBuf {
    std::env::temp_dir().join(format!("furuta-hw-{name}-{}.mcap", std::process::id()))
}

/// A wire that damages about one frame in ten: what is lost is counted, nothing wrong is believed, the run goes on.
#[test]
fn a_faulty_wire_is_survived_and_counted() {
    // Frames have some 20 bytes each way.
    let rates = FaultRates {
        lost: 0.002,
        flipped: 0.002,
        doubled: 0.001,
        ..FaultRates::default()
    };
    let rig = start(&Emulation::default(), Pace::RealTime);
    let port = SerialTransport::open(rig.path(), SerialTransport::BAUD).expect("the port is there");
    let mut wire = FaultyTransport::new(port, rates, 1);
    let (mut link, hello) =
        Link::connect(&mut wire, Duration::from_secs(10)).expect("asked until it answers");
    let summary = run(
        &mut link,
        &hello,
        &Constant(0.5),
        &settings(3.0),
        &mut RecordSender::nowhere(),
    );
    assert!(matches!(summary.end, End::Finished), "{:?}", summary.end);
    // Lost samples, and at the end perhaps some beyond the duration.
    assert!(summary.samples + summary.lost >= 1501, "{summary:?}");
    assert!((50..500).contains(&summary.lost), "{summary:?}");
    assert!(
        summary.bad_frames >= summary.lost / 2 && summary.held > 50,
        "{summary:?}"
    );
    assert!(wire.damaged() > 100);
}
