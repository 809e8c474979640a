//! Band-limited white noise.

use super::error::{SLOWEST, SignalError, frequency, size};
use super::random::normal;
use super::{fraction, shown};
use crate::trig::sin_cos_f64;
use core::f64::consts::{PI, TAU};
use core::fmt;

/// Gaussian noise with a flat spectrum between two frequencies and nothing outside.
///
/// Independent random numbers `w_j`, one each `1/(3 high)` seconds, are interpolated by a band-pass kernel of finite
/// length: `u(t) = g sum_j w_j h(t - j T)`, `h(x) = (sin(2 pi high x) - sin(2 pi low x)) / (pi x)` under a Hann window,
/// `g` such that the mean square over all seeds is `rms^2`. The numbers come from seed and `j` alone
/// ([`super::random`]), so the noise is a function of time: it never repeats, and sampled twice as fast it is the same
/// noise. The edges of the band are the points of half the voltage, around which it falls to nothing within half of
/// `low` and a tenth of `high` on either side.
///
/// Peaks of four times the RMS happen; [`super::Excitation::limited`] clips them.
///
/// ```
/// use furuta_model::signals::Noise;
/// let noise = Noise::new(0.5, 0.5, 8.0, 1)?;
/// let n = 20_000;
/// let power = (0..n).map(|k| noise.volts(f64::from(k) * 0.01).powi(2)).sum::<f64>() / f64::from(n);
/// assert!((power.sqrt() - 0.5).abs() < 0.02); // 200 s of 7.5 Hz: its standard deviation is 0.0065
/// assert_eq!(noise.to_string(), "noise from 0.5 to 8 Hz, 0.5 V RMS, seed 1");
/// # Ok::<(), furuta_model::signals::SignalError>(())
/// ```
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Noise {
    rms: f64,
    low: f64,
    high: f64,
    seed: u64,
    /// Half the kernel's length, in clock periods.
    reach: f64,
    /// `g`, with the kernel's factor `1/T` taken out.
    gain: f64,
}

/// Clock periods in a period of the highest frequency: a little more than two would do, if the kernel's edge were
/// sharp.
const CLOCKS: f64 = 3.0;
/// Half the kernel's length in periods of the highest frequency: the upper edge is then a tenth of it wide on either
/// side.
const UPPER_EDGE: f64 = 8.0;
/// Half the kernel's length in periods of the lowest frequency: the lower edge is then half of it wide on either side.
const LOWER_EDGE: f64 = 1.6;
/// The widest band, `high / low`, where `low` is not 0: the kernel grows with it, to a thousand numbers.
const WIDEST: f64 = 100.0;

impl Noise {
    /// Name in one word.
    pub const NAME: &'static str = "noise";

    /// Noise of root mean square `rms` (V) between `low` and `high` (Hz); `low` may be 0, but then the arm wanders.
    ///
    /// # Errors
    /// An RMS outside [0, 1000] V; `high` outside [1e-4, 1e5] Hz; `low` neither 0 nor within a factor 100 of `high`, or
    /// above 0.8 of it (the edges would overlap).
    pub fn new(rms: f64, low: f64, high: f64, seed: u64) -> Result<Self, SignalError> {
        let rms = size(Self::NAME, "rms", rms)?;
        let high = frequency(Self::NAME, "high", high, SLOWEST)?;
        let narrow = low != 0.0; // not a number: refused by the range below
        if narrow && !(low >= high / WIDEST && low <= 0.8 * high) {
            return Err(SignalError::OutOfRange {
                signal: Self::NAME,
                parameter: "low",
                value: low,
                min: high / WIDEST,
                max: 0.8 * high,
                unit: "Hz (or 0)",
            });
        }
        let mut reach = UPPER_EDGE * CLOCKS;
        if narrow {
            reach = reach.max(LOWER_EDGE * CLOCKS * high / low);
        }
        let mut noise = Self {
            rms,
            low,
            high,
            seed,
            reach,
            gain: 1.0,
        };
        // Independent numbers of variance 1: the sum of the squared weights is the variance. It does not depend on t,
        // since no two images of the band overlap.
        let mut power = 0.0;
        noise.weigh(0.0, |_, weight| power += weight * weight);
        noise.gain = rms / libm::sqrt(power);
        Ok(noise)
    }

    /// Voltage (V) at time `t` (s).
    #[must_use]
    pub fn volts(&self, t: f64) -> f64 {
        let mut sum = 0.0;
        let seed = self.seed;
        self.weigh(t * CLOCKS * self.high, |j, weight| {
            #[allow(clippy::cast_sign_loss)] // a number before 0 is one like any other
            let number = j as u64;
            sum += weight * normal(seed, number);
        });
        self.gain * sum
    }

    /// The upper edge of the band (Hz).
    #[must_use]
    pub fn high(&self) -> f64 {
        self.high
    }

    /// Calls `number(j, weight)` for all random numbers within the kernel's reach of `clock`, a time in clock periods.
    fn weigh(&self, clock: f64, mut number: impl FnMut(i64, f64)) {
        let first = libm::ceil(clock - self.reach);
        #[allow(clippy::cast_possible_truncation)] // saturates
        let count = libm::floor(2.0 * self.reach) as i64;
        let x = clock - first; // within the reach
        let mut high = Rotor::new(x, TAU / CLOCKS);
        let mut low = Rotor::new(x, TAU / CLOCKS * (self.low / self.high));
        let mut window = Rotor::new(x, PI / self.reach);
        for j in 0..count {
            let x = x - j as f64;
            let sinc = if x.abs() < 1e-5 {
                // Here the sines are their angles, to ten digits.
                2.0 / CLOCKS * (1.0 - self.low / self.high)
            } else {
                (high.sin - low.sin) / (PI * x)
            };
            #[allow(clippy::cast_possible_truncation)] // saturates
            number(first as i64 + j, sinc * 0.5 * (1.0 + window.cos));
            high.back();
            low.back();
            window.back();
        }
    }
}

/// Sine and cosine of an angle that goes back by the same amount again and again.
struct Rotor {
    sin: f64,
    cos: f64,
    by: (f64, f64),
}

impl Rotor {
    fn new(x: f64, rate: f64) -> Self {
        let (sin, cos) = sin_cos_f64(TAU * fraction(x * rate / TAU));
        let by = sin_cos_f64(rate);
        Self { sin, cos, by }
    }

    fn back(&mut self) {
        let (s, c) = self.by;
        (self.sin, self.cos) = (self.sin * c - self.cos * s, self.cos * c + self.sin * s);
    }
}

#[cfg(feature = "std")]
as_table!(Noise {
    rms: f64,
    low: f64,
    high: f64,
    seed: u64
});

impl fmt::Display for Noise {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [low, high, rms] = [self.low, self.high, self.rms].map(shown);
        let seed = self.seed;
        write!(f, "noise from {low} to {high} Hz, {rms} V RMS, seed {seed}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// The variance over all seeds is the same at any time: the sum of the squared weights.
        #[test]
        fn stationary(low in 0.1..7.0_f64, t in -100.0..100.0_f64) {
            let noise = Noise::new(2.0, low, 10.0, 0).expect("valid");
            let mut power = 0.0;
            noise.weigh(t * 30.0, |_, weight| power += (noise.gain * weight).powi(2));
            // What the window's side lobes (-44 dB) leave of the images.
            prop_assert!((power / 4.0 - 1.0).abs() < 1e-3, "{power}");
        }

        /// A recurrence and a kernel that ends within a clock period make no jumps.
        #[test]
        fn continuous(seed: u64, t in -100.0..100.0_f64) {
            let noise = Noise::new(1.0, 0.5, 10.0, seed).expect("valid");
            let slope = (noise.volts(t + 1e-7) - noise.volts(t)).abs() / 1e-7;
            // The slope's RMS is about 2 pi 10 / sqrt(3) = 36 V/s.
            prop_assert!(slope < 8.0 * 36.0, "{slope}");
        }
    }

    #[test]
    fn seeds_are_unlike() {
        let [a, b] = [1, 2].map(|seed| Noise::new(1.0, 0.0, 10.0, seed).expect("valid"));
        let n = 20_000;
        let product = (0..n)
            .map(|k| f64::from(k) * 0.01)
            .map(|t| a.volts(t) * b.volts(t))
            .sum::<f64>()
            / f64::from(n);
        // 200 s of 10 Hz are 4000 independent values: 0.016.
        assert!(product.abs() < 0.08, "{product}");
    }

    #[test]
    fn bands_that_cannot_be() {
        for (low, high) in [
            (0.05, 8.0),
            (7.0, 8.0),
            (9.0, 8.0),
            (-1.0, 8.0),
            (f64::NAN, 8.0),
            (0.0, 0.0),
        ] {
            assert!(Noise::new(1.0, low, high, 0).is_err(), "{low} {high}");
        }
        let error = Noise::new(1.0, 0.05, 8.0, 0)
            .expect_err("too wide")
            .to_string();
        assert_eq!(
            error,
            "noise: low = 0.05 is outside the allowed range [0.08, 6.4] Hz (or 0)"
        );
    }
}
