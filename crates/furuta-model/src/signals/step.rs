//! One step.

use super::error::{SignalError, volts, within};
use super::{EARLY, shown};
use core::fmt;

/// 0 V before `start`, `amplitude` from then on.
///
/// ```
/// use furuta_model::signals::Step;
/// let step = Step::new(-1.5, 2.0)?;
/// assert_eq!([1.999, 2.0, 1e9].map(|t| step.volts(t)), [0.0, -1.5, -1.5]);
/// assert_eq!(step.to_string(), "step of -1.5 V after 2 s");
/// # Ok::<(), furuta_model::signals::SignalError>(())
/// ```
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Step {
    amplitude: f64,
    start: f64,
}

impl Step {
    /// Name in one word.
    pub const NAME: &'static str = "step";

    /// A step to `amplitude` (V) at time `start` (s).
    ///
    /// # Errors
    /// An amplitude beyond 1000 V, a start outside [0, 1e6] s.
    pub fn new(amplitude: f64, start: f64) -> Result<Self, SignalError> {
        Ok(Self {
            amplitude: volts(Self::NAME, "amplitude", amplitude)?,
            start: within(Self::NAME, "start", start, [0.0, 1e6], "s")?,
        })
    }

    /// Voltage (V) at time `t` (s).
    #[must_use]
    pub fn volts(&self, t: f64) -> f64 {
        // A sample meant to be at the step can be some bits before it.
        if t >= self.start * (1.0 - EARLY * EARLY) {
            self.amplitude
        } else {
            0.0
        }
    }
}

#[cfg(feature = "std")]
as_table!(Step {
    amplitude: f64,
    start: f64
});

impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "step of {} V", shown(self.amplitude))?;
        if self.start > 0.0 {
            write!(f, " after {} s", shown(self.start))?;
        }
        Ok(())
    }
}
