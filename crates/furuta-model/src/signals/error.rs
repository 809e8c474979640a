//! Why a signal cannot be built or sampled as asked, and the ranges that all signals share.

use core::fmt;

/// Why a signal cannot be built or sampled as asked.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum SignalError {
    /// A value outside its range, or not a number.
    OutOfRange {
        /// Which signal.
        signal: &'static str,
        /// Which of its parameters.
        parameter: &'static str,
        /// What was given.
        value: f64,
        /// Lower end of the range.
        min: f64,
        /// Upper end of the range.
        max: f64,
        /// Unit of all three.
        unit: &'static str,
    },
    /// A frequency that samples cannot follow.
    TooFast {
        /// Which signal.
        signal: &'static str,
        /// Its highest frequency, Hz.
        frequency: f64,
        /// Half the sample rate, Hz.
        nyquist: f64,
    },
    /// Levels shorter than a sample.
    HoldTooShort {
        /// Which signal.
        signal: &'static str,
        /// How long it holds a level, s.
        hold: f64,
        /// The sample period, s.
        period: f64,
    },
    /// No multiple of the fundamental frequency lies in the band.
    NoHarmonic {
        /// Fundamental frequency, Hz.
        fundamental: f64,
        /// Lower end of the band, Hz.
        low: f64,
        /// Upper end of the band, Hz.
        high: f64,
    },
    /// More sines than a signal can hold.
    TooManyLines {
        /// How many.
        lines: usize,
        /// How many are possible.
        most: usize,
    },
}

impl fmt::Display for SignalError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OutOfRange {
                signal,
                parameter,
                value,
                min,
                max,
                unit,
            } => {
                write!(
                    f,
                    "{signal}: {parameter} = {value} is outside the allowed range [{min}, {max}]"
                )?;
                if unit.is_empty() {
                    Ok(())
                } else {
                    write!(f, " {unit}")
                }
            }
            Self::TooFast {
                signal,
                frequency,
                nyquist,
            } => write!(
                f,
                "{signal}: {frequency} Hz is not below half the sample rate, {nyquist} Hz: give a lower \
                 frequency or sample faster"
            ),
            Self::HoldTooShort {
                signal,
                hold,
                period,
            } => write!(
                f,
                "{signal}: a level held for {hold} s is shorter than the sample period of {period} s: hold \
                 it longer or sample faster"
            ),
            Self::NoHarmonic {
                fundamental,
                low,
                high,
            } => write!(
                f,
                "multisine: no multiple of {fundamental} Hz lies between {low} and {high} Hz: give a lower \
                 fundamental or a wider band"
            ),
            Self::TooManyLines { lines, most } => write!(
                f,
                "multisine: {lines} sines are too many (at most {most}): give fewer lines, a higher \
                 fundamental or a narrower band"
            ),
        }
    }
}

impl core::error::Error for SignalError {}

impl SignalError {
    /// The same with what the parameter is called where the user gave it: an option, a keyword.
    ///
    /// ```
    /// use furuta_model::signals::Step;
    /// let error = Step::new(f64::NAN, 0.0).expect_err("not a number").renamed(|_, _| "--amplitude");
    /// assert!(error.to_string().starts_with("step: --amplitude = NaN"));
    /// ```
    #[must_use]
    pub fn renamed(mut self, name: impl FnOnce(&str, &'static str) -> &'static str) -> Self {
        if let Self::OutOfRange {
            signal, parameter, ..
        } = &mut self
        {
            *parameter = name(signal, parameter);
        }
        self
    }
}

/// The value, if it lies in the closed range; a NaN does not.
pub(super) fn within(
    signal: &'static str,
    parameter: &'static str,
    value: f64,
    [min, max]: [f64; 2],
    unit: &'static str,
) -> Result<f64, SignalError> {
    if value >= min && value <= max {
        Ok(value)
    } else {
        Err(SignalError::OutOfRange {
            signal,
            parameter,
            value,
            min,
            max,
            unit,
        })
    }
}

/// A voltage of either sign. No motor of such a rig takes a kilovolt: more is a wrong unit.
pub(super) fn volts(
    signal: &'static str,
    parameter: &'static str,
    value: f64,
) -> Result<f64, SignalError> {
    within(signal, parameter, value, [-1e3, 1e3], "V")
}

/// The size of a voltage.
pub(super) fn size(
    signal: &'static str,
    parameter: &'static str,
    value: f64,
) -> Result<f64, SignalError> {
    within(signal, parameter, value, [0.0, 1e3], "V")
}

/// A length of time that is not zero.
pub(super) fn seconds(
    signal: &'static str,
    parameter: &'static str,
    value: f64,
) -> Result<f64, SignalError> {
    within(signal, parameter, value, [1e-6, 1e6], "s")
}

/// A frequency between `min` (Hz) and what no rig of this kind follows.
pub(super) fn frequency(
    signal: &'static str,
    parameter: &'static str,
    value: f64,
    min: f64,
) -> Result<f64, SignalError> {
    within(signal, parameter, value, [min, 1e5], "Hz")
}

/// The lowest frequency that counts as one (Hz): a period of almost three hours.
pub(super) const SLOWEST: f64 = 1e-4;
