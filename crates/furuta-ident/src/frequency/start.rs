//! Where a fit begins: the equation error, which is linear in the coefficients.

use nalgebra::{Complex, DMatrix, DVector};

use super::least_squares::solve;
use super::polynomial;

/// Iterations of Sanathanan and Koerner.
const ITERATIONS: usize = 30;

/// A rational function `B(s) / A(s)` in the scaled frequency, coefficients by falling power, `A` monic.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Rational {
    pub(super) numerator: Vec<f64>,
    pub(super) denominator: Vec<f64>,
}

impl Rational {
    pub(super) fn at(&self, s: Complex<f64>) -> Complex<f64> {
        polynomial::value(&self.numerator, s) / polynomial::value(&self.denominator, s)
    }

    /// The same with poles of the right half plane mirrored into the left: same magnitude, stable.
    pub(super) fn reflected(&self) -> Option<Self> {
        let mut poles = polynomial::roots(&self.denominator)?;
        poles.iter_mut().for_each(|p| p.re = -p.re.abs());
        Some(Self {
            numerator: self.numerator.clone(),
            denominator: polynomial::from_roots(&poles),
        })
    }
}

/// Levi's least squares on `B - H A`, each line with its weight, and from there the iterations of Sanathanan and
/// Koerner: the same, divided by the denominator before, which takes away Levi's stress on high frequencies. The
/// iterate that fits best is given.
///
/// Vector fitting does the same iterations on partial fractions, for the sake of their condition; with frequencies
/// scaled and columns normalised, polynomials up to order 6 come back to eight digits over a band of 1 to 250, which is
/// all that is asked of a start.
pub(super) fn sanathanan_koerner(
    s: &[Complex<f64>],
    h: &[Complex<f64>],
    weights: &[f64],
    [zeros, poles]: [usize; 2],
) -> Option<Rational> {
    let mut best: Option<(f64, Rational)> = None;
    let mut before = vec![1.0; s.len()];
    for _ in 0..ITERATIONS {
        let found = equation_error(s, h, weights, &before, [zeros, poles])?;
        let cost: f64 = (0..s.len())
            .map(|k| (weights[k] * (found.at(s[k]) - h[k])).norm_sqr())
            .sum();
        before = s
            .iter()
            .map(|s| polynomial::value(&found.denominator, *s).norm())
            .collect();
        let done = best
            .as_ref()
            .is_some_and(|(least, _)| (cost - least).abs() <= 1e-12 * least);
        if cost.is_finite() && best.as_ref().is_none_or(|(least, _)| cost < *least) {
            best = Some((cost, found));
        }
        if done || !before.iter().all(|a| *a > 0.0) {
            break;
        }
    }
    best.map(|(_, found)| found)
}

/// One linear least squares.
fn equation_error(
    s: &[Complex<f64>],
    h: &[Complex<f64>],
    weights: &[f64],
    before: &[f64],
    [zeros, poles]: [usize; 2],
) -> Option<Rational> {
    let (m, n) = (2 * s.len(), zeros + 1 + poles);
    let mut a = DMatrix::zeros(m, n);
    let mut b = DVector::zeros(m);
    for k in 0..s.len() {
        let weight = weights[k] / before[k];
        let mut power = Complex::new(weight, 0.0);
        for order in 0..=poles {
            let h = -h[k] * power;
            if order <= zeros {
                (a[(2 * k, zeros - order)], a[(2 * k + 1, zeros - order)]) = (power.re, power.im);
            }
            if order < poles {
                let column = zeros + poles - order;
                (a[(2 * k, column)], a[(2 * k + 1, column)]) = (h.re, h.im);
            } else {
                (b[2 * k], b[2 * k + 1]) = (-h.re, -h.im);
            }
            power *= s[k];
        }
    }
    let sizes: Vec<f64> = a.column_iter().map(|c| c.norm()).collect();
    if !sizes.iter().all(|x| *x > 0.0 && x.is_finite()) {
        return None;
    }
    for (mut column, size) in a.column_iter_mut().zip(&sizes) {
        column /= *size;
    }
    let mut x = solve(a, b)?;
    x.iter_mut().zip(&sizes).for_each(|(x, size)| *x /= size);
    let mut denominator = vec![1.0];
    denominator.extend(x.rows(zeros + 1, poles).iter());
    Some(Rational {
        numerator: x.rows(0, zeros + 1).iter().copied().collect(),
        denominator,
    })
}
