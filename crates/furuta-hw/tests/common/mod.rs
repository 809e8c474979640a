//! What the tests share: rigs, a connection, simple pilots, runs with and without a log.
#![allow(dead_code)] // each test file uses a part

use std::path::PathBuf;
use std::time::Duration;

use furuta_ctrl::supervisor::Brake;
use furuta_hw::{
    Decision, EmulatedRig, Emulation, Link, LoopSettings, Measurement, Pace, Pilot, PtyRig,
    RecordSender, Recorded, Recorder, Reference, RigClock, SerialTransport, Summary,
    SwingUpBalance, Transport, run,
};
use furuta_log::{Log, LogWriter, Metadata, Mode};
use furuta_model::{Limits, Rig};
use furuta_wire::Hello;

pub(crate) fn qube() -> Rig {
    Rig::builtin("qube-servo-2").expect("built in")
}

pub(crate) fn srv02() -> Rig {
    Rig::builtin("shahzad2022-srv02").expect("built in")
}

/// An SRV02 without a port.
pub(crate) fn emulated() -> EmulatedRig {
    EmulatedRig::new(&srv02(), &Emulation::default()).expect("valid")
}

/// Swings it up.
pub(crate) fn pilot() -> SwingUpBalance {
    SwingUpBalance::design(&srv02(), 0.002, Reference::Constant(0.0)).expect("stabilisable")
}

/// A QUBE on a port, switched on.
pub(crate) fn start(emulation: &Emulation, pace: Pace) -> PtyRig {
    let rig = EmulatedRig::new(&qube(), emulation).expect("valid");
    PtyRig::start(rig, pace).expect("a pseudo-terminal")
}

pub(crate) fn connect(rig: &PtyRig) -> (Link<SerialTransport>, Hello) {
    let port = SerialTransport::open(rig.path(), SerialTransport::BAUD).expect("the port is there");
    Link::connect(port, Duration::from_secs(10)).expect("the rig answers")
}

/// Of a run without limits.
pub(crate) fn settings(seconds: f64) -> LoopSettings<'static> {
    LoopSettings {
        limits: Limits::default(),
        brake: Brake::none(),
        silence: Duration::from_secs(5), // generous: other work shares the machine
        clock: RigClock::Emulated,       // whose time stands still for it
        ..LoopSettings::new(&qube(), 0.002, Duration::from_secs_f64(seconds))
    }
}

/// A run without a log.
pub(crate) fn unlogged<T: Transport, P: Pilot>(
    link: &mut Link<T>,
    hello: &Hello,
    pilot: &P,
    settings: &LoopSettings<'_>,
) -> Summary {
    run(link, hello, pilot, settings, &mut RecordSender::nowhere())
}

/// A run, what its log's writer says, and the log as it is read back.
pub(crate) fn logged<T: Transport, P: Pilot>(
    link: &mut Link<T>,
    hello: &Hello,
    pilot: &P,
    settings: &LoopSettings<'_>,
    name: &str,
) -> (Summary, Recorded, Log) {
    let file = TempLog::new(name);
    let log = LogWriter::create(&file.0, &Metadata::default()).expect("writable");
    let (mut sender, recorder) = Recorder::start(log).expect("a thread");
    let summary = run(link, hello, pilot, settings, &mut sender);
    drop(sender);
    let recorded = recorder.finish();
    (summary, recorded, file.read())
}

/// A log that is removed afterwards.
pub(crate) struct TempLog(pub(crate) PathBuf);

impl TempLog {
    pub(crate) fn new(name: &str) -> Self {
        let file = format!("furuta-hw-{name}-{}.mcap", std::process::id());
        Self(std::env::temp_dir().join(file))
    }

    pub(crate) fn read(&self) -> Log {
        furuta_log::read(&self.0).expect("own log")
    }
}

impl Drop for TempLog {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

/// Answers every sample with the same voltage.
pub(crate) struct Constant(pub(crate) f64);

impl Pilot for Constant {
    type State = ();

    fn start(&self) {}

    fn process(&self, (): &mut (), _: &Measurement) -> Decision {
        Decision {
            volts: self.0,
            theta_dot: 0.0,
            alpha_dot: 0.0,
            reference: 0.0,
            mode: Mode::Excite,
            fault: None,
        }
    }
}
