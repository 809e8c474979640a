//! How sure a fit is: deviations of its coefficients, poles and zeros, and what it leaves.

use nalgebra::{Complex, DMatrix};

use super::lines::Lines;
use super::{Delay, Fit, Request, Uncertain, parameters};
use crate::frequency::least_squares::{Optimum, covariance};
use crate::frequency::polynomial;
use crate::frequency::response::Frf;

impl Lines {
    /// The function found, with deviations and what it leaves.
    pub(super) fn report(&self, frf: &Frf, request: &Request, found: &Optimum) -> Option<Fit> {
        let transfer = self.transfer(&found.parameters, request);
        let p = parameters(request);
        let (c, rank) = covariance(&found.jacobian);
        // Real and imaginary parts, as many as are independent.
        let count = 2.0 * frf.frequency.len() as f64 / frf.lines_for_one;
        let chi2 = found.sum / (count - p as f64).max(1.0);
        let noiseless = frf.std.iter().all(|s| *s == 0.0);
        let enlarged = if noiseless { chi2 } else { chi2.max(1.0) };
        let reach = self.distorted(frf, &c, &found.jacobian);
        // To the unscaled coefficients.
        let n = request.poles as i32;
        let scales: Vec<f64> = (0..=request.zeros)
            .map(|i| self.unit.powi(n - (request.zeros - i) as i32))
            .chain((1..=request.poles).map(|i| self.unit.powi(i as i32)))
            .chain((request.delay == Delay::Fitted).then_some(1.0 / self.unit))
            .collect();
        let spread = Spread {
            covariance: DMatrix::from_fn(p, p, |i, j| enlarged * c[(i, j)] * scales[i] * scales[j]),
            reach: reach.map(|r| DMatrix::from_fn(p, r.ncols(), |i, j| r[(i, j)] * scales[i])),
        };
        let std = |i: usize| spread.std(i, &[1.0]);
        let split = request.zeros + 1;
        let numerator_std: Vec<f64> = (0..split).map(std).collect();
        let mut denominator_std = vec![0.0];
        denominator_std.extend((split..split + request.poles).map(std));
        let delay_std = match request.delay {
            Delay::Known(_) => 0.0,
            Delay::Fitted => std(split + request.poles),
        };
        let poles = uncertain_roots(&transfer.denominator, &spread, split, 1)?;
        let zeros = uncertain_roots(&transfer.numerator, &spread, 0, 0)?;
        let relative: f64 = (0..frf.frequency.len())
            .map(|k| {
                let model = request.hold.sampled(frf.frequency[k], |s| transfer.at(s));
                (model - frf.response[k]).norm_sqr() / frf.response[k].norm_sqr()
            })
            .sum();
        // Without a known variance, that which is left stands for it.
        let evidence = if noiseless {
            count * (found.sum / count).max(1e-30).ln()
        } else {
            found.sum
        };
        Some(Fit {
            delay: Uncertain {
                value: transfer.delay,
                std: delay_std,
            },
            numerator_std,
            denominator_std,
            poles,
            zeros,
            chi2,
            aic: evidence + 2.0 * p as f64,
            bic: evidence + p as f64 * count.ln(),
            parameters: p,
            rank,
            relative_error: (relative / frf.frequency.len() as f64).sqrt(),
            hold: request.hold,
            transfer,
        })
    }
}

/// A bound is taken for the ends of a 95 % interval.
const BOUND: f64 = 1.96;

/// A cubic nonlinearity shifts the response at each line by this much of the distortion that it leaves there. Of
/// `u + c u³` under noise of variance `v` in a band, the response shifts by `3 c v`; what is left, `6 c² v³`, has at the
/// band's middle 3/4, at its ends 1/2 of the density that it would have within the band: `sqrt(9 / (6 / 2))` at most.
const SHIFT: f64 = 1.732;

/// How far parameters may be off.
struct Spread {
    /// By chance.
    covariance: DMatrix<f64>,
    /// By nonlinear distortion as large as was detected: by parameter (rows) and by real and imaginary part of each
    /// line.
    reach: Option<DMatrix<f64>>,
}

impl Spread {
    /// Of a function with this gradient by the parameters from `at` on. Distortion shifts all lines of a response
    /// together, in a direction that is not known: what it can do at most, each line in its worst direction, is added.
    fn std(&self, at: usize, gradient: &[f64]) -> f64 {
        let mut chance = 0.0;
        for (i, a) in gradient.iter().enumerate() {
            for (j, b) in gradient.iter().enumerate() {
                chance += a * b * self.covariance[(at + i, at + j)];
            }
        }
        let bound: f64 = self
            .reach
            .iter()
            .map(|reach| -> f64 {
                let part = |column: usize| -> f64 {
                    let terms = gradient.iter().enumerate();
                    terms.map(|(i, g)| g * reach[(at + i, column)]).sum()
                };
                (0..reach.ncols() / 2)
                    .map(|k| part(2 * k).hypot(part(2 * k + 1)))
                    .sum()
            })
            .sum();
        (chance.max(0.0) + (SHIFT * bound / BOUND).powi(2)).sqrt()
    }
}

/// Roots of a polynomial with uncertain coefficients; those from `first` on are uncertain, parameters `at` and on. To
/// first order, `d root / d c_i = -root^(degree - i) / P'(root)`.
fn uncertain_roots(
    coefficients: &[f64],
    spread: &Spread,
    at: usize,
    first: usize,
) -> Option<Vec<Uncertain<Complex<f64>>>> {
    let slope = polynomial::derivative(coefficients);
    let degree = coefficients.len() - 1;
    let roots = polynomial::roots(coefficients)?;
    let with_std = |root: Complex<f64>| {
        let p = polynomial::value(&slope, root);
        let gradient: Vec<Complex<f64>> = (first..=degree)
            .map(|i| -root.powi((degree - i) as i32) / p)
            .collect();
        let std = |part: fn(&Complex<f64>) -> f64| {
            let gradient: Vec<f64> = gradient.iter().map(part).collect();
            spread.std(at, &gradient)
        };
        Uncertain {
            value: root,
            std: Complex::new(std(|z| z.re), std(|z| z.im)),
        }
    };
    Some(roots.into_iter().map(with_std).collect())
}
