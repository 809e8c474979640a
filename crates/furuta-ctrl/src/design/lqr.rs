//! Linear-quadratic regulators.

use super::riccati;
use super::{DesignError, Float, poles};
use nalgebra::allocator::Allocator;
use nalgebra::{Complex, Const, DefaultAllocator, DimDiff, DimSub, SMatrix, SVector, U1};

/// What a regulator minimises: the sum (discrete time) or integral (continuous time) of `x'Qx + u'Ru + 2x'Nu`.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Weights<T: Float, const N: usize, const M: usize> {
    /// Weight of the state, symmetric.
    pub q: SMatrix<T, N, N>,
    /// Weight of the input, symmetric, positive definite.
    pub r: SMatrix<T, M, M>,
    /// Cross weight of state and input.
    pub n: SMatrix<T, N, M>,
}

impl<T: Float, const N: usize, const M: usize> Weights<T, N, M> {
    /// Full weights without a cross term.
    pub fn new(q: SMatrix<T, N, N>, r: SMatrix<T, M, M>) -> Self {
        Self {
            q,
            r,
            n: SMatrix::zeros(),
        }
    }

    /// Diagonal weights: one number per state, one per input.
    pub fn diagonal(q: [T; N], r: [T; M]) -> Self {
        Self::new(
            SMatrix::from_diagonal(&SVector::from(q)),
            SMatrix::from_diagonal(&SVector::from(r)),
        )
    }

    /// Bryson's rule: weights `1/limit^2`, so that every state and input at its own limit costs the same.
    pub fn bryson(state_limits: [T; N], input_limits: [T; M]) -> Self {
        let inverse_square = |limit: T| T::one() / (limit * limit);
        Self::diagonal(
            state_limits.map(inverse_square),
            input_limits.map(inverse_square),
        )
    }

    /// The same weights with a cross term.
    #[must_use]
    pub fn with_cross(mut self, n: SMatrix<T, N, M>) -> Self {
        self.n = n;
        self
    }
}

/// A designed regulator `u = -K x`.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Regulator<T: Float, const N: usize, const M: usize> {
    /// The gain `K`.
    pub gain: SMatrix<T, M, N>,
    /// The cost matrix `S`: from state `x` on, the cost is `x' S x`.
    pub cost: SMatrix<T, N, N>,
    /// `A - B K`; stable.
    pub closed_loop: SMatrix<T, N, N>,
}

impl<T: Float, const N: usize, const M: usize> Regulator<T, N, M> {
    /// Poles of the closed loop; `None` where the eigenvalue iteration does not converge (not seen, but it has no
    /// guarantee).
    pub fn poles(&self) -> Option<[Complex<T>; N]>
    where
        Const<N>: DimSub<U1>,
        DefaultAllocator:
            Allocator<Const<N>, DimDiff<Const<N>, U1>> + Allocator<DimDiff<Const<N>, U1>>,
    {
        poles(&self.closed_loop)
    }

    fn new(a: &SMatrix<T, N, N>, b: &SMatrix<T, N, M>, s: riccati::Solution<T, N, M>) -> Self {
        Self {
            gain: s.gain,
            cost: s.x,
            closed_loop: a - b * s.gain,
        }
    }
}

/// Regulator for the sampled system `x[k+1] = A x[k] + B u[k]`.
///
/// # Errors
/// Those of [`riccati::discrete`].
pub fn dlqr<T: Float, const N: usize, const M: usize>(
    a: &SMatrix<T, N, N>,
    b: &SMatrix<T, N, M>,
    weights: &Weights<T, N, M>,
) -> Result<Regulator<T, N, M>, DesignError> {
    riccati::discrete(a, b, weights).map(|s| Regulator::new(a, b, s))
}

/// Regulator for the continuous system `dx/dt = A x + B u`.
///
/// # Errors
/// Those of [`riccati::continuous`].
///
/// ```
/// use furuta_ctrl::design::{Weights, lqr};
/// use nalgebra::{Matrix2, Vector2};
/// // Double integrator, Q = I, R = 1: K = [1, sqrt(3)].
/// let weights = Weights::diagonal([1.0, 1.0], [1.0]);
/// let k = lqr(&Matrix2::new(0.0, 1.0, 0.0, 0.0), &Vector2::new(0.0f64, 1.0), &weights)?.gain;
/// assert!((k[0] - 1.0).abs() < 1e-14 && (k[1] - 3.0f64.sqrt()).abs() < 1e-14);
/// # Ok::<(), furuta_ctrl::design::DesignError>(())
/// ```
pub fn lqr<T: Float, const N: usize, const M: usize>(
    a: &SMatrix<T, N, N>,
    b: &SMatrix<T, N, M>,
    weights: &Weights<T, N, M>,
) -> Result<Regulator<T, N, M>, DesignError> {
    riccati::continuous(a, b, weights).map(|s| Regulator::new(a, b, s))
}
