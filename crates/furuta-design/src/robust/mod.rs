//! Robust linear-quadratic regulators: one gain for every model in a polytope, with a guaranteed cost.
//!
//! For `dx/dt = A x + B u` with `[A, B]` anywhere in the convex hull of given vertices, also moving about in it however
//! fast, the gain `K` and the matrix `X` satisfy at every vertex
//!
//! ```text
//! (A - B K)' X + X (A - B K) + Q + K'R K <= 0        (continuous)
//! (A - B K)' X (A - B K) - X + Q + K'R K <= 0        (discrete),
//! ```
//!
//! so that the cost from `x` on is at most `x'X x` (quadratic stability with guaranteed cost). In `S = X^-1`, `Y = K S`
//! these are linear matrix inequalities, convex in `[A, B]`: vertices suffice. Of all such `X` the one with the
//! smallest `trace(X X0)` is taken, the mean of the bound over starts with the covariance `X0`. With one vertex this is
//! the LQR, whatever `X0`.
//!
//! Bernussou, Peres, Geromel, *A linear programming oriented procedure for quadratic stabilization of uncertain
//! systems* (Systems & Control Letters 13, 1989); Boyd, El Ghaoui, Feron, Balakrishnan, *Linear Matrix Inequalities in
//! System and Control Theory* (1994), chapters 5 and 7.

mod problem;
mod regulator;

pub use regulator::{Robust, RobustError, Time, Vertex};

use furuta_ctrl::design::Weights;
use nalgebra::SMatrix;
use problem::RobustProblem;

/// The robust regulator for the polytope of these `[A, B]`, with the least mean guaranteed cost over starts of
/// covariance `starts`.
///
/// # Errors
/// [`RobustError`]. That no common quadratic Lyapunov function exists does not mean that no gain stabilises every
/// vertex: it is a sufficient condition.
///
/// ```
/// use furuta_ctrl::design::Weights;
/// use furuta_design::robust::{Time, robust_lqr};
/// use nalgebra::Matrix1;
/// // dx/dt = a x + b u with a = 1, b in [0.8, 1.2]: the weakest input decides.
/// let vertices = [0.8, 1.2].map(|b| (Matrix1::new(1.0), Matrix1::new(b)));
/// let found = robust_lqr(Time::Continuous, &vertices, &Weights::diagonal([1.0], [1.0]), &Matrix1::new(1.0))?;
/// let lqr_of_weakest = (1.0 + (1.0f64 + 0.64).sqrt()) / 0.64;
/// assert!((found.cost[0] / lqr_of_weakest - 1.0).abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn robust_lqr<const N: usize, const M: usize>(
    time: Time,
    vertices: &[Vertex<N, M>],
    weights: &Weights<f64, N, M>,
    starts: &SMatrix<f64, N, N>,
) -> Result<Robust<N, M>, RobustError> {
    check(vertices, starts)?;
    let problem = RobustProblem::new(time, vertices, weights, starts)?;
    let (s, y, gap) = problem.least_cost()?;
    problem.as_given(vertices, weights, starts, &s, &y, gap)
}

/// Whether one gain and one quadratic Lyapunov function stabilise all vertices; no cost is sought.
///
/// # Errors
/// Those of [`robust_lqr`] but the last two.
pub fn stabilisable<const N: usize, const M: usize>(
    time: Time,
    vertices: &[Vertex<N, M>],
    weights: &Weights<f64, N, M>,
) -> Result<bool, RobustError> {
    let starts = SMatrix::identity();
    check(vertices, &starts)?;
    let problem = RobustProblem::new(time, vertices, weights, &starts)?;
    Ok(problem.feasible(&problem.vertices)?.is_some())
}

fn check<const N: usize, const M: usize>(
    vertices: &[Vertex<N, M>],
    starts: &SMatrix<f64, N, N>,
) -> Result<(), RobustError> {
    if vertices.is_empty() {
        return Err(RobustError::Empty);
    }
    for (i, (a, b)) in vertices.iter().enumerate() {
        if !a.iter().chain(b.iter()).all(|v| v.is_finite()) {
            return Err(RobustError::NotFinite {
                what: format!("vertex {i}"),
            });
        }
    }
    if !starts.iter().all(|v| v.is_finite()) {
        return Err(RobustError::NotFinite {
            what: "X0".to_owned(),
        });
    }
    let lopsided = (starts - starts.transpose()).amax() > 1e-12 * starts.amax();
    if lopsided || starts.cholesky().is_none() {
        return Err(RobustError::Starts);
    }
    Ok(())
}
