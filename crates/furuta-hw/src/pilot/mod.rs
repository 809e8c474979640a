//! What decides about the motor: one trait, so that the loop knows nothing of estimators and controllers.

mod open_loop;
mod reference;
mod rehearsal;
mod swing_up_balance;
mod task;

use furuta_ctrl::supervisor::Fault;
use furuta_log::Mode;

pub use open_loop::{OpenLoop, OpenLoopState};
pub use reference::Reference;
pub use rehearsal::rehearse;
pub use swing_up_balance::{SwingUpBalance, SwingUpBalanceState};
pub use task::{Task, TaskError};

/// What the loop knows at a sample.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Measurement {
    /// The rig's clock since the first sample of the run (s).
    pub t: f64,
    /// Periods since the previous sample: 1, or more where samples were lost. 1 at the first sample.
    pub periods: u32,
    /// Arm angle (rad).
    pub theta: f64,
    /// Pendulum angle from upright, not wrapped (rad).
    pub alpha: f64,
    /// Voltage that the rig holds from this sample to the next (V).
    pub held: f64,
}

/// What a pilot decides at a sample.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Decision {
    /// Motor voltage asked for; acts from the next sample on (V).
    pub volts: f64,
    /// Arm speed, estimated (rad/s).
    pub theta_dot: f64,
    /// Pendulum speed, estimated (rad/s).
    pub alpha_dot: f64,
    /// Arm angle asked for (rad).
    pub reference: f64,
    /// What the pilot is doing.
    pub mode: Mode,
    /// Why the pilot has switched the motor off for good, if it has.
    pub fault: Option<Fault>,
}

/// Estimator, supervisor and controller in one: from measurements to voltages. Settings are constant; what changes
/// from sample to sample is in the state. Must not allocate, lock or panic.
pub trait Pilot {
    /// What changes from sample to sample.
    type State;

    /// The state before the first sample.
    fn start(&self) -> Self::State;

    /// Decides at one sample.
    fn process(&self, state: &mut Self::State, measurement: &Measurement) -> Decision;
}
