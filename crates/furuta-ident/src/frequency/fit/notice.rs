//! What a person should know about a fit.

use nalgebra::Complex;

use super::{Fit, Uncertain};

/// Beyond this many variances the fit is said to leave more than noise.
const MUCH: f64 = 2.0;

/// Something about a fit that a person should know.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum FitNotice {
    /// A pole in the right half plane, by however little.
    Unstable {
        /// The fastest growing one, rad/s.
        pole: Uncertain<Complex<f64>>,
    },
    /// A pole and a zero that cancel within their deviations: the orders are too high.
    Cancels {
        /// The pole, rad/s.
        pole: Complex<f64>,
        /// The zero, rad/s.
        zero: Complex<f64>,
    },
    /// The fit leaves more than the noise.
    MoreThanNoise {
        /// Residuals in units of the noise's variance.
        chi2: f64,
    },
    /// Coefficients that the response does not determine.
    Undetermined {
        /// Parameters.
        parameters: usize,
        /// Those that are determined.
        rank: usize,
    },
}

impl std::fmt::Display for FitNotice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Unstable { pole } => write!(
                f,
                "the fit is unstable: a pole at {:.4} {:+.4}i rad/s (± {:.2}) in the right half plane{}; a hanging \
                 pendulum is stable: fit lower orders or a narrower band, or, if the rig stood upright, take the \
                 response by the joint method",
                pole.value.re,
                pole.value.im,
                pole.std.re,
                if pole.value.re < 2.0 * pole.std.re {
                    ", which the response does not tell from one on the axis or left of it"
                } else {
                    ""
                }
            ),
            Self::Cancels { pole, zero } => write!(
                f,
                "the pole {:.4} {:+.4}i and the zero {:.4} {:+.4}i cancel within their deviations: lower orders say \
                 the same",
                pole.re, pole.im, zero.re, zero.im
            ),
            Self::MoreThanNoise { chi2 } => write!(
                f,
                "the fit leaves {chi2:.1} times the variance of the noise: higher orders, or something that no linear \
                 model has (friction, large swings); standard deviations are enlarged by {:.1}",
                chi2.sqrt()
            ),
            Self::Undetermined { parameters, rank } => write!(
                f,
                "only {rank} of {parameters} coefficients are determined by the response: fit lower orders"
            ),
        }
    }
}

impl Fit {
    /// What should be known about the fit.
    #[must_use]
    pub fn notices(&self) -> Vec<FitNotice> {
        let mut notices = Vec::new();
        let unstable = |p: &&Uncertain<Complex<f64>>| p.value.re > 0.0;
        let fastest = self.poles.iter().filter(unstable);
        if let Some(pole) = fastest.max_by(|a, b| a.value.re.total_cmp(&b.value.re)) {
            notices.push(FitNotice::Unstable { pole: *pole });
        }
        for pole in self.poles.iter().filter(|p| p.value.im >= 0.0) {
            let cancels = |zero: &&Uncertain<Complex<f64>>| {
                // A pair cancels a pair, a real one a real one; each within two deviations of the other.
                let alike = (pole.value.im > 0.0) == (zero.value.im > 0.0) && zero.value.im >= 0.0;
                let least = pole.std.norm().min(zero.std.norm());
                alike && (pole.value - zero.value).norm() < 2.0 * least
            };
            if let Some(zero) = self.zeros.iter().find(cancels) {
                notices.push(FitNotice::Cancels {
                    pole: pole.value,
                    zero: zero.value,
                });
            }
        }
        if self.chi2 > MUCH {
            notices.push(FitNotice::MoreThanNoise { chi2: self.chi2 });
        }
        if self.rank < self.parameters {
            notices.push(FitNotice::Undetermined {
                parameters: self.parameters,
                rank: self.rank,
            });
        }
        notices
    }
}
