//! Steady-state Kalman gains: the dual of the linear-quadratic regulator.
//!
//! A regulator for `(A', C')` with the covariances as weights is, transposed, the estimator of least variance for
//! `(A, C)`.

use super::elimination::solve;
use super::riccati::{self, Solution};
use super::{DesignError, Float, Weights};
use nalgebra::{SMatrix, SVector};

/// What disturbs the system: covariances (discrete time) or spectral densities (continuous time) of zero-mean white
/// noise.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Noise<T: Float, const N: usize, const P: usize> {
    /// Of the noise `w` that is added to the state's equation, symmetric. Noise that enters through `G`: `G W G'`.
    pub process: SMatrix<T, N, N>,
    /// Of the noise `v` that is added to the measurement, symmetric, positive definite.
    pub measurement: SMatrix<T, P, P>,
    /// `E[w v']`.
    pub cross: SMatrix<T, N, P>,
}

impl<T: Float, const N: usize, const P: usize> Noise<T, N, P> {
    /// Noises that know nothing of each other.
    pub fn new(process: SMatrix<T, N, N>, measurement: SMatrix<T, P, P>) -> Self {
        Self {
            process,
            measurement,
            cross: SMatrix::zeros(),
        }
    }

    /// Independent noises: one variance per state, one per measurement.
    pub fn diagonal(process: [T; N], measurement: [T; P]) -> Self {
        Self::new(
            SMatrix::from_diagonal(&SVector::from(process)),
            SMatrix::from_diagonal(&SVector::from(measurement)),
        )
    }

    /// The same noises, correlated.
    #[must_use]
    pub fn with_cross(mut self, cross: SMatrix<T, N, P>) -> Self {
        self.cross = cross;
        self
    }

    fn as_weights(&self) -> Weights<T, N, P> {
        Weights::new(self.process, self.measurement).with_cross(self.cross)
    }
}

/// A designed estimator.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Estimator<T: Float, const N: usize, const P: usize> {
    /// The gain `L` on the innovation `y - C xhat`. Discrete time: of the predictor
    /// `xhat[k+1] = A xhat[k] + B u[k] + L (y[k] - C xhat[k])`, as in python-control and MATLAB's `kalman`.
    pub gain: SMatrix<T, N, P>,
    /// Covariance of the estimate's error; discrete time: before the measurement.
    pub covariance: SMatrix<T, N, N>,
    /// `A - L C`; stable.
    pub closed_loop: SMatrix<T, N, N>,
}

impl<T: Float, const N: usize, const P: usize> Estimator<T, N, P> {
    fn new(a: &SMatrix<T, N, N>, c: &SMatrix<T, P, N>, s: Solution<T, N, P>) -> Self {
        let gain = s.gain.transpose();
        Self {
            gain,
            covariance: s.x,
            closed_loop: a - gain * c,
        }
    }

    /// The gain `M` that corrects with a measurement of the same instant,
    /// `xhat[k|k] = xhat[k|k-1] + M (y[k] - C xhat[k|k-1])`: `P C'(C P C' + V)^-1` (discrete time). `None` where that
    /// matrix is singular.
    pub fn filter_gain(
        &self,
        c: &SMatrix<T, P, N>,
        noise: &Noise<T, N, P>,
    ) -> Option<SMatrix<T, N, P>> {
        let cp = c * self.covariance;
        solve(cp * c.transpose() + noise.measurement, cp).map(|m| m.transpose())
    }
}

/// Steady-state Kalman gain for `dx/dt = A x + B u + w`, `y = C x + v`.
///
/// # Errors
/// Those of [`riccati::continuous`] in the words of estimation: [`DesignError::NotDetectable`] where the measurement
/// does not show an unstable mode.
///
/// ```
/// use furuta_ctrl::design::{Noise, lqe};
/// use nalgebra::Matrix1;
/// // dx/dt = -x + w, y = x + v, both of density 1: P = sqrt(2) - 1.
/// let e = lqe(&Matrix1::new(-1.0f64), &Matrix1::new(1.0), &Noise::diagonal([1.0], [1.0]))?;
/// assert!((e.gain[0] - (2.0f64.sqrt() - 1.0)).abs() < 1e-14);
/// # Ok::<(), furuta_ctrl::design::DesignError>(())
/// ```
pub fn lqe<T: Float, const N: usize, const P: usize>(
    a: &SMatrix<T, N, N>,
    c: &SMatrix<T, P, N>,
    noise: &Noise<T, N, P>,
) -> Result<Estimator<T, N, P>, DesignError> {
    riccati::continuous(&a.transpose(), &c.transpose(), &noise.as_weights())
        .map(|s| Estimator::new(a, c, s))
        .map_err(DesignError::of_dual)
}

/// Steady-state Kalman gain for `x[k+1] = A x[k] + B u[k] + w[k]`, `y[k] = C x[k] + v[k]`.
///
/// # Errors
/// Those of [`riccati::discrete`] in the words of estimation: [`DesignError::NotDetectable`] where the measurement does
/// not show an unstable mode.
///
/// ```
/// use furuta_ctrl::design::{Noise, dlqe};
/// use nalgebra::Matrix1;
/// // A random walk, seen with noise of the same variance: the golden ratio.
/// let (walk, noise) = (Matrix1::new(1.0), Noise::diagonal([1.0f64], [1.0]));
/// let e = dlqe(&walk, &walk, &noise)?;
/// let golden = 0.5 * (1.0 + 5.0f64.sqrt());
/// assert!((e.covariance[0] - golden).abs() < 1e-14);
/// let filter = e.filter_gain(&walk, &noise).ok_or("singular")?;
/// assert!((filter[0] - (golden - 1.0)).abs() < 1e-14);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
pub fn dlqe<T: Float, const N: usize, const P: usize>(
    a: &SMatrix<T, N, N>,
    c: &SMatrix<T, P, N>,
    noise: &Noise<T, N, P>,
) -> Result<Estimator<T, N, P>, DesignError> {
    riccati::discrete(&a.transpose(), &c.transpose(), &noise.as_weights())
        .map(|s| Estimator::new(a, c, s))
        .map_err(DesignError::of_dual)
}
