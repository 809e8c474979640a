//! Open-loop test signals: voltages that make a rig show what it is.

use std::f64::consts::{PI, TAU};
use std::fmt;

/// A test signal.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Excitation {
    /// Sum of sines.
    Multisine(Multisine),
    /// Steps of changing height.
    Steps(Steps),
    /// Sine of changing frequency.
    Chirp(Chirp),
}

impl Excitation {
    /// Voltage at time `t` (s) since the start of the signal (V).
    #[must_use]
    pub fn volts(&self, t: f64) -> f64 {
        match self {
            Self::Multisine(signal) => signal.volts(t),
            Self::Steps(signal) => signal.volts(t),
            Self::Chirp(signal) => signal.volts(t),
        }
    }
}

/// In words, with units.
///
/// ```
/// use furuta_hw::{Excitation, Steps};
/// let steps = Excitation::Steps(Steps { amplitude: 2.0, hold: 0.5 });
/// assert_eq!(steps.to_string(), "steps of up to 2 V every 0.5 s");
/// ```
impl fmt::Display for Excitation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Multisine(m) => write!(
                f,
                "{} sines from {} to {} Hz, {} V RMS",
                m.lines, m.low, m.high, m.rms
            ),
            Self::Steps(s) => write!(f, "steps of up to {} V every {} s", s.amplitude, s.hold),
            Self::Chirp(c) => write!(
                f,
                "chirp of {} V from {} to {} Hz in {} s",
                c.amplitude, c.from, c.to, c.duration
            ),
        }
    }
}

/// Sines of equal amplitude `rms * sqrt(2 / lines)` at frequencies spaced evenly in their logarithm. Their phases are
/// Schroeder's (IEEE Trans. Inf. Theory 16 (1970) 85), which keep them from adding up.
///
/// ```
/// use furuta_hw::Multisine;
/// let signal = Multisine { rms: 1.0, low: 0.25, high: 8.0, lines: 12 };
/// let n = 100_000;
/// let power: f64 = (0..n).map(|k| signal.volts(f64::from(k) * 1e-3).powi(2)).sum::<f64>() / f64::from(n);
/// assert!((power.sqrt() - 1.0).abs() < 0.05);
/// ```
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Multisine {
    /// Root mean square of the whole (V).
    pub rms: f64,
    /// Lowest frequency (Hz).
    pub low: f64,
    /// Highest frequency (Hz).
    pub high: f64,
    /// Number of sines.
    pub lines: u8,
}

impl Multisine {
    /// Voltage (V) at time `t` (s).
    #[must_use]
    pub fn volts(&self, t: f64) -> f64 {
        let lines = f64::from(self.lines);
        let ratio = (self.high / self.low).powf(1.0 / (lines - 1.0).max(1.0));
        let mut omega = TAU * self.low;
        let mut sum = 0.0;
        for i in 0..self.lines {
            let i = f64::from(i);
            sum += (omega * t - PI * i * (i + 1.0) / lines).cos();
            omega *= ratio;
        }
        self.rms * (2.0 / lines.max(1.0)).sqrt() * sum
    }
}

/// Steps between 0 and changing heights of both signs, whose mean is zero: large and small, so that friction and dead
/// zones show.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Steps {
    /// Largest height (V).
    pub amplitude: f64,
    /// Length of each step (s).
    pub hold: f64,
}

impl Steps {
    /// Heights in parts of the amplitude. Up and down in equal measure, so that a free arm does not wander off.
    const PATTERN: [f64; 16] = [
        0.5, -0.5, 0.25, -0.25, 1.0, -1.0, 0.0, 0.125, -0.125, 0.75, -0.75, -0.375, 0.375, -1.0,
        1.0, 0.0,
    ];

    /// Voltage (V) at time `t` (s).
    #[must_use]
    pub fn volts(&self, t: f64) -> f64 {
        let k = (t.max(0.0) / self.hold) as usize; // the cast saturates: any t is fine
        self.amplitude * Self::PATTERN[k % Self::PATTERN.len()]
    }
}

/// Sine whose frequency changes linearly.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Chirp {
    /// Amplitude (V).
    pub amplitude: f64,
    /// Frequency at the start (Hz).
    pub from: f64,
    /// Frequency at the end (Hz).
    pub to: f64,
    /// Length (s); 0 V afterwards.
    pub duration: f64,
}

impl Chirp {
    /// Voltage (V) at time `t` (s): `amplitude sin(2 pi (from t + (to - from) t^2 / (2 duration)))`.
    #[must_use]
    pub fn volts(&self, t: f64) -> f64 {
        if t > self.duration {
            return 0.0;
        }
        self.amplitude
            * (TAU * (self.from * t + (self.to - self.from) * t * t / (2.0 * self.duration))).sin()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn schroeder_phases_keep_peaks_low() {
        // Zero phases would add up to sqrt(2 * 12) = 4.9 times the RMS.
        let signal = Multisine {
            rms: 1.0,
            low: 0.25,
            high: 8.0,
            lines: 12,
        };
        let peak = (0..40_000)
            .map(|k| signal.volts(f64::from(k) * 1e-3).abs())
            .fold(0.0, f64::max);
        assert!(peak < 3.5, "{peak}");
    }

    #[test]
    fn steps_have_no_mean() {
        let steps = Steps {
            amplitude: 4.0,
            hold: 0.5,
        };
        let sum: f64 = (0..16)
            .map(|k| steps.volts(0.25 + 0.5 * f64::from(k)))
            .sum();
        assert_eq!(sum, 0.0);
        assert_eq!(steps.volts(f64::INFINITY), steps.volts(1e300));
    }

    #[test]
    fn chirp_sweeps_its_frequencies() {
        let chirp = Chirp {
            amplitude: 1.5,
            from: 10.0,
            to: 0.0,
            duration: 10.0,
        };
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
}
