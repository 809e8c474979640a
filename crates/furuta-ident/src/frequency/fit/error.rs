//! Why there is no fit.

use nalgebra::Complex;

/// Why there is no fit.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// Orders that cannot be.
    #[error(
        "a numerator of order {zeros} over a denominator of order {poles}: the denominator's order is 1 to 12, the \
         numerator's at most {most}"
    )]
    Orders {
        /// Order of the numerator.
        zeros: usize,
        /// Order of the denominator.
        poles: usize,
        /// The highest possible of the numerator.
        most: usize,
    },
    /// Not enough lines.
    #[error(
        "{parameters} coefficients need at least {needed} lines, the response has {lines}: widen the band, ask for a \
         finer resolution, or fit lower orders"
    )]
    TooFewLines {
        /// Parameters.
        parameters: usize,
        /// Lines needed.
        needed: usize,
        /// Lines there are.
        lines: usize,
    },
    /// A response that is no number or 0 somewhere.
    #[error(
        "the response at {frequency} Hz is {value}, its deviation {std}: both must be finite, the response not 0; cut \
         the band"
    )]
    Unusable {
        /// Where, Hz.
        frequency: f64,
        /// The response.
        value: Complex<f64>,
        /// Its deviation.
        std: f64,
    },
    /// A delay that cannot be.
    #[error("delay = {value} s is outside the allowed range [0, {max}] s")]
    DelayOutOfRange {
        /// What was given, s.
        value: f64,
        /// The largest, s.
        max: f64,
    },
    /// The search found nothing.
    #[error(
        "no transfer function of orders {zeros}/{poles} could be fitted: give lower orders or a narrower band"
    )]
    NoConvergence {
        /// Order of the numerator.
        zeros: usize,
        /// Order of the denominator.
        poles: usize,
    },
}
