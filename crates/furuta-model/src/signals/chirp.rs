//! A sine of changing frequency.

use super::error::{SLOWEST, SignalError, frequency, seconds, volts};
use super::{shown, sin_cos_turns};
use core::fmt;

/// How the frequency changes.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Default)]
#[cfg_attr(
    feature = "std",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
pub enum Sweep {
    /// By the same number of hertz each second: equal energy in every hertz.
    #[default]
    Linear,
    /// By the same factor each second: equal energy in every octave.
    Logarithmic,
}

/// A sine whose frequency goes from one value to another; 0 V afterwards.
///
/// `u = A sin(2 pi n(t))`, with the number of turns `n` the integral of the frequency:
/// linear `n = f0 t + (f1 - f0) t^2 / (2 T)`; logarithmic `n = f0 T / ln(f1/f0) ((f1/f0)^(t/T) - 1)`.
///
/// ```
/// use furuta_model::signals::{Chirp, Sweep};
/// let chirp = Chirp::new(1.5, 8.0, 0.0, 10.0, Sweep::Linear)?;
/// assert_eq!(chirp.volts(0.0), 0.0);
/// assert!((chirp.volts(1.0 / 32.0) - 1.5).abs() < 1e-3); // a quarter turn at 8 Hz
/// assert_eq!(chirp.to_string(), "chirp of 1.5 V from 8 to 0 Hz in 10 s");
/// assert!(Chirp::new(1.5, 8.0, 0.0, 10.0, Sweep::Logarithmic).is_err()); // 0 Hz is never reached by factors
/// # Ok::<(), furuta_model::signals::SignalError>(())
/// ```
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Chirp {
    amplitude: f64,
    from: f64,
    to: f64,
    duration: f64,
    sweep: Sweep,
}

impl Chirp {
    /// Name in one word.
    pub const NAME: &'static str = "chirp";

    /// A sine of `amplitude` (V) from frequency `from` to `to` (Hz, either may be the higher) in `duration` seconds.
    ///
    /// # Errors
    /// An amplitude beyond 1000 V, a duration outside [1e-6, 1e6] s, a frequency outside [0, 1e5] Hz, below 1e-4 Hz
    /// where the sweep is logarithmic.
    pub fn new(
        amplitude: f64,
        from: f64,
        to: f64,
        duration: f64,
        sweep: Sweep,
    ) -> Result<Self, SignalError> {
        let lowest = match sweep {
            Sweep::Linear => 0.0,
            Sweep::Logarithmic => SLOWEST,
        };
        Ok(Self {
            amplitude: volts(Self::NAME, "amplitude", amplitude)?,
            from: frequency(Self::NAME, "from", from, lowest)?,
            to: frequency(Self::NAME, "to", to, lowest)?,
            duration: seconds(Self::NAME, "duration", duration)?,
            sweep,
        })
    }

    /// Voltage (V) at time `t` (s).
    #[must_use]
    pub fn volts(&self, t: f64) -> f64 {
        if t >= 0.0 && t <= self.duration {
            self.amplitude * sin_cos_turns(self.turns(t)).0
        } else {
            0.0
        }
    }

    /// Frequency (Hz) at time `t` (s).
    ///
    /// ```
    /// use furuta_model::signals::{Chirp, Sweep};
    /// let chirp = Chirp::new(1.0, 1.0, 4.0, 2.0, Sweep::Logarithmic)?;
    /// assert!((chirp.frequency(1.0) - 2.0).abs() < 1e-12);
    /// # Ok::<(), furuta_model::signals::SignalError>(())
    /// ```
    #[must_use]
    pub fn frequency(&self, t: f64) -> f64 {
        let part = t / self.duration;
        match self.sweep {
            Sweep::Linear => self.from + (self.to - self.from) * part,
            Sweep::Logarithmic => self.from * libm::exp(part * libm::log(self.to / self.from)),
        }
    }

    /// The highest frequency (Hz).
    #[must_use]
    pub fn highest(&self) -> f64 {
        self.from.max(self.to)
    }

    fn turns(&self, t: f64) -> f64 {
        match self.sweep {
            Sweep::Linear => self.from * t + (self.to - self.from) * t * t / (2.0 * self.duration),
            Sweep::Logarithmic if self.from == self.to => self.from * t,
            Sweep::Logarithmic => {
                let rate = libm::log(self.to / self.from) / self.duration;
                self.from * libm::expm1(rate * t) / rate
            }
        }
    }
}

#[cfg(feature = "std")]
as_table!(Chirp {
    amplitude: f64,
    from: f64,
    to: f64,
    duration: f64,
    sweep: Sweep
});

impl fmt::Display for Chirp {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, from, to, duration] =
            [self.amplitude, self.from, self.to, self.duration].map(shown);
        let kind = match self.sweep {
            Sweep::Linear => "chirp",
            Sweep::Logarithmic => "logarithmic chirp",
        };
        write!(f, "{kind} of {a} V from {from} to {to} Hz in {duration} s")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn sweeps_its_frequencies() {
        let chirp = Chirp::new(1.5, 10.0, 0.0, 10.0, Sweep::Linear).expect("valid");
        let signs = (0..100_000).map(|k| chirp.volts(f64::from(k) * 1e-4) > 0.0);
        let crossings = signs
            .clone()
            .zip(signs.skip(1))
            .filter(|(a, b)| a != b)
            .count();
        assert!(
            (99..=101).contains(&crossings),
            "5 Hz on average for 10 s are 100 zero crossings, not {crossings}"
        );
        assert_eq!(chirp.volts(10.1), 0.0);
    }

    proptest! {
        /// The frequency is the rate of the turns, whatever the sweep.
        #[test]
        fn frequency_is_the_rate_of_turns(
            from in 0.1..20.0_f64, to in 0.1..20.0_f64, t in 0.01..9.9_f64, logarithmic: bool,
        ) {
            let sweep = if logarithmic { Sweep::Logarithmic } else { Sweep::Linear };
            let chirp = Chirp::new(1.0, from, to, 10.0, sweep).expect("valid");
            let rate = (chirp.turns(t + 1e-4) - chirp.turns(t - 1e-4)) / 2e-4;
            // 200 turns in double precision over 2e-4 s, and the rate's own curvature
            prop_assert!((rate - chirp.frequency(t)).abs() < 1e-7, "{rate} {}", chirp.frequency(t));
        }
    }

    #[test]
    fn a_sweep_that_stands_still_is_a_sine() {
        for sweep in [Sweep::Linear, Sweep::Logarithmic] {
            let chirp = Chirp::new(1.0, 2.0, 2.0, 10.0, sweep).expect("valid");
            assert!((chirp.volts(3.125) - 1.0).abs() < 1e-12);
        }
    }
}
