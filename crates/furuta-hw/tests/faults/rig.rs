//! A rig that is unplugged, reset or exchanged, or whose clock steps.

use std::time::{Duration, Instant};

use furuta_hw::{
    EmulatedRig, EmulatedTransport, Emulation, End, Pace, PtyRig, RunError, SerialTransport,
    Session, SessionError, Transport, TransportError,
};
use furuta_model::Rig;

use super::clock::Altered;
use super::common::{emulated, pilot, settings, srv02, unlogged};
use super::link;

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

/// A transport that does something to the rig at a time of the test's choosing: after a number of reads.
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

    fn now(&self) -> Instant {
        self.transport.now()
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
    let summary = unlogged(&mut link, &hello, &pilot(), &settings(60.0));
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

/// The host's own clock is monotonic: what an administrator or NTP does to the time of day is not seen by the loop. The
/// rig's clock is what can step.
#[test]
fn a_clock_that_steps_ends_the_run() {
    for by_us in [3_600_000_000, -700_000] {
        let line = Altered::new(emulated(), move |k, mut sample| {
            if k >= 500 {
                sample.t_us = sample.t_us.saturating_add_signed(by_us);
            }
            Some(sample)
        });
        let (mut link, hello) = link(line);
        let summary = unlogged(&mut link, &hello, &pilot(), &settings(60.0));
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
