//! Nonlinear least squares of a handful of parameters, whose Jacobian is at hand.

use nalgebra::{DMatrix, DVector};

use crate::least_squares::{self, LeastSquares, Rules};

/// Where the search ended.
#[derive(Clone, Debug)]
pub(super) struct Optimum {
    pub(super) parameters: DVector<f64>,
    /// Half of it is what is minimised.
    pub(super) sum: f64,
    /// Jacobian there.
    pub(super) jacobian: DMatrix<f64>,
}

/// Residuals and their Jacobian at a place; `None` where there is no value.
pub(super) type Evaluation = Option<(DVector<f64>, DMatrix<f64>)>;

/// Two hundred trials end any fit of a handful of parameters.
const RULES: Rules = Rules {
    iterations: 200,
    damping: 1e-3,
    ease: (0.2, 1e-12),
    stiffen: (4.0, 0.0),
    most: 1e12,
    abandoned: 0.0,
};
/// This many steps in a row that gain less than this share of the sum end a fit.
const STILL: usize = 3;
const SMALL: f64 = 1e-10;

/// Residuals as a problem of least squares.
struct Residuals<F> {
    evaluate: F,
}

/// A place with what was evaluated there.
struct Place {
    x: DVector<f64>,
    residuals: DVector<f64>,
    jacobian: DMatrix<f64>,
    sum: f64,
    /// The largest column each parameter has had: what a step is measured in (Moré).
    scale: DVector<f64>,
    /// Steps in a row that gained next to nothing.
    still: usize,
}

impl Place {
    fn with_columns(mut self) -> Self {
        for (s, column) in self.scale.iter_mut().zip(self.jacobian.column_iter()) {
            *s = column.norm().max(*s).max(f64::MIN_POSITIVE.sqrt());
        }
        self
    }
}

impl<F: Fn(&DVector<f64>) -> Evaluation> LeastSquares<Place> for Residuals<F> {
    type Linear = ();
    type Step = DVector<f64>;

    fn cost(&self, place: &Place) -> f64 {
        place.sum
    }

    fn linearise(&self, _: &mut Place) {}

    fn step(&self, place: &Place, (): &(), damping: f64) -> Option<(DVector<f64>, f64)> {
        let step = step(&place.residuals, &place.jacobian, &place.scale, damping)?;
        let left = &place.residuals - &place.jacobian * &step;
        let predicted = place.sum - left.norm_squared();
        Some((step, predicted))
    }

    fn trial(&self, place: &Place, (): &(), step: &DVector<f64>, _: bool) -> Place {
        let x = &place.x - step;
        let (residuals, jacobian, sum) = match (self.evaluate)(&x) {
            Some((r, j)) => {
                let sum = r.norm_squared();
                (r, j, sum)
            }
            None => (
                place.residuals.clone(),
                place.jacobian.clone(),
                f64::INFINITY,
            ),
        };
        Place {
            x,
            residuals,
            jacobian,
            sum,
            scale: place.scale.clone(),
            still: place.still,
        }
        .with_columns()
    }

    fn reached(&self, place: &mut Place, gain: f64, _: usize) -> bool {
        let small = gain < SMALL * (place.sum + gain).max(f64::MIN_POSITIVE);
        place.still = if small { place.still + 1 } else { 0 };
        place.still < STILL && place.sum > 0.0
    }
}

/// Minimises the sum of squares from a starting place. `None` where there is no value at the start.
pub(super) fn minimise(
    start: DVector<f64>,
    evaluate: impl Fn(&DVector<f64>) -> Evaluation,
) -> Option<Optimum> {
    let (residuals, jacobian) = evaluate(&start)?;
    let sum = residuals.norm_squared();
    if !sum.is_finite() {
        return None;
    }
    let place = Place {
        scale: DVector::from_element(start.len(), 0.0),
        x: start,
        residuals,
        jacobian,
        sum,
        still: 0,
    };
    let problem = Residuals { evaluate };
    let (end, _) = least_squares::minimise(&problem, place.with_columns(), &RULES);
    Some(Optimum {
        parameters: end.x,
        sum: end.sum,
        jacobian: end.jacobian,
    })
}

/// Solves `min |J p - r|² + damping |D p|²` by the QR factors of the columns in units of their size.
fn step(
    residuals: &DVector<f64>,
    jacobian: &DMatrix<f64>,
    scale: &DVector<f64>,
    damping: f64,
) -> Option<DVector<f64>> {
    let (m, n) = jacobian.shape();
    let mut stacked = DMatrix::zeros(m + n, n);
    let mut right = DVector::zeros(m + n);
    right.rows_mut(0, m).copy_from(residuals);
    for j in 0..n {
        for i in 0..m {
            stacked[(i, j)] = jacobian[(i, j)] / scale[j];
        }
        stacked[(m + j, j)] = damping.sqrt();
    }
    let p = solve(stacked, right)?;
    Some(p.component_div(scale))
}

/// `min |A x - b|` by Householder's QR; `None` where A has not full rank.
pub(super) fn solve(a: DMatrix<f64>, mut b: DVector<f64>) -> Option<DVector<f64>> {
    let n = a.ncols();
    let qr = a.qr();
    qr.q_tr_mul(&mut b);
    let r = qr.r();
    let x = r.solve_upper_triangular(&b.rows(0, n))?;
    x.iter().all(|x| x.is_finite()).then_some(x)
}

/// `(J'J)^-1`, and the number of directions that the data determine; the others have been given no variance but
/// infinity.
pub(super) fn covariance(jacobian: &DMatrix<f64>) -> (DMatrix<f64>, usize) {
    let n = jacobian.ncols();
    let sizes: Vec<f64> = jacobian
        .column_iter()
        .map(|c| c.norm().max(f64::MIN_POSITIVE.sqrt()))
        .collect();
    let scaled = DMatrix::from_fn(jacobian.nrows(), n, |i, j| jacobian[(i, j)] / sizes[j]);
    let svd = scaled.svd(false, true);
    let Some(v) = svd.v_t else {
        return (DMatrix::from_element(n, n, f64::INFINITY), 0);
    };
    let largest = svd.singular_values.max();
    let mut c = DMatrix::zeros(n, n);
    let mut rank = 0;
    for (k, s) in svd.singular_values.iter().enumerate() {
        let known = *s > 1e-10 * largest;
        rank += usize::from(known);
        let weight = if known { 1.0 / (s * s) } else { 1e30 };
        for i in 0..n {
            for j in 0..n {
                c[(i, j)] += weight * v[(k, i)] * v[(k, j)] / (sizes[i] * sizes[j]);
            }
        }
    }
    (c, rank)
}
