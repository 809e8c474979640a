//! Keeps the arm near its middle while a test signal drives a rig for long.

use super::error::{SignalError, within};
use super::shown;
use crate::params::Coefficients;
use core::fmt;

const NAME: &str = "centring";

/// A pull towards the middle of the arm's range, beside a test signal: `u = e(t) - gain theta`.
///
/// An arm without a spring integrates every imbalance of the voltage and of its friction, and drifts into its stop. The
/// pull brings it back, slowly: an arm that has reached its speed returns with the time constant that is asked for.
/// That makes the rig part of a loop, so the command is no longer free of what the rig did; what is free is
/// [`Centring::reference`], the arm's angle that the pull lets the test signal ask for, which a log keeps for the joint
/// input-output estimate of a response. Fits in the time domain need nothing: they are given the command.
///
/// ```
/// use furuta_model::{Rig, signals::Centring};
/// let arm = Rig::builtin("qube-servo-2").expect("built in").params.coefficients();
/// let slow = Centring::returning(&arm, 4.0)?;
/// // One volt turns the arm by drive / damping radians a second; that is what the gain has to bring back within 4 s.
/// assert!((slow.gain() * 4.0 * arm.drive / arm.arm_damping - 1.0).abs() < 1e-12);
/// assert_eq!(slow.volts(0.5, 0.0), 0.5);
/// assert!(slow.volts(0.0, 0.3) < 0.0);
/// assert_eq!(slow.volts(0.5, slow.reference(0.5)), 0.0);
/// assert!(Centring::returning(&arm, 0.01).is_err());
/// # Ok::<(), furuta_model::signals::SignalError>(())
/// ```
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Centring {
    gain: f64,
}

#[cfg(feature = "std")]
as_table!(Centring { gain: f64 });

impl Centring {
    /// For an arm with these coefficients, back with this time constant (s).
    ///
    /// # Errors
    /// A time constant outside [0.1, 1000] s, or an arm whose voltage does not turn it or that nothing damps: no gain
    /// is in proportion to it.
    pub fn returning(arm: &Coefficients<f64>, seconds: f64) -> Result<Self, SignalError> {
        let seconds = within(NAME, "time constant", seconds, [0.1, 1000.0], "s")?;
        let per_volt = arm.drive / arm.arm_damping;
        let per_volt = within(NAME, "arm's speed", per_volt, [1e-6, 1e6], "rad/s per volt")?;
        Self::new(1.0 / (seconds * per_volt))
    }

    /// With this gain (V/rad).
    ///
    /// # Errors
    /// A gain outside [1e-9, 1e9] V/rad.
    pub fn new(gain: f64) -> Result<Self, SignalError> {
        let gain = within(NAME, "gain", gain, [1e-9, 1e9], "V/rad")?;
        Ok(Self { gain })
    }

    /// Volts per radian.
    #[must_use]
    pub const fn gain(&self) -> f64 {
        self.gain
    }

    /// The command (V) where the test signal asks for `excitation` (V) and the arm is at `theta` (rad).
    #[must_use]
    pub fn volts(&self, excitation: f64, theta: f64) -> f64 {
        excitation - self.gain * theta
    }

    /// Where the arm would have to be for the command to be 0 (rad): the test signal in the arm's unit.
    #[must_use]
    pub fn reference(&self, excitation: f64) -> f64 {
        excitation / self.gain
    }
}

/// In words, with its unit.
impl fmt::Display for Centring {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "the arm pulled to its middle by {} V/rad",
            shown(self.gain)
        )
    }
}
