//! The modes, and what the operator may ask for.

/// What the supervisor is doing.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Waiting; the motor is off.
    Idle,
    /// Pumping energy into the pendulum.
    SwingUp,
    /// Keeping it upright.
    Balance,
    /// The motor is off until everything rests.
    Stopping,
    /// A limit was passed: the arm is braked, for a quarter of a second at most, and then the motor is off. See
    /// [`Brake`](super::Brake).
    Braking,
    /// A limit was passed or a measurement was no number; the motor is off until [`Request::Reset`].
    Fault,
}

impl Mode {
    /// Its name in logs: `idle`, `swing-up`, `balance`, `stopping`, `braking`, `fault`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Idle => "idle",
            Self::SwingUp => "swing-up",
            Self::Balance => "balance",
            Self::Stopping => "stopping",
            Self::Braking => "braking",
            Self::Fault => "fault",
        }
    }
}

/// What the operator asks for.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Request {
    /// Swing up and balance.
    Start,
    /// Let go.
    Stop,
    /// Leave the fault.
    Reset,
}
