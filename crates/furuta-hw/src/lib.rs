//! Rigs and the real-time loop.
//!
//! | Module | What |
//! |---|---|
//! | [`transport`] | ways to reach a rig: serial port; an emulated rig without a port; a wire with faults around another |
//! | [`link`] | messages in place of bytes |
//! | [`emulate`] | an emulated rig behind a pseudo-terminal |
//! | [`control_loop`] | the loop: sample in, command out, record into a ring |
//! | [`pilot`] | what decides about the motor: open-loop tests, swing-up and balance |
//! | [`recorder`] | the log's writer, in a thread of its own |
//! | [`session`] | one run from port to log |

pub mod control_loop;
mod delay;
pub mod emulate;
pub mod link;
pub mod pilot;
pub mod recorder;
pub mod session;
pub mod transport;

pub use control_loop::{End, LoopSettings, ModeChange, RunError, Summary, run};
pub use emulate::{EmulatedRig, Emulation, EmulationError, Pace, PtyError, PtyRig};
pub use furuta_model::signals::Excitation;
pub use link::{Link, LinkError};
pub use pilot::{Decision, Measurement, OpenLoop, Pilot, Reference, SwingUpBalance, rehearse};
pub use recorder::{RecordSender, Recorded, Recorder};
pub use session::{Mismatch, Session, SessionError};
pub use transport::{
    EmulatedTransport, FaultRates, FaultyTransport, SerialTransport, Transport, TransportError,
};
