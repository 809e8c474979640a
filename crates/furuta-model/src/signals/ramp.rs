//! A straight line.

use super::error::{SignalError, seconds, volts};
use super::shown;
use core::fmt;

/// From one voltage to another at a steady rate, then held: a slow one shows at which voltage the arm breaks away.
///
/// ```
/// use furuta_model::signals::Ramp;
/// let ramp = Ramp::new(-1.0, 1.0, 4.0)?;
/// assert_eq!([-1.0, 0.0, 1.0, 3.0, 4.0, 5.0].map(|t| ramp.volts(t)), [-1.0, -1.0, -0.5, 0.5, 1.0, 1.0]);
/// assert_eq!(ramp.to_string(), "ramp from -1 to 1 V in 4 s");
/// # Ok::<(), furuta_model::signals::SignalError>(())
/// ```
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Ramp {
    from: f64,
    to: f64,
    duration: f64,
}

impl Ramp {
    /// Name in one word.
    pub const NAME: &'static str = "ramp";

    /// From `from` to `to` (V) in `duration` seconds.
    ///
    /// # Errors
    /// A voltage beyond 1000 V, a duration outside [1e-6, 1e6] s.
    pub fn new(from: f64, to: f64, duration: f64) -> Result<Self, SignalError> {
        Ok(Self {
            from: volts(Self::NAME, "from", from)?,
            to: volts(Self::NAME, "to", to)?,
            duration: seconds(Self::NAME, "duration", duration)?,
        })
    }

    /// Voltage (V) at time `t` (s).
    #[must_use]
    pub fn volts(&self, t: f64) -> f64 {
        let part = (t / self.duration).clamp(0.0, 1.0);
        // Exact at both ends.
        self.from * (1.0 - part) + self.to * part
    }
}

#[cfg(feature = "std")]
as_table!(Ramp {
    from: f64,
    to: f64,
    duration: f64
});

impl fmt::Display for Ramp {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [from, to, duration] = [self.from, self.to, self.duration].map(shown);
        write!(f, "ramp from {from} to {to} V in {duration} s")
    }
}
