//! Algebraic Riccati equations by structure-preserving doubling.
//!
//! Each doubling step does the work of as many steps of the Riccati difference equation as all steps before it together, so the
//! error squares from step to step: six to twelve steps suffice for ordinary problems. Method: E. K.-W. Chu, H.-Y. Fan, W.-W. Lin,
//! P.-C. Wang, *Structure-preserving algorithms for periodic discrete-time algebraic Riccati equations* (Int. J. Control 77, 2004)
//! and, for continuous time by way of a Cayley transform, E. K.-W. Chu, H.-Y. Fan, W.-W. Lin, *A structure-preserving doubling
//! algorithm for continuous-time algebraic Riccati equations* (Linear Algebra Appl. 396, 2005).

use super::elimination::solve;
use super::stability::{cayley_radius, spectral_radius};
use super::{DesignError, Entry, Float, Weights, as_f64};
use nalgebra::SMatrix;

/// Doublings at most: enough for a closed loop whose slowest pole is within 1e-14 of the stability boundary.
const DOUBLINGS: u32 = 60;

/// Stabilising solution of a Riccati equation.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Solution<T: Float, const N: usize, const M: usize> {
    /// The symmetric matrix `X`; `x' X x` is the cost still to come from state `x`.
    pub x: SMatrix<T, N, N>,
    /// The gain that belongs to it, `u = -K x`.
    pub gain: SMatrix<T, M, N>,
    /// `A - B K`, checked to be stable.
    pub closed_loop: SMatrix<T, N, N>,
    /// What is left of the equation, relative to the size of its terms.
    pub residual: T,
    /// Doubling steps taken.
    pub iterations: u32,
}

/// Solves `A'XA - X - (A'XB + N)(R + B'XB)^-1 (B'XA + N') + Q = 0` for the stabilising `X`;
/// gain `K = (R + B'XB)^-1 (B'XA + N')`, closed loop `A - BK` inside the unit circle.
///
/// # Errors
/// [`DesignError`]: weights not symmetric, `R` not positive definite, entries not finite, no stabilising solution, or not solved well
/// in this precision.
///
/// ```
/// use furuta_ctrl::design::{Weights, riccati};
/// use nalgebra::Matrix1;
/// // x[k+1] = 2 x[k] + u[k], cost x^2 + u^2: X = 2 + sqrt(5), the golden ratio cubed.
/// let weights = Weights::diagonal([1.0f64], [1.0]);
/// let s = riccati::discrete(&Matrix1::new(2.0), &Matrix1::new(1.0), &weights)?;
/// assert!((s.x[0] - (2.0 + 5.0f64.sqrt())).abs() < 1e-14);
/// # Ok::<(), furuta_ctrl::design::DesignError>(())
/// ```
pub fn discrete<T: Float, const N: usize, const M: usize>(
    a: &SMatrix<T, N, N>,
    b: &SMatrix<T, N, M>,
    weights: &Weights<T, N, M>,
) -> Result<Solution<T, N, M>, DesignError> {
    let p = Problem::new(a, b, weights)?;
    let evaluate = |x: SMatrix<T, N, N>, iterations| {
        let xb = x * b;
        let xa = x * a;
        let gain = solve(
            weights.r + b.transpose() * xb,
            b.transpose() * xa + weights.n.transpose(),
        )?;
        let left = a.transpose() * xa - x - (a.transpose() * xb + weights.n) * gain + weights.q;
        let scale = x.norm() + (a.transpose() * xa).norm() + weights.q.norm();
        Some(Candidate::new(
            x,
            gain,
            a - b * gain,
            left,
            scale,
            iterations,
            spectral_radius,
        ))
    };
    // The plain iteration misses a solution in which an unstable mode without weight is turned back: it would start and stay at 0
    // there. Solving for the difference from a positive definite matrix finds it.
    let shifts = [T::zero(), p.shift()];
    best(shifts.into_iter().map(|shift| {
        let start = SMatrix::identity() * shift;
        let through = SMatrix::identity() + p.g * start;
        let (af, gf) = if shift > T::zero() {
            (solve(through, p.a)?, solve(through, p.g)?)
        } else {
            (p.a, p.g)
        };
        let hf = p.h - start + p.a.transpose() * start * af;
        let (difference, iterations) = double(
            af,
            symmetric(gf),
            if shift > T::zero() {
                symmetric(hf)
            } else {
                p.h
            },
        )?;
        evaluate(start + difference, iterations)
    }))
}

/// Solves `A'X + XA - (XB + N) R^-1 (B'X + N') + Q = 0` for the stabilising `X`;
/// gain `K = R^-1 (B'X + N')`, closed loop `A - BK` left of the imaginary axis.
///
/// # Errors
/// As for [`discrete`].
///
/// ```
/// use furuta_ctrl::design::{Weights, riccati};
/// use nalgebra::Matrix1;
/// // dx/dt = x + u, cost x^2 + u^2: X = 1 + sqrt(2), closed loop at -sqrt(2).
/// let weights = Weights::diagonal([1.0f64], [1.0]);
/// let s = riccati::continuous(&Matrix1::new(1.0), &Matrix1::new(1.0), &weights)?;
/// assert!((s.x[0] - (1.0 + 2.0f64.sqrt())).abs() < 1e-14);
/// # Ok::<(), furuta_ctrl::design::DesignError>(())
/// ```
pub fn continuous<T: Float, const N: usize, const M: usize>(
    a: &SMatrix<T, N, N>,
    b: &SMatrix<T, N, M>,
    weights: &Weights<T, N, M>,
) -> Result<Solution<T, N, M>, DesignError> {
    let p = Problem::new(a, b, weights)?;
    let evaluate = |x: SMatrix<T, N, N>, iterations| {
        let xb = x * b + weights.n;
        let gain = solve(weights.r, xb.transpose())?;
        let xa = x * a;
        let left = xa + xa.transpose() - xb * gain + weights.q;
        let scale = xa.norm() + (xb * gain).norm() + weights.q.norm();
        Some(Candidate::new(
            x,
            gain,
            a - b * gain,
            left,
            scale,
            iterations,
            cayley_radius,
        ))
    };
    // The centre of the Cayley transform only has to miss the eigenvalues of A and sit among the sizes of the closed-loop poles; a
    // second one is tried in case the first is unlucky.
    let size =
        p.a.norm()
            .max((p.g.norm() * p.h.norm()).sqrt())
            .max(T::default_epsilon());
    let [small, large]: [T; 2] = [0.3, 1.7].map(nalgebra::convert);
    let tries = [
        (small, T::zero()),
        (large, T::zero()),
        (small, p.shift()),
        (large, p.shift()),
    ];
    best(tries.into_iter().map(|(centre, shift)| {
        let start = SMatrix::identity() * shift;
        let af = p.a - p.g * start;
        let hf =
            p.h + symmetric(p.a.transpose() * start + start * p.a) - symmetric(start * p.g * start);
        let (difference, iterations) = double_cayley(af, p.g, hf, size * centre)?;
        evaluate(start + difference, iterations)
    }))
}

/// The equation without its cross term: `A - B R^-1 N'`, `B R^-1 B'`, `Q - N R^-1 N'`.
struct Problem<T: Float, const N: usize> {
    a: SMatrix<T, N, N>,
    g: SMatrix<T, N, N>,
    h: SMatrix<T, N, N>,
}

impl<T: Float, const N: usize> Problem<T, N> {
    fn new<const M: usize>(
        a: &SMatrix<T, N, N>,
        b: &SMatrix<T, N, M>,
        weights: &Weights<T, N, M>,
    ) -> Result<Self, DesignError> {
        finite(a, Entry::A)?;
        finite(b, Entry::B)?;
        finite(&weights.n, Entry::N)?;
        check_symmetric(&weights.q, Entry::Q)?;
        check_symmetric(&weights.r, Entry::R)?;
        check_positive_definite(&weights.r)?;
        let not_found = DesignError::NoStabilisingSolution { measure: f64::NAN };
        let rb = solve(weights.r, b.transpose()).ok_or(not_found)?;
        let rn = solve(weights.r, weights.n.transpose()).ok_or(not_found)?;
        Ok(Self {
            a: a - b * rn,
            g: symmetric(b * rb),
            h: symmetric(weights.q - weights.n * rn),
        })
    }

    /// Size of the matrix to start from where 0 does not lead to the stabilising solution.
    fn shift(&self) -> T {
        let control = self.g.norm();
        if control > T::zero() {
            (T::one() + self.a.norm()) / control
        } else {
            T::one()
        }
    }
}

/// Doubling of `(A, G, H)`: `H` tends to the solution of `X = A'X(I + GX)^-1 A + H`, `A` to 0 where that solution stabilises.
/// `None` where it breaks down.
fn double<T: Float, const N: usize>(
    mut a: SMatrix<T, N, N>,
    mut g: SMatrix<T, N, N>,
    mut h: SMatrix<T, N, N>,
) -> Option<(SMatrix<T, N, N>, u32)> {
    for k in 1..=DOUBLINGS {
        let w = SMatrix::identity() + g * h;
        let wa = solve(w, a)?;
        let wg = solve(w, g)?;
        let at = a.transpose();
        let step = symmetric(at * h * wa);
        g += symmetric(a * wg * at);
        a *= wa;
        h += step;
        let (change, size) = (step.norm(), h.norm());
        if !size.is_finite() || !a.norm().is_finite() {
            return None;
        }
        if change <= T::default_epsilon() * size {
            return Some((h, k));
        }
    }
    Some((h, DOUBLINGS))
}

/// The Cayley transform with centre `c` of the continuous equation `A'X + XA - XGX + H = 0`, then doubling.
fn double_cayley<T: Float, const N: usize>(
    a: SMatrix<T, N, N>,
    g: SMatrix<T, N, N>,
    h: SMatrix<T, N, N>,
    c: T,
) -> Option<(SMatrix<T, N, N>, u32)> {
    let one = SMatrix::<T, N, N>::identity();
    let ac = a - one * c;
    let ag = solve(ac, g)?;
    let ha = solve(ac.transpose(), h)?.transpose();
    let w = solve(ac.transpose() + h * ag, one)?;
    let twice = c + c;
    double(
        one + w.transpose() * twice,
        symmetric(ag * w * twice),
        symmetric(w * ha * twice),
    )
}

/// A matrix that an iteration ended at, with how good it is.
struct Candidate<T: Float, const N: usize, const M: usize> {
    solution: Solution<T, N, M>,
    /// Spectral radius of the closed loop (continuous time: of its Cayley transform).
    radius: T,
}

impl<T: Float, const N: usize, const M: usize> Candidate<T, N, M> {
    fn new(
        x: SMatrix<T, N, N>,
        gain: SMatrix<T, M, N>,
        closed_loop: SMatrix<T, N, N>,
        left: SMatrix<T, N, N>,
        scale: T,
        iterations: u32,
        radius: impl Fn(&SMatrix<T, N, N>) -> T,
    ) -> Self {
        let residual = if scale > T::zero() {
            left.norm() / scale
        } else {
            left.norm()
        };
        let radius = radius(&closed_loop);
        Self {
            solution: Solution {
                x,
                gain,
                closed_loop,
                residual,
                iterations,
            },
            radius,
        }
    }
}

/// The first candidate that stabilises and solves the equation; otherwise the reason why the best one does not.
fn best<T: Float, const N: usize, const M: usize>(
    candidates: impl Iterator<Item = Option<Candidate<T, N, M>>>,
) -> Result<Solution<T, N, M>, DesignError> {
    // Half of the digits. For the residual: far above what rounding leaves of a sound problem, far below what a wrong solution
    // shows. For stability: a mode on the boundary is a double root of the equation, which rounding moves by as much.
    let allowed = T::default_epsilon().sqrt();
    let mut reason = DesignError::NoStabilisingSolution { measure: f64::NAN };
    for candidate in candidates.flatten() {
        let Candidate { solution, radius } = candidate;
        if radius < T::one() - allowed {
            if solution.residual <= allowed {
                return Ok(solution);
            }
            reason = DesignError::NotConverged {
                residual: as_f64(solution.residual),
                allowed: as_f64(allowed),
            };
        } else if let DesignError::NoStabilisingSolution { measure } = reason {
            let radius = as_f64(radius);
            let smaller = if measure.is_nan() {
                radius
            } else {
                radius.min(measure)
            };
            reason = DesignError::NoStabilisingSolution { measure: smaller };
        }
    }
    Err(reason)
}

fn symmetric<T: Float, const N: usize>(m: SMatrix<T, N, N>) -> SMatrix<T, N, N> {
    (m + m.transpose()) * nalgebra::convert::<f64, T>(0.5)
}

fn finite<T: Float, const N: usize, const M: usize>(
    m: &SMatrix<T, N, M>,
    matrix: Entry,
) -> Result<(), DesignError> {
    for row in 0..N {
        for col in 0..M {
            if !m[(row, col)].is_finite() {
                return Err(DesignError::NotFinite { matrix, row, col });
            }
        }
    }
    Ok(())
}

fn check_symmetric<T: Float, const N: usize>(
    m: &SMatrix<T, N, N>,
    matrix: Entry,
) -> Result<(), DesignError> {
    finite(m, matrix)?;
    // Rounding while a weight is put together, C'C for instance, leaves differences of a few units in the last place.
    let allowed = m.amax() * T::default_epsilon() * nalgebra::convert(100.0);
    for row in 0..N {
        for col in 0..row {
            let difference = m[(row, col)] - m[(col, row)];
            if difference.abs() > allowed {
                return Err(DesignError::NotSymmetric {
                    matrix,
                    row,
                    col,
                    difference: as_f64(difference),
                });
            }
        }
    }
    Ok(())
}

/// Cholesky's pivots, all of which must be above 0.
fn check_positive_definite<T: Float, const M: usize>(
    r: &SMatrix<T, M, M>,
) -> Result<(), DesignError> {
    let mut l = *r;
    for k in 0..M {
        let pivot = l[(k, k)];
        if !(pivot > T::zero()) {
            return Err(DesignError::NotPositiveDefinite {
                index: k,
                pivot: as_f64(pivot),
            });
        }
        for i in k + 1..M {
            let factor = l[(i, k)] / pivot;
            for j in k + 1..M {
                l[(i, j)] = l[(i, j)] - factor * l[(k, j)];
            }
        }
    }
    Ok(())
}
