//! Linear matrix inequalities: minimise a convex `f(x)` so that every `F_k(x) = F_k0 + sum_i x_i F_ki` is positive
//! definite.
//!
//! A barrier method (Nesterov and Nemirovskii; Boyd and Vandenberghe, *Convex Optimization*, chapter 11): Newton's
//! method on `t f(x) - sum_k log det F_k(x)` for growing `t`. On the way, the matrices `Z_k = F_k^-1 / t` are feasible
//! for the dual problem up to the Newton step that is left, so that the distance from the optimum is known: the sum of
//! the sizes of the `F_k`, over `t`.
//!
//! Why not a solver's semidefinite cone: those of the Rust crates need LAPACK, that is a Fortran compiler or a download
//! when building. The problems here have a few dozen unknowns, for which dense algebra in Rust suffices. The tests
//! compare with Clarabel, whose Python wheel brings its own.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// How the barrier's weight grows from one centre to the next.
const GROWTH: f64 = 12.0;
/// Steps shorter than this part of what is safe for a self-concordant function are rounding.
const SHORTEST: f64 = 1e-3;
/// How often the first centre is sought with a smaller weight.
const TRIES: u32 = 10;
/// Newton steps for one centre at most; ten are usual.
const STEPS: u32 = 80;

/// `F(x) = constant + sum_i x_i of[i]`, symmetric; coefficients that are 0 are left out.
#[derive(Clone, Debug)]
pub(crate) struct Block {
    pub(crate) constant: DMatrix<f64>,
    pub(crate) of: Vec<Option<DMatrix<f64>>>,
}

impl Block {
    /// The block of an affine function of `unknowns` numbers.
    pub(crate) fn of_affine(unknowns: usize, f: impl Fn(&[f64]) -> DMatrix<f64>) -> Self {
        let mut x = vec![0.0; unknowns];
        let constant = f(&x);
        let of = (0..unknowns)
            .map(|i| {
                x[i] = 1.0;
                let coefficient = f(&x) - &constant;
                x[i] = 0.0;
                (coefficient.amax() > 0.0).then_some(coefficient)
            })
            .collect();
        Self { constant, of }
    }

    fn at(&self, x: &DVector<f64>) -> DMatrix<f64> {
        let mut value = self.constant.clone();
        for (coefficient, x) in self.of.iter().zip(x.iter()) {
            if let Some(coefficient) = coefficient {
                value += coefficient * *x;
            }
        }
        value
    }
}

/// What is minimised.
#[derive(Clone, Debug)]
pub(crate) enum Objective {
    /// `c'x`
    Linear(DVector<f64>),
    /// `trace(W S(x)^-1)` for a positive definite `W`, where `S` is the block with this number.
    InverseTrace {
        /// `W`.
        weight: DMatrix<f64>,
        /// Which block is `S`.
        of: usize,
    },
}

impl Objective {
    fn value(&self, x: &DVector<f64>, factors: &[Factor]) -> f64 {
        match self {
            Self::Linear(c) => c.dot(x),
            Self::InverseTrace { weight, of } => factors[*of].solve(weight).trace(),
        }
    }

    /// Adds `t` times gradient and (below the diagonal) second derivatives.
    fn derivatives(
        &self,
        t: f64,
        blocks: &[Block],
        factors: &[Factor],
        gradient: &mut DVector<f64>,
        hessian: &mut DMatrix<f64>,
    ) {
        match self {
            Self::Linear(c) => *gradient += c * t,
            Self::InverseTrace { weight, of } => {
                let inverse = factors[*of].inverse();
                let outer = &inverse * weight * &inverse;
                // trace(W S^-1) has the derivatives -trace(P S_i) with P = S^-1 W S^-1, and 2 trace(P S_i S^-1 S_j).
                let each: Vec<_> = blocks[*of]
                    .of
                    .iter()
                    .enumerate()
                    .filter_map(|(i, s)| s.as_ref().map(|s| (i, s, &inverse * s * &outer)))
                    .collect();
                for (n, (i, one, _)) in each.iter().enumerate() {
                    gradient[*i] -= t * outer.dot(one);
                    for (j, _, through) in &each[n..] {
                        hessian[(*j, *i)] += 2.0 * t * through.dot(one);
                    }
                }
            }
        }
    }
}

type Factor = Cholesky<f64, Dyn>;

/// How a minimisation ended.
#[derive(Clone, Debug)]
pub(crate) struct Minimum {
    pub(crate) x: DVector<f64>,
    /// The optimum lies at most this far below `f(x)`.
    pub(crate) gap: f64,
}

/// Minimises `f(x)` from a strictly feasible `x`, until the gap is below `tolerance` times the size of `f(x)`, or until
/// `enough` says so.
///
/// `None` where the start is not strictly feasible or the linear algebra breaks down before anything is reached.
pub(crate) fn minimise(
    objective: &Objective,
    blocks: &[Block],
    start: DVector<f64>,
    tolerance: f64,
    enough: impl Fn(&DVector<f64>) -> bool,
) -> Option<Minimum> {
    let sizes = sizes(blocks);
    let mut x = start;
    let first = objective.value(&x, &factors(blocks, &x)?);
    let mut weight = sizes / (1e-3 + first.abs());
    let mut gap = f64::INFINITY;
    let mut tries = TRIES;
    loop {
        let centred = centre(objective, blocks, &mut x, weight, &enough);
        if centred {
            gap = sizes / weight;
        } else if gap.is_infinite() && tries > 0 {
            // Far from a first centre: one that is nearer, under a smaller weight.
            tries -= 1;
            weight /= GROWTH;
            continue;
        }
        let size = objective.value(&x, &factors(blocks, &x)?).abs();
        // Where rounding ends the centring, the last gap that was reached stands.
        if !centred || gap <= tolerance * (size + tolerance) || enough(&x) {
            return gap.is_finite().then_some(Minimum { x, gap });
        }
        weight *= GROWTH;
    }
}

/// Whether every `F_k(x)` is positive definite.
pub(crate) fn strictly_inside(blocks: &[Block], x: &DVector<f64>) -> bool {
    factors(blocks, x).is_some()
}

fn sizes(blocks: &[Block]) -> f64 {
    blocks.iter().map(|b| b.constant.nrows()).sum::<usize>() as f64
}

/// Newton's method on the barrier function with this weight; whether it arrived.
fn centre(
    objective: &Objective,
    blocks: &[Block],
    x: &mut DVector<f64>,
    weight: f64,
    enough: &impl Fn(&DVector<f64>) -> bool,
) -> bool {
    let unknowns = x.len();
    for _ in 0..STEPS {
        let Some(all) = factors(blocks, x) else {
            return false;
        };
        let mut gradient = DVector::zeros(unknowns);
        let mut hessian = DMatrix::<f64>::zeros(unknowns, unknowns);
        objective.derivatives(weight, blocks, &all, &mut gradient, &mut hessian);
        for (block, factor) in blocks.iter().zip(&all) {
            // L^-1 F_i L'^-1: traces of their products are the derivatives of log det.
            let scaled: Vec<(usize, DMatrix<f64>)> = block
                .of
                .iter()
                .enumerate()
                .filter_map(|(i, coefficient)| {
                    let half = factor
                        .l_dirty()
                        .solve_lower_triangular(coefficient.as_ref()?)?;
                    let whole = factor.l_dirty().solve_lower_triangular(&half.transpose())?;
                    Some((i, whole))
                })
                .collect();
            for (n, (i, one)) in scaled.iter().enumerate() {
                gradient[*i] -= one.trace();
                for (j, other) in &scaled[n..] {
                    hessian[(*j, *i)] += one.dot(other);
                }
            }
        }
        hessian.fill_upper_triangle_with_lower_triangle();
        let Some(newton) = newton(hessian, &gradient) else {
            return false;
        };
        let decrement = -gradient.dot(&newton);
        if !decrement.is_finite() {
            return false;
        }
        // The gap is then known to a hundredth.
        if decrement <= 1e-4 {
            return true;
        }
        let now = barrier(objective, &all, x, weight);
        let value = |step: f64| {
            let next = &*x + &newton * step;
            let all = factors(blocks, &next)?;
            Some(barrier(objective, &all, &next, weight))
        };
        // Within 1 / (1 + decrement's root) a step is safe for a self-concordant barrier; the full one is tried first.
        // Where it serves, longer ones are tried too: from far inside a corner a full step only doubles the distance
        // from it.
        let falls = |step: f64, value: Option<f64>| {
            value.is_some_and(|value| value <= now - 0.1 * step * decrement)
        };
        let safe = 1.0 / (1.0 + decrement.sqrt());
        let mut step = 1.0;
        let mut reached = value(step);
        while !falls(step, reached) {
            if step < SHORTEST * safe {
                // Descent no longer shows in the barrier's value: rounding.
                return decrement < 1.0;
            }
            step *= 0.5;
            reached = value(step);
        }
        while step >= 1.0 && decrement > 1.0 {
            let longer = value(2.0 * step);
            if !longer.is_some_and(|longer| reached.is_some_and(|reached| longer < reached)) {
                break;
            }
            (step, reached) = (2.0 * step, longer);
        }
        *x += &newton * step;
        if enough(x) {
            return true;
        }
    }
    false
}

/// `-H^-1 g`, the unknowns scaled such that `H` has ones on its diagonal: they may be of very unlike sizes.
fn newton(mut hessian: DMatrix<f64>, gradient: &DVector<f64>) -> Option<DVector<f64>> {
    let scale = hessian.diagonal().map(|d| 1.0 / d.sqrt());
    if !scale.iter().all(|s| s.is_finite()) {
        return None;
    }
    for i in 0..scale.len() {
        for j in 0..scale.len() {
            hessian[(i, j)] *= scale[i] * scale[j];
        }
        // As much as rounding leaves undecided.
        hessian[(i, i)] += 1e-14;
    }
    let step = Cholesky::new(hessian)?.solve(&-gradient.component_mul(&scale));
    Some(step.component_mul(&scale))
}

fn factors(blocks: &[Block], x: &DVector<f64>) -> Option<Vec<Factor>> {
    blocks.iter().map(|b| Cholesky::new(b.at(x))).collect()
}

fn barrier(objective: &Objective, all: &[Factor], x: &DVector<f64>, weight: f64) -> f64 {
    let log_det: f64 = all
        .iter()
        .map(|f| 2.0 * f.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>())
        .sum();
    weight * objective.value(x, all) - log_det
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The largest eigenvalue of a matrix: minimise s with s I - M positive definite.
    #[test]
    fn largest_eigenvalue() {
        let m = DMatrix::from_row_slice(3, 3, &[2.0, 1.0, 0.0, 1.0, 3.0, -0.5, 0.0, -0.5, 1.0]);
        let block = Block::of_affine(1, |x| DMatrix::identity(3, 3) * x[0] - &m);
        let found = minimise(
            &Objective::Linear(DVector::from_element(1, 1.0)),
            &[block],
            DVector::from_element(1, 10.0),
            1e-9,
            |_| false,
        )
        .expect("feasible start");
        let expected = m.symmetric_eigenvalues().max();
        assert!(
            found.x[0] >= expected && found.x[0] - expected <= found.gap * 1.2,
            "{}",
            found.x[0]
        );
        assert!(found.gap < 1e-8);
    }

    /// A disc as a matrix inequality: minimise x + y on x^2 + y^2 <= 2.
    #[test]
    fn linear_function_on_a_disc() {
        let r = 2f64.sqrt();
        let block = Block::of_affine(2, |x| {
            DMatrix::from_row_slice(2, 2, &[r + x[0], x[1], x[1], r - x[0]])
        });
        let cost = DVector::from_element(2, 1.0);
        let found = minimise(
            &Objective::Linear(cost.clone()),
            &[block],
            DVector::zeros(2),
            1e-10,
            |_| false,
        )
        .expect("feasible start");
        assert!(
            (found.x[0] + 1.0).abs() < 1e-4 && (found.x[1] + 1.0).abs() < 1e-4,
            "{}",
            found.x
        );
        assert!((cost.dot(&found.x) + 2.0).abs() < 1e-9);
    }

    /// trace(W S^-1) over S <= M: S = M; and its derivatives agree with differences.
    #[test]
    fn trace_of_an_inverse() {
        let unknown = |x: &[f64]| DMatrix::from_row_slice(2, 2, &[x[0], x[1], x[1], x[2]]);
        let m = DMatrix::from_row_slice(2, 2, &[3.0, 1.0, 1.0, 2.0]);
        let blocks = [
            Block::of_affine(3, unknown),
            Block::of_affine(3, |x| &m - unknown(x)),
        ];
        let weight = DMatrix::from_row_slice(2, 2, &[1.0, 0.4, 0.4, 2.0]);
        let objective = Objective::InverseTrace {
            weight: weight.clone(),
            of: 0,
        };
        let start = DVector::from_vec(vec![1.0, 0.1, 0.5]);
        let at = |x: &DVector<f64>| {
            let all = factors(&blocks, x).expect("feasible");
            let (mut g, mut h) = (DVector::zeros(3), DMatrix::zeros(3, 3));
            objective.derivatives(1.0, &blocks, &all, &mut g, &mut h);
            (objective.value(x, &all), g, h)
        };
        let (_, gradient, hessian) = at(&start);
        for i in 0..3 {
            let step = DVector::from_fn(3, |j, _| if i == j { 1e-5 } else { 0.0 });
            let (above, below) = (at(&(&start + &step)), at(&(&start - &step)));
            assert!((gradient[i] - (above.0 - below.0) / 2e-5).abs() < 1e-7);
            for j in i..3 {
                assert!((hessian[(j, i)] - (above.1[j] - below.1[j]) / 2e-5).abs() < 1e-6);
            }
        }
        let found = minimise(&objective, &blocks, start, 1e-9, |_| false).expect("feasible start");
        let expected = (weight * m.try_inverse().expect("regular")).trace();
        assert!((at(&found.x).0 - expected).abs() < 1e-8 * expected);
    }

    #[test]
    fn a_start_outside_is_refused() {
        let block = Block::of_affine(1, |x| DMatrix::from_element(1, 1, x[0]));
        assert!(
            minimise(
                &Objective::Linear(DVector::from_element(1, 1.0)),
                &[block],
                DVector::from_element(1, -1.0),
                1e-9,
                |_| false
            )
            .is_none()
        );
    }
}
