//! Nonlinear least squares by Levenberg and Marquardt, for a handful of parameters.

use nalgebra::{DMatrix, DVector};

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

/// Steps that may be tried.
const TRIALS: usize = 200;

/// Minimises the sum of squares from a starting place. `None` where there is no value at the start.
pub(super) fn minimise(
    start: DVector<f64>,
    evaluate: impl Fn(&DVector<f64>) -> Evaluation,
) -> Option<Optimum> {
    let mut x = start;
    let (mut residuals, mut jacobian) = evaluate(&x)?;
    let mut sum = residuals.norm_squared();
    if !sum.is_finite() {
        return None;
    }
    let mut damping = 1e-3;
    // The largest column each parameter has had: what a step is measured in (Moré).
    let mut scale = DVector::from_element(x.len(), 0.0);
    let mut still = 0;
    for _ in 0..TRIALS {
        for (s, column) in scale.iter_mut().zip(jacobian.column_iter()) {
            *s = column.norm().max(*s).max(f64::MIN_POSITIVE.sqrt());
        }
        let Some(step) = step(&residuals, &jacobian, &scale, damping) else {
            damping *= 10.0;
            continue;
        };
        let trial = &x - &step;
        let better = evaluate(&trial)
            .map(|(r, j)| (r.norm_squared(), r, j))
            .filter(|(s, ..)| *s < sum);
        match better {
            Some((s, r, j)) => {
                let gain = (sum - s) / sum.max(f64::MIN_POSITIVE);
                (x, residuals, jacobian, sum) = (trial, r, j, s);
                damping = (damping * 0.2).max(1e-12);
                still = if gain < 1e-10 { still + 1 } else { 0 };
                if still >= 3 || sum == 0.0 {
                    break;
                }
            }
            None => {
                damping *= 4.0;
                if damping > 1e12 {
                    break;
                }
            }
        }
    }
    Some(Optimum {
        parameters: x,
        sum,
        jacobian,
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

/// `(J'J)^-1`, and the number of directions that the data determine; the others have been given no variance but infinity.
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
