//! Algebraic Riccati equations by structure-preserving doubling.
//!
//! Each doubling step does the work of as many steps of the Riccati difference equation as all steps before it
//! together, so the error squares from step to step: six to twelve steps suffice for ordinary problems. Method: E.
//! K.-W. Chu, H.-Y. Fan, W.-W. Lin, C.-S. Wang, *Structure-preserving algorithms for periodic discrete-time algebraic
//! Riccati equations* (Int. J. Control 77, 2004) and, for continuous time by way of a Cayley transform, E. K.-W. Chu,
//! H.-Y. Fan, W.-W. Lin, *A structure-preserving doubling algorithm for continuous-time algebraic Riccati equations*
//! (Linear Algebra Appl. 396, 2005).
//!
//! Around it:
//!
//! 1. The weight of the input is made 1 by its Cholesky factor, the states are scaled by powers of two until the
//!    Hamiltonian matrix is balanced: states in micrometres beside inputs in kilovolts cost no digits.
//! 2. The result is refined by Newton's method until the residual is at rounding, and refused where it stays above
//!    1e-10 of the equation's terms (f32: 4e-5), in scaled or in given units.
//! 3. The closed loop is checked to be stable by squaring it until it has died out, and to stay so when the last digits
//!    of the problem change: a mode that only rounding connects to the input is not called controllable.
//! 4. Where there is no solution, the problem with unit weights tells why: [`DesignError::NotStabilisable`] if that has
//!    none either, [`DesignError::NoStabilisingSolution`] if the weights are to blame.

mod doubling;
mod equation;
mod verify;

use super::{DesignError, Float, Weights};
use equation::RiccatiEquation;
use nalgebra::SMatrix;
use verify::Time;

/// Stabilising solution of a Riccati equation.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Solution<T: Float, const N: usize, const M: usize> {
    /// The symmetric matrix `X`; `x' X x` is the cost still to come from state `x`.
    pub x: SMatrix<T, N, N>,
    /// The gain that belongs to it, `u = -K x`; `A - B K` is stable.
    pub gain: SMatrix<T, M, N>,
    /// Norm of what is left of the equation over the sum of the norms of its terms.
    pub residual: T,
    /// Doubling steps taken.
    pub iterations: u32,
}

/// Solves `A'XA - X - (A'XB + N)(R + B'XB)^-1 (B'XA + N') + Q = 0` for the stabilising `X`;
/// gain `K = (R + B'XB)^-1 (B'XA + N')`, closed loop `A - BK` inside the unit circle.
///
/// # Errors
/// [`DesignError`]: weights not symmetric, `R` not positive definite, entries not finite, no stabilising solution
/// (and why), or not solved well in this precision.
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
    solve(Time::Discrete, a, b, weights)
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
    solve(Time::Continuous, a, b, weights)
}

fn solve<T: Float, const N: usize, const M: usize>(
    time: Time,
    a: &SMatrix<T, N, N>,
    b: &SMatrix<T, N, M>,
    weights: &Weights<T, N, M>,
) -> Result<Solution<T, N, M>, DesignError> {
    let is_solved = |p: &RiccatiEquation<T, N, M>| attempt(time, p).is_ok();
    attempt(time, &RiccatiEquation::new(a, b, weights)?).map_err(|reason| match reason {
        DesignError::NoStabilisingSolution { .. }
            if !RiccatiEquation::with_unit_weights(a, b).is_ok_and(|p| is_solved(&p)) =>
        {
            DesignError::NotStabilisable
        }
        other => other,
    })
}

/// The first start that leads to a solution; otherwise why the best one is none.
fn attempt<T: Float, const N: usize, const M: usize>(
    time: Time,
    p: &RiccatiEquation<T, N, M>,
) -> Result<Solution<T, N, M>, DesignError> {
    let mut reason = DesignError::NoStabilisingSolution { measure: f64::NAN };
    // The plain iteration misses a solution in which an unstable mode without weight is turned back: it would start and
    // stay at 0 there. Solving for the difference from a positive definite matrix finds it.
    for shift in [T::zero(), p.shift()] {
        // The centre of the Cayley transform only has to miss the eigenvalues of A and sit among the sizes of the
        // closed-loop poles; others are tried in case the first is unlucky.
        let centres: &[f64] = match time {
            Time::Discrete => &[1.0],
            Time::Continuous => &[0.3, 1.7, 0.02],
        };
        for &centre in centres {
            let found = match time {
                Time::Discrete => doubling::discrete(p, shift),
                Time::Continuous => {
                    let size = p.free.norm().max((p.g.norm() * p.h.norm()).sqrt());
                    let size = size.max(T::default_epsilon());
                    doubling::continuous(p, size * nalgebra::convert(centre), shift)
                }
            };
            let Some((x, iterations)) = found else {
                continue;
            };
            match p.verify(time, x, shift, iterations) {
                Ok(solution) => return Ok(solution),
                Err(found) => reason = better(reason, found),
            }
        }
    }
    Err(reason)
}

/// Of two reasons the one that came nearer to a solution.
fn better(one: DesignError, other: DesignError) -> DesignError {
    use DesignError::{NoStabilisingSolution, NotConverged};
    match (one, other) {
        (NotConverged { residual: a, .. }, NotConverged { residual: b, .. }) if b < a => other,
        (NotConverged { .. }, _) => one,
        (NoStabilisingSolution { measure: a }, NoStabilisingSolution { measure: b }) if a <= b => {
            one
        }
        _ => other,
    }
}
