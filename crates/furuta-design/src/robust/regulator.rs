//! A robust regulator, and why there is none.

use furuta_ctrl::design::{DesignError, Weights, riccati};
use nalgebra::SMatrix;

/// What linear algebra that breaks down is reported as.
pub(super) const BROKEN: RobustError = RobustError::Broken;

/// Continuous or sampled system.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Time {
    /// `dx/dt = A x + B u`
    Continuous,
    /// `x[k+1] = A x[k] + B u[k]`
    Discrete,
}

impl Time {
    /// The regulator of one model.
    pub(super) fn solve<const N: usize, const M: usize>(
        self,
        (a, b): &Vertex<N, M>,
        weights: &Weights<f64, N, M>,
    ) -> Result<riccati::Solution<f64, N, M>, RobustError> {
        match self {
            Self::Continuous => riccati::continuous(a, b, weights),
            Self::Discrete => riccati::discrete(a, b, weights),
        }
        .map_err(RobustError::Nominal)
    }
}

/// `(A, B)`.
pub type Vertex<const N: usize, const M: usize> = (SMatrix<f64, N, N>, SMatrix<f64, N, M>);

/// A robust regulator `u = -K x`.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Robust<const N: usize, const M: usize> {
    /// The gain `K`.
    pub gain: SMatrix<f64, M, N>,
    /// From `x` on, the cost is at most `x' X x` for every model in the polytope.
    pub cost: SMatrix<f64, N, N>,
    /// `trace(X X0)`: the mean of that bound.
    pub guaranteed: f64,
    /// The least such mean lies at most this share of it below.
    pub gap: f64,
}

/// Why there is no robust regulator.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RobustError {
    /// Not even the mean of the vertices has a regulator.
    #[error("at the mean of the vertices: {0}")]
    Nominal(DesignError),
    /// Rounding, in a problem whose numbers are of too unlike sizes.
    #[error("the design broke down by rounding: weights or vertices of too unlike sizes")]
    Broken,
    /// No vertices.
    #[error("no vertices are given")]
    Empty,
    /// A vertex or the covariance of starts holds what is no finite number.
    #[error("{what} holds a number that is not finite")]
    NotFinite {
        /// Which.
        what: String,
    },
    /// The covariance of starts is not symmetric and positive definite.
    #[error("X0 must be symmetric and positive definite")]
    Starts,
    /// No gain and no common quadratic Lyapunov function stabilise all vertices.
    #[error(
        "no gain stabilises all {vertices} vertices with one quadratic Lyapunov function; {reached:.2} of \
         the way from their mean to them it goes: take a range smaller by about that, or fewer \
         parameters"
    )]
    NotQuadraticallyStabilisable {
        /// How many vertices there are.
        vertices: usize,
        /// What part of the range can be stabilised, 0 to 1.
        reached: f64,
    },
    /// A gain was found, but the inequalities do not hold for it to working precision.
    #[error(
        "a gain was found, but its guarantee does not hold to working precision (vertex {vertex} exceeds \
         it by {excess:e} of its terms): the vertices are nearly not stabilisable together; take a \
         smaller range"
    )]
    NotCertified {
        /// The vertex at which it does not.
        vertex: usize,
        /// By how much, relative.
        excess: f64,
    },
}
