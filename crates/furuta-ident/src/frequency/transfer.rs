//! Continuous transfer functions of any order, with a delay.

use nalgebra::Complex;
use std::f64::consts::TAU;

use super::polynomial;

/// `G(s) = (b_m s^m + ... + b_0) / (s^n + a_(n-1) s^(n-1) + ... + a_0) e^(-delay s)`.
#[derive(Clone, Debug, PartialEq)]
pub struct Transfer {
    /// Coefficients by falling power, `b_m` first.
    pub numerator: Vec<f64>,
    /// The same of the denominator; the first is 1.
    pub denominator: Vec<f64>,
    /// Delay, s.
    pub delay: f64,
}

/// Numbers that are no transfer function.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TransferError {
    /// No coefficients, or none but zeros.
    #[error("the {part} has no coefficient other than 0: give them by falling power of s")]
    Empty {
        /// Numerator or denominator.
        part: &'static str,
    },
    /// A coefficient that is not finite.
    #[error("coefficient {place} of the {part} is {value}: give finite numbers")]
    NotFinite {
        /// Numerator or denominator.
        part: &'static str,
        /// Which one, from 1.
        place: usize,
        /// The value.
        value: f64,
    },
    /// More zeros than poles.
    #[error(
        "the numerator is of order {numerator}, the denominator of order {denominator}: a rig has no more zeros than \
         poles"
    )]
    Improper {
        /// Order of the numerator.
        numerator: usize,
        /// Order of the denominator.
        denominator: usize,
    },
}

impl Transfer {
    /// A transfer function without delay; both are divided by the denominator's first coefficient, leading zeros are
    /// dropped.
    ///
    /// ```
    /// use furuta_ident::frequency::transfer::Transfer;
    /// let g = Transfer::new(&[0.0, 2.0], &[2.0, 6.0])?; // 1 / (s + 3)
    /// assert_eq!((g.numerator.as_slice(), g.denominator.as_slice()), (&[1.0][..], &[1.0, 3.0][..]));
    /// assert_eq!(g.poles().map(|p| p[0].re), Some(-3.0));
    /// assert!(Transfer::new(&[1.0, 0.0, 0.0], &[1.0, 1.0]).is_err());
    /// # Ok::<(), furuta_ident::frequency::transfer::TransferError>(())
    /// ```
    ///
    /// # Errors
    /// Coefficients that are missing, not finite or improper.
    pub fn new(numerator: &[f64], denominator: &[f64]) -> Result<Self, TransferError> {
        for (part, c) in [("numerator", numerator), ("denominator", denominator)] {
            if let Some(k) = c.iter().position(|c| !c.is_finite()) {
                return Err(TransferError::NotFinite {
                    part,
                    place: k + 1,
                    value: c[k],
                });
            }
        }
        let start = |part, c: &[f64]| {
            c.iter()
                .position(|c| *c != 0.0)
                .ok_or(TransferError::Empty { part })
        };
        let numerator = &numerator[start("numerator", numerator)?..];
        let denominator = &denominator[start("denominator", denominator)?..];
        if numerator.len() > denominator.len() {
            return Err(TransferError::Improper {
                numerator: numerator.len() - 1,
                denominator: denominator.len() - 1,
            });
        }
        let lead = denominator[0];
        Ok(Self {
            numerator: numerator.iter().map(|c| c / lead).collect(),
            denominator: denominator.iter().map(|c| c / lead).collect(),
            delay: 0.0,
        })
    }

    /// The value at a point of the complex plane, rad/s.
    #[must_use]
    pub fn at(&self, s: Complex<f64>) -> Complex<f64> {
        let g = polynomial::value(&self.numerator, s) / polynomial::value(&self.denominator, s);
        if self.delay == 0.0 {
            g
        } else {
            g * (-s * self.delay).exp()
        }
    }

    /// The response to a sine of this frequency (Hz).
    #[must_use]
    pub fn response(&self, frequency: f64) -> Complex<f64> {
        self.at(Complex::new(0.0, TAU * frequency))
    }

    /// Orders of numerator and denominator.
    #[must_use]
    pub fn orders(&self) -> [usize; 2] {
        [self.numerator.len() - 1, self.denominator.len() - 1]
    }

    /// The poles (rad/s), slow ones first; `None` where they cannot be computed.
    #[must_use]
    pub fn poles(&self) -> Option<Vec<Complex<f64>>> {
        polynomial::roots(&self.denominator)
    }

    /// The zeros (rad/s), slow ones first; `None` where they cannot be computed.
    #[must_use]
    pub fn zeros(&self) -> Option<Vec<Complex<f64>>> {
        polynomial::roots(&self.numerator)
    }
}

/// By falling power: `-24.9 s^2 - 323 s + 165`.
#[must_use]
pub fn polynomial_text(coefficients: &[f64], digits: usize) -> String {
    let degree = coefficients.len().saturating_sub(1);
    let mut text = String::new();
    for (i, c) in coefficients.iter().enumerate() {
        if *c == 0.0 && degree > 0 {
            continue;
        }
        let power = match degree - i {
            0 => String::new(),
            1 => " s".to_owned(),
            k => format!(" s^{k}"),
        };
        let sign = match (text.is_empty(), *c < 0.0) {
            (true, false) => "",
            (true, true) => "-",
            (false, false) => " + ",
            (false, true) => " - ",
        };
        let size = crate::answer::significant(c.abs(), digits);
        let size = if size.contains('.') && !size.contains('e') {
            size.trim_end_matches('0').trim_end_matches('.').to_owned()
        } else {
            size
        };
        let size = if size == "1" && !power.is_empty() {
            power.trim_start().to_owned()
        } else {
            size + &power
        };
        text += sign;
        text += &size;
    }
    if text.is_empty() {
        "0".to_owned()
    } else {
        text
    }
}
