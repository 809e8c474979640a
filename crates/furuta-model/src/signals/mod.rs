//! Test signals: motor commands that make a rig show what it is.
//!
//! | Signal | Good for |
//! |---|---|
//! | [`FreeDecay`] | the pendulum's own friction and frequency |
//! | [`Step`], [`Steps`] | gain, time constant, delay; friction, from large and small steps |
//! | [`Ramp`] | static friction and dead zones: when does the arm begin to move? |
//! | [`Chirp`] | one frequency after the other, linearly or logarithmically |
//! | [`Multisine`] | a frequency response without leakage: sines on a grid, low peak |
//! | [`Prbs`] | a flat spectrum from two voltages only |
//! | [`Noise`] | a flat spectrum in a band, and otherwise nothing that repeats |
//!
//! A signal is a pure function of time, `volts(t)`, and has no state: it drives a plant at any sample rate, can be
//! entered anywhere, and one value serves many rollouts. Its arithmetic is this crate's own and `libm`'s, so that it
//! has the same bits on a host and on a microcontroller. [`Excitation`] wraps any of them: an end, ramps in and out, a
//! limit.
//!
//! ```
//! use furuta_model::signals::{Excitation, Prbs};
//! let signal = Prbs::new(2.0, 7, 0.05, 0)?; // ±2 V, 127 bits of 50 ms
//! let command = Excitation::new(signal, 10.0)?.faded(0.5, 0.5)?.limited(1.5)?;
//! command.check_sample_period(0.002)?;
//! assert_eq!(command.volts(0.0), 0.0);
//! assert_eq!(command.volts(5.0).abs(), 1.5);
//! assert_eq!(command.volts(10.1), 0.0);
//! # Ok::<(), furuta_model::signals::SignalError>(())
//! ```

#[cfg(feature = "std")]
#[macro_use]
mod table;

mod centring;
mod chirp;
#[cfg(feature = "std")]
mod crest;
mod error;
mod excitation;
mod free_decay;
mod multisine;
mod noise;
mod prbs;
mod ramp;
pub mod random;
mod step;
mod steps;

pub use centring::Centring;
pub use chirp::{Chirp, Sweep};
#[cfg(feature = "std")]
pub use crest::CrestFactors;
pub use error::SignalError;
pub use excitation::Excitation;
pub use free_decay::FreeDecay;
pub use multisine::{Harmonics, Line, MAX_LINES, Multisine, Phases};
pub use noise::Noise;
pub use prbs::Prbs;
pub use ramp::Ramp;
pub use step::Step;
pub use steps::Steps;

use core::fmt;

/// Any of the test signals, chosen at run time.
// A multisine carries its lines; there is no allocator to put them elsewhere, and a run holds one signal.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "std",
    derive(serde::Serialize, serde::Deserialize),
    serde(tag = "kind", rename_all = "kebab-case")
)]
pub enum Signal {
    /// No command.
    FreeDecay(FreeDecay),
    /// One step.
    Step(Step),
    /// Steps of changing height.
    Steps(Steps),
    /// A straight line.
    Ramp(Ramp),
    /// A sine of changing frequency.
    Chirp(Chirp),
    /// A sum of sines.
    Multisine(Multisine),
    /// A pseudo-random binary sequence.
    Prbs(Prbs),
    /// Band-limited white noise.
    Noise(Noise),
}

/// Runs the same expression on whichever signal it is.
macro_rules! each {
    ($signal:expr, $s:ident => $body:expr) => {
        match $signal {
            Signal::FreeDecay($s) => $body,
            Signal::Step($s) => $body,
            Signal::Steps($s) => $body,
            Signal::Ramp($s) => $body,
            Signal::Chirp($s) => $body,
            Signal::Multisine($s) => $body,
            Signal::Prbs($s) => $body,
            Signal::Noise($s) => $body,
        }
    };
}

/// How fast a signal changes: what a sample rate must follow.
enum Pace {
    /// At any sample rate.
    Any,
    /// Sines of up to this frequency (Hz).
    Frequency(f64),
    /// Levels held for so long (s).
    Hold(f64),
}

impl Signal {
    /// Voltage (V) at time `t` (s) since the start of the signal.
    #[must_use]
    pub fn volts(&self, t: f64) -> f64 {
        each!(self, s => s.volts(t))
    }

    /// The signal's name in one word: `multisine`.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::FreeDecay(_) => FreeDecay::NAME,
            Self::Step(_) => Step::NAME,
            Self::Steps(_) => Steps::NAME,
            Self::Ramp(_) => Ramp::NAME,
            Self::Chirp(_) => Chirp::NAME,
            Self::Multisine(_) => Multisine::NAME,
            Self::Prbs(_) => Prbs::NAME,
            Self::Noise(_) => Noise::NAME,
        }
    }

    fn pace(&self) -> Pace {
        match self {
            Self::FreeDecay(_) | Self::Step(_) | Self::Ramp(_) => Pace::Any,
            Self::Steps(s) => Pace::Hold(s.hold()),
            Self::Prbs(s) => Pace::Hold(s.clock()),
            Self::Chirp(s) => Pace::Frequency(s.highest()),
            Self::Multisine(s) => Pace::Frequency(s.highest()),
            Self::Noise(s) => Pace::Frequency(s.high()),
        }
    }

    /// Whether samples `period` (s) apart can follow the signal.
    ///
    /// ```
    /// use furuta_model::signals::{Chirp, Signal, Sweep};
    /// let chirp = Signal::from(Chirp::new(1.0, 0.1, 40.0, 10.0, Sweep::Linear)?);
    /// assert!(chirp.check_sample_period(0.01).is_ok());
    /// let error = chirp.check_sample_period(0.02).expect_err("25 Hz is as high as 50 samples a second go");
    /// assert_eq!(
    ///     error.to_string(),
    ///     "chirp: 40 Hz is not below half the sample rate, 25 Hz: give a lower frequency or sample faster"
    /// );
    /// # Ok::<(), furuta_model::signals::SignalError>(())
    /// ```
    ///
    /// # Errors
    /// A period that is no time, a frequency that is not below half the sample rate, levels held for less than a
    /// period.
    pub fn check_sample_period(&self, period: f64) -> Result<(), SignalError> {
        let signal = self.name();
        error::seconds(signal, "sample period", period)?;
        match self.pace() {
            Pace::Frequency(frequency) if frequency * period >= 0.5 => Err(SignalError::TooFast {
                signal,
                frequency,
                nyquist: 0.5 / period,
            }),
            Pace::Hold(hold) if hold < period * (1.0 - EARLY) => Err(SignalError::HoldTooShort {
                signal,
                hold,
                period,
            }),
            _ => Ok(()),
        }
    }
}

/// In words, with units.
///
/// ```
/// use furuta_model::signals::{Signal, Steps};
/// assert_eq!(Signal::from(Steps::new(2.0, 0.5)?).to_string(), "steps of up to 2 V every 0.5 s");
/// # Ok::<(), furuta_model::signals::SignalError>(())
/// ```
impl fmt::Display for Signal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        each!(self, s => s.fmt(f))
    }
}

macro_rules! from {
    ($($signal:ident),*) => {$(
        impl From<$signal> for Signal {
            fn from(signal: $signal) -> Self {
                Self::$signal(signal)
            }
        }
    )*};
}
from!(FreeDecay, Step, Steps, Ramp, Chirp, Multisine, Prbs, Noise);

/// By how much of a hold its end may be early: `k * period` and `n * hold` are rarely the same bits where they are the
/// same time, and a level should not last a sample longer for that.
const EARLY: f64 = 1e-6;

/// Which hold the time `t` lies in.
fn hold_index(t: f64, hold: f64) -> f64 {
    libm::floor(t / hold + EARLY)
}

/// Sine and cosine of `turns` turns.
fn sin_cos_turns(turns: f64) -> (f64, f64) {
    crate::trig::sin_cos_f64(core::f64::consts::TAU * fraction(turns))
}

/// What is left of `x` after its whole turns, in [0, 1).
fn fraction(x: f64) -> f64 {
    x - libm::floor(x)
}

/// A number as it is shown: without the last bits of its arithmetic.
fn shown(x: f64) -> f64 {
    libm::round(x * 1e6) / 1e6
}
