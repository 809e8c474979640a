//! What ends a run, and what the rig then holds.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::{Duration, Instant};

use furuta_hw::{
    Decision, Emulation, End, Link, LoopSettings, Measurement, Pace, Pilot, RunError,
    SerialTransport, TransportError,
};
use furuta_model::Limits;
use furuta_wire::Message;

use super::common::{Constant, connect, logged, settings, start, unlogged};

#[test]
fn unplugged_mid_run_keeps_the_log() {
    let rig = start(&Emulation::default(), Pace::RealTime);
    let (mut link, hello) = connect(&rig);
    let seen = AtomicU32::new(0);
    let (summary, recorded, log) = std::thread::scope(|scope| {
        let (seen, hand) = (&seen, rig);
        scope.spawn(move || {
            while seen.load(Ordering::Relaxed) < 200 {
                std::thread::sleep(Duration::from_millis(1));
            }
            hand.unplug();
        });
        let pilot = Counting(seen);
        logged(&mut link, &hello, &pilot, &settings(60.0), "unplugged")
    });
    let error = summary.error().expect("the cable was pulled");
    assert!(
        matches!(error, RunError::Transport(TransportError::Unplugged { .. })),
        "{error:?}"
    );
    assert!(error.to_string().contains("unplugged"));
    assert!(
        recorded.error.is_none() && recorded.records == summary.samples && summary.samples >= 200
    );
    assert_eq!(
        (log.records.len() as u64, log.notice),
        (summary.samples, None)
    );
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
    let summary = unlogged(&mut link, &hello, &Constant(1.0), &settings);
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
        let summary = unlogged(&mut link, &hello, &pilot, &settings);
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
        unlogged(&mut link, &hello, &Faulty::Panic, &settings(60.0))
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
fn the_stop_flag_ends_a_run() {
    let rig = start(&Emulation::default(), Pace::RealTime);
    let (mut link, hello) = connect(&rig);
    let stop = AtomicBool::new(true);
    let settings = LoopSettings {
        stop: Some(&stop),
        ..settings(60.0)
    };
    let summary = unlogged(&mut link, &hello, &Constant(0.0), &settings);
    assert!(matches!(summary.end, End::Stopped));
    assert_eq!(summary.samples, 1);
}
