//! One sample of a run.

use serde::{Deserialize, Serialize};

use crate::number;

/// One sample of a run, as logged. SI units, radians; `alpha` is measured from upright. JSON has no NaN: it is written
/// as null and read back as NaN; infinities are the strings `"Infinity"` and `"-Infinity"`.
#[derive(Copy, Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// The rig's clock since the first sample of the run (s).
    #[serde(with = "number")]
    pub t: f64,
    /// Motor voltage held by the rig from this sample to the next (V).
    #[serde(with = "number")]
    pub u: f64,
    /// Arm angle, measured (rad).
    #[serde(with = "number")]
    pub theta: f64,
    /// Pendulum angle from upright, measured, not wrapped (rad).
    #[serde(with = "number")]
    pub alpha: f64,
    /// Arm speed, estimated (rad/s).
    #[serde(with = "number")]
    pub theta_dot: f64,
    /// Pendulum speed, estimated (rad/s).
    #[serde(with = "number")]
    pub alpha_dot: f64,
    /// Arm angle asked for (rad).
    #[serde(with = "number")]
    pub reference: f64,
    /// Motor voltage the host answered this sample with (V); acts from the next sample on.
    #[serde(with = "number")]
    pub command: f64,
    /// What the host was doing.
    pub mode: Mode,
    /// The rig's number of this sample.
    pub seq: u32,
    /// The rig's status flags (see the wire protocol).
    pub status: u8,
    /// Samples lost on the line just before this one.
    pub lost: u32,
    /// How much later this sample arrived than the promptest one of the run, rig's clock against host's (s).
    #[serde(with = "number")]
    pub delay: f64,
    /// Host's time from the sample's arrival to the command's departure (s).
    #[serde(with = "number")]
    pub compute: f64,
}

/// What the host was doing at a sample.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// Motor off.
    #[default]
    Off,
    /// An open-loop test signal.
    Excite,
    /// Pumping energy into the pendulum.
    SwingUp,
    /// Holding the pendulum upright.
    Balance,
    /// Braking the arm after a limit, before the motor is switched off.
    Brake,
}

impl Mode {
    /// Every mode, in the order of a run.
    pub const ALL: [Self; 5] = [
        Self::Off,
        Self::Excite,
        Self::SwingUp,
        Self::Balance,
        Self::Brake,
    ];

    /// The mode's name in the log.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Excite => "excite",
            Self::SwingUp => "swing-up",
            Self::Balance => "balance",
            Self::Brake => "brake",
        }
    }
}

impl std::fmt::Display for Mode {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}
