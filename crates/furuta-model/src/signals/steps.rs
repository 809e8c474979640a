//! Steps of changing height.

use super::error::{SignalError, seconds, volts};
use super::{hold_index, shown};
use core::fmt;

/// Steps between 0 and changing heights of both signs, whose mean is zero: large and small, so that friction and dead
/// zones show. The pattern of 16 heights repeats.
///
/// ```
/// use furuta_model::signals::Steps;
/// let steps = Steps::new(2.0, 0.5)?;
/// assert_eq!([0.0, 0.5, 1.0, 2.0, 8.0].map(|t| steps.volts(t)), [1.0, -1.0, 0.5, 2.0, 1.0]);
/// # Ok::<(), furuta_model::signals::SignalError>(())
/// ```
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Steps {
    amplitude: f64,
    hold: f64,
}

impl Steps {
    /// Name in one word.
    pub const NAME: &'static str = "steps";

    /// Heights in parts of the amplitude. Up and down in equal measure, so that a free arm does not wander off.
    const PATTERN: [f64; 16] = [
        0.5, -0.5, 0.25, -0.25, 1.0, -1.0, 0.0, 0.125, -0.125, 0.75, -0.75, -0.375, 0.375, -1.0,
        1.0, 0.0,
    ];

    /// Steps of up to `amplitude` (V), each held for `hold` seconds.
    ///
    /// # Errors
    /// An amplitude beyond 1000 V, a hold outside [1e-6, 1e6] s.
    pub fn new(amplitude: f64, hold: f64) -> Result<Self, SignalError> {
        Ok(Self {
            amplitude: volts(Self::NAME, "amplitude", amplitude)?,
            hold: seconds(Self::NAME, "hold", hold)?,
        })
    }

    /// Voltage (V) at time `t` (s).
    #[must_use]
    pub fn volts(&self, t: f64) -> f64 {
        // The cast saturates, and takes a NaN for 0: any t is fine.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let k = hold_index(t, self.hold) as u64;
        self.amplitude * Self::PATTERN[(k % 16) as usize]
    }

    /// How long each height is held (s).
    #[must_use]
    pub fn hold(&self) -> f64 {
        self.hold
    }
}

#[cfg(feature = "std")]
as_table!(Steps {
    amplitude: f64,
    hold: f64
});

impl fmt::Display for Steps {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (amplitude, hold) = (shown(self.amplitude), shown(self.hold));
        write!(f, "steps of up to {amplitude} V every {hold} s")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_mean_and_defined_everywhere() {
        let steps = Steps::new(4.0, 0.5).expect("valid");
        let sum: f64 = (0..16)
            .map(|k| steps.volts(0.25 + 0.5 * f64::from(k)))
            .sum();
        assert_eq!(sum, 0.0);
        assert_eq!(steps.volts(f64::INFINITY), steps.volts(1e300));
        assert_eq!(steps.volts(-1.0), steps.volts(0.0));
    }

    /// 0.03 / 0.01 is a little less than 3: the level must change there all the same.
    #[test]
    fn every_level_lasts_the_same_number_of_samples() {
        for (period, samples) in [(0.001, 10), (0.002, 5), (0.0001, 100)] {
            let steps = Steps::new(1.0, 0.01).expect("valid");
            for k in 0..100_000_u32 {
                let expected = Steps::PATTERN[(k / samples % 16) as usize];
                assert_eq!(steps.volts(f64::from(k) * period), expected, "{k} {period}");
            }
        }
    }
}
