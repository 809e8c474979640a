//! The lines of a response in scaled frequency, and the search for the function through them.

use nalgebra::{Complex, DMatrix, DVector};
use std::f64::consts::TAU;

use super::{Delay, Request};
use crate::frequency::hold::Hold;
use crate::frequency::least_squares::{Evaluation, Optimum, minimise};
use crate::frequency::polynomial;
use crate::frequency::response::Frf;
use crate::frequency::start::{Rational, sanathanan_koerner};
use crate::frequency::transfer::Transfer;

/// A line is believed to no more than this part of itself: responses without any noise would have infinite weight.
const FINEST: f64 = 1e-4;

/// Lines to fit, in scaled frequency, the hold and images taken out.
pub(super) struct Lines {
    /// `j w / unit`.
    s: Vec<Complex<f64>>,
    h: Vec<Complex<f64>>,
    weights: Vec<f64>,
    /// Size of the hold's factor.
    factors: Vec<f64>,
    /// rad/s.
    pub(super) unit: f64,
}

impl Lines {
    /// Those of a response behind this hold, images still in it.
    pub(super) fn of(frf: &Frf, hold: Hold) -> Self {
        // The geometric middle of the band.
        let logarithms: f64 = frf.frequency.iter().map(|f| f.ln()).sum();
        let unit = TAU * (logarithms / frf.frequency.len() as f64).exp();
        // Real and imaginary part each have half of the squared deviation; neighbours know of one another.
        let share = (0.5 * frf.lines_for_one).sqrt();
        let mut lines = Self {
            s: frf
                .frequency
                .iter()
                .map(|f| Complex::new(0.0, TAU * f / unit))
                .collect(),
            h: frf.response.clone(),
            weights: Vec::new(),
            factors: Vec::new(),
            unit,
        };
        let noiseless = frf.std.iter().all(|s| *s == 0.0);
        for (k, f) in frf.frequency.iter().enumerate() {
            let factor = hold.factor(*f);
            lines.h[k] /= factor;
            let finest = if noiseless { 1.0 } else { FINEST };
            let deviation = (frf.std[k] * share).max(finest * frf.response[k].norm());
            lines.weights.push(factor.norm() / deviation);
            lines.factors.push(factor.norm());
        }
        lines
    }

    /// Takes out what this plant beyond half the sampling rate folds into the response.
    pub(super) fn unfold(&mut self, frf: &Frf, hold: Hold, transfer: &Transfer) {
        for (k, f) in frf.frequency.iter().enumerate() {
            let images = hold.images(*f, |s| transfer.at(s));
            self.h[k] = (frf.response[k] - images) / hold.factor(*f);
        }
    }

    /// Coefficients of numerator, denominator (without its leading 1), and the delay in scaled time where it is fitted.
    fn rational(x: &DVector<f64>, request: &Request) -> (Rational, f64) {
        let split = request.zeros + 1;
        let mut denominator = vec![1.0];
        denominator.extend(x.rows(split, request.poles).iter());
        let rational = Rational {
            numerator: x.rows(0, split).iter().copied().collect(),
            denominator,
        };
        let delay = match request.delay {
            Delay::Known(_) => 0.0,
            Delay::Fitted => x[split + request.poles],
        };
        (rational, delay)
    }

    fn known_delay(&self, request: &Request) -> f64 {
        match request.delay {
            Delay::Known(delay) => delay * self.unit,
            Delay::Fitted => 0.0,
        }
    }

    /// Weighted residuals and their derivatives by the parameters; `None` where these are out of bounds or a number is
    /// not finite.
    pub(super) fn evaluate(&self, x: &DVector<f64>, request: &Request) -> Evaluation {
        let (rational, delay) = Self::rational(x, request);
        // Sought a little below 0 too, or a delay of 0 would be a wall.
        if delay < -1.0 {
            return None;
        }
        let delay = delay + self.known_delay(request);
        let (zeros, poles) = (request.zeros, request.poles);
        let rows = 2 * self.s.len();
        let mut residuals = DVector::zeros(rows);
        let mut jacobian = DMatrix::zeros(rows, x.len());
        for (k, s) in self.s.iter().enumerate() {
            let late = (-s * delay).exp() * self.weights[k];
            let a = polynomial::value(&rational.denominator, *s);
            let plain = polynomial::value(&rational.numerator, *s) / a;
            let g = plain * late;
            let residual = g - self.h[k] * self.weights[k];
            (residuals[2 * k], residuals[2 * k + 1]) = (residual.re, residual.im);
            let mut put = |column: usize, d: Complex<f64>| {
                (jacobian[(2 * k, column)], jacobian[(2 * k + 1, column)]) = (d.re, d.im);
            };
            let mut power = late / a;
            for order in 0..=zeros.max(poles - 1) {
                if order <= zeros {
                    put(zeros - order, power);
                }
                if order < poles {
                    put(zeros + poles - order, -power * plain);
                }
                power *= s;
            }
            if request.delay == Delay::Fitted {
                put(zeros + 1 + poles, -s * g);
            }
        }
        let finite = residuals
            .iter()
            .chain(jacobian.iter())
            .all(|v| v.is_finite());
        finite.then_some((residuals, jacobian))
    }

    /// What distortion as large as was detected does to the parameters, by real and imaginary part of each line; `None`
    /// where nothing is known of it.
    pub(super) fn distorted(
        &self,
        frf: &Frf,
        covariance: &DMatrix<f64>,
        jacobian: &DMatrix<f64>,
    ) -> Option<DMatrix<f64>> {
        if frf.distortion.is_empty() {
            return None;
        }
        let mut reach = covariance * jacobian.transpose();
        for (column, mut values) in reach.column_iter_mut().enumerate() {
            let k = column / 2;
            // The weight is that of the response with the hold taken out.
            let size = self.weights[k] * frf.distortion[k] / self.factors[k];
            values.iter_mut().for_each(|v| *v *= size);
        }
        Some(reach)
    }

    /// The function of these parameters, in unscaled time.
    pub(super) fn transfer(&self, x: &DVector<f64>, request: &Request) -> Transfer {
        let (rational, delay) = Self::rational(x, request);
        // B(s/unit)/A(s/unit): coefficient of s^k gets unit^-k, then both get unit^n so that A is monic.
        let n = request.poles as i32;
        let unscale = |c: &[f64]| -> Vec<f64> {
            let degree = c.len() as i32 - 1;
            c.iter()
                .enumerate()
                .map(|(i, c)| c * self.unit.powi(n - degree + i as i32))
                .collect()
        };
        Transfer {
            numerator: unscale(&rational.numerator),
            denominator: unscale(&rational.denominator),
            delay: (delay + self.known_delay(request)) / self.unit,
        }
    }
}

/// The best of several starts: Sanathanan's and Koerner's, the same made stable, and both for several delays where that
/// is sought.
pub(super) fn search(lines: &Lines, request: &Request) -> Option<Optimum> {
    let fastest = lines.s.last().map_or(1.0, |s| s.im);
    let delays: Vec<f64> = match request.delay {
        Delay::Known(_) => vec![0.0],
        // Up to two turns at the highest frequency.
        Delay::Fitted => [0.0, 0.1, 0.3, 1.0, 3.0, 12.0]
            .map(|turn| turn / fastest)
            .to_vec(),
    };
    let mut best: Option<Optimum> = None;
    for delay in delays {
        let whole = delay + lines.known_delay(request);
        let early: Vec<Complex<f64>> = lines
            .h
            .iter()
            .zip(&lines.s)
            .map(|(h, s)| h * (s * whole).exp())
            .collect();
        let orders = [request.zeros, request.poles];
        let Some(start) = sanathanan_koerner(&lines.s, &early, &lines.weights, orders) else {
            continue;
        };
        let stable = start.reflected();
        for rational in std::iter::once(start).chain(stable) {
            let mut x: Vec<f64> = rational.numerator.clone();
            x.extend(&rational.denominator[1..]);
            if request.delay == Delay::Fitted {
                x.push(delay);
            }
            let found = minimise(DVector::from_vec(x), |x| lines.evaluate(x, request));
            if let Some(found) = found
                && best.as_ref().is_none_or(|b| found.sum < b.sum)
            {
                best = Some(found);
            }
        }
    }
    best
}
