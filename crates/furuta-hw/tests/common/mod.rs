//! What the tests share: a rig on a pseudo-terminal, a connection to it, and a simple pilot.
#![allow(dead_code)] // each test file uses a part

use std::time::Duration;

use furuta_ctrl::supervisor::Brake;
use furuta_hw::{
    Decision, EmulatedRig, Emulation, Link, LoopSettings, Measurement, Pace, Pilot, PtyRig,
    SerialTransport,
};
use furuta_log::Mode;
use furuta_model::{Limits, Rig};
use furuta_wire::Hello;

pub(crate) fn qube() -> Rig {
    Rig::builtin("qube-servo-2").expect("built in")
}

/// A rig that is switched on.
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
        ..LoopSettings::new(&qube(), 0.002, Duration::from_secs_f64(seconds))
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
