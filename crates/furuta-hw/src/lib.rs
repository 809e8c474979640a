//! Rigs and the real-time loop.
//!
//! | Module | What |
//! |---|---|
//! | [`transport`] | ways to reach a rig: serial port; an emulated rig without a port; a wire with faults around another |
//! | [`link`] | messages in place of bytes |
//! | [`emulate`] | an emulated rig behind a pseudo-terminal |
//! | [`control_loop`] | the loop: sample in, command out, record into a ring |
//! | [`clock`] | whether the rig's time is time |
//! | [`pilot`] | what decides about the motor: open-loop tests, swing-up and balance |
//! | [`real_time`] | priority, locked memory, wake-ups on time |
//! | [`recorder`] | the log's writer, in a thread of its own |
//! | [`session`] | one run from port to log |
//! | [`identity`] | whether the rig on the port is the one of the rig file |
//! | [`provenance`] | what a log says about its run: all that it takes to do it again |
//! | [`mod@replay`] | a log through its own pilot again, compared bit for bit |

pub mod clock;
pub mod control_loop;
mod delay;
pub mod emulate;
pub mod identity;
pub mod link;
mod loop_settings;
pub mod pilot;
pub mod provenance;
pub mod real_time;
pub mod recorder;
pub mod replay;
mod rig_time;
mod run_error;
mod safety;
pub mod session;
mod summary;
pub mod transport;

pub use control_loop::run;
pub use emulate::{EmulatedRig, Emulation, EmulationError, Pace, PtyError, PtyRig};
pub use furuta_model::signals::Excitation;
pub use identity::{Mismatch, WrongRig};
pub use link::{Link, LinkError};
pub use loop_settings::LoopSettings;
pub use pilot::{
    Decision, Measurement, OpenLoop, Pilot, Reference, SwingUpBalance, Task, rehearse,
};
pub use real_time::{Granted, Held, Measure, Metronome, RealTime, WakeUp, measure_wake_up};
pub use recorder::{RecordSender, Recorded, Recorder};
pub use replay::{Replay, ReplayError, ReplayOptions, replay};
pub use rig_time::{Against, OldSample, RigClock};
pub use run_error::RunError;
pub use session::{Session, SessionError};
pub use summary::{End, ModeChange, Summary};
pub use transport::{
    EmulatedTransport, FaultRates, FaultyTransport, SerialTransport, Transport, TransportError,
};
