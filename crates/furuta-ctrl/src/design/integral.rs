//! Regulators with integral action: the integral of an output is a further state, so that a constant disturbance (a
//! cable that pulls at the arm, an offset of the amplifier) leaves no lasting error.

use super::{DesignError, Float, Regulator, Weights, dlqr, lqr};
use crate::real::{Real, c};
use furuta_model::discretize::zero_order_hold;
use nalgebra::{RowSVector, SMatrix, SVector};

/// `(A, B)` with the integral of `y = C x` behind the last state: `[A, 0; C, 0]`, `[B; 0]`. `NI` must be `N + 1`.
pub fn with_integral<T: Float, const N: usize, const NI: usize, const M: usize>(
    a: &SMatrix<T, N, N>,
    b: &SMatrix<T, N, M>,
    c: &RowSVector<T, N>,
) -> (SMatrix<T, NI, NI>, SMatrix<T, NI, M>) {
    augment(a, b, c, T::zero())
}

/// The integral of a smooth signal over a sample of `h` seconds, from its value and its rate at both ends, `[y, y']`:
/// `h (y0 + y1)/2 + h² (y0' - y1')/12`, of the cubic through them. What is left out is `h⁵/720` of the fourth
/// derivative.
///
/// ```
/// use furuta_ctrl::design::integral_over_sample;
/// // y = t³ from 0 to 2: 4.
/// assert_eq!(integral_over_sample(2.0, [0.0, 0.0], [8.0, 12.0]), 4.0);
/// ```
pub fn integral_over_sample<T: Real>(h: T, from: [T; 2], to: [T; 2]) -> T {
    h * (c::<T>(0.5) * (from[0] + to[0]) + h * c(1.0 / 12.0) * (from[1] - to[1]))
}

/// The sampled `(A, B)` with the sum `s[k+1] = s[k] + h C x[k]` behind the last state. `NI` must be `N + 1`.
pub fn with_sum<T: Float, const N: usize, const NI: usize, const M: usize>(
    a: &SMatrix<T, N, N>,
    b: &SMatrix<T, N, M>,
    c: &RowSVector<T, N>,
    h: T,
) -> (SMatrix<T, NI, NI>, SMatrix<T, NI, M>) {
    augment(a, b, &(c * h), T::one())
}

fn augment<T: Float, const N: usize, const NI: usize, const M: usize>(
    a: &SMatrix<T, N, N>,
    b: &SMatrix<T, N, M>,
    c: &RowSVector<T, N>,
    keep: T,
) -> (SMatrix<T, NI, NI>, SMatrix<T, NI, M>) {
    const { assert!(NI == N + 1, "one state more, the integral") };
    let a = SMatrix::from_fn(|i, j| match (i < N, j < N) {
        (true, true) => a[(i, j)],
        (false, true) => c[j],
        (true, false) => T::zero(),
        (false, false) => keep,
    });
    let b = SMatrix::from_fn(|i, j| if i < N { b[(i, j)] } else { T::zero() });
    (a, b)
}

/// Regulator for `dx/dt = A x + B u` with the integral of `y = C x`: `u = -K [x; integral of y]`. `NI` must be `N + 1`.
///
/// # Errors
/// Those of [`lqr`]. The integral needs a weight, and `B` must reach `y` at frequency 0, or there is no solution.
///
/// ```
/// use furuta_ctrl::design::{Weights, lqi};
/// use furuta_model::{Rig, State, linearize};
/// use nalgebra::RowVector4;
/// let rig = Rig::builtin("qube-servo-2").ok_or("no such rig")?;
/// let up = linearize(&rig.nominal_plant(), State::upright(), 0.0);
/// let arm = RowVector4::new(1.0, 0.0, 0.0, 0.0);
/// let weights = Weights::<f64, 5, 1>::diagonal([5.0, 1.0, 0.1, 0.1, 20.0], [0.1]);
/// let regulator = lqi(&up.a, &up.b, &arm, &weights)?;
/// assert!(regulator.poles().ok_or("no poles")?.iter().all(|p| p.re < 0.0));
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
pub fn lqi<T: Float, const N: usize, const NI: usize, const M: usize>(
    a: &SMatrix<T, N, N>,
    b: &SMatrix<T, N, M>,
    c: &RowSVector<T, N>,
    weights: &Weights<T, NI, M>,
) -> Result<Regulator<T, NI, M>, DesignError> {
    let (a, b) = with_integral(a, b, c);
    lqr(&a, &b, weights)
}

/// Regulator for `dx/dt = A x + B u` whose command is held for `h` seconds, with the integral of `y = C x`: `u = -K [x;
/// integral of y]`. `NI` must be `N + 1`.
///
/// Exact: the integral is a state of the continuous system and is sampled with it ([`zero_order_hold`]), so between two
/// samples it grows by what `y` does there and not by `h C x[k]`.
///
/// # Errors
/// Those of [`dlqr`]. The integral needs a weight, and `B` must reach `y` at frequency 0, or there is no solution.
///
/// ```
/// use furuta_ctrl::design::{Weights, sampled_lqi};
/// use nalgebra::Matrix1;
/// // dx/dt = u: x[k+1] = x + h u, and the integral grows by h x + h² u/2.
/// let one = Matrix1::new(1.0_f64);
/// let weights = Weights::diagonal([1.0, 1.0], [1.0]);
/// let k = sampled_lqi::<_, 1, 2>(&Matrix1::new(0.0), &one, &one, 0.5, &weights)?.gain;
/// assert!((k[0] - 1.314_202).abs() < 1e-6 && (k[1] - 0.651_402).abs() < 1e-6); // SciPy's solve_discrete_are
/// # Ok::<(), furuta_ctrl::design::DesignError>(())
/// ```
pub fn sampled_lqi<T: Float, const N: usize, const NI: usize>(
    a: &SMatrix<T, N, N>,
    b: &SVector<T, N>,
    c: &RowSVector<T, N>,
    h: T,
    weights: &Weights<T, NI, 1>,
) -> Result<Regulator<T, NI, 1>, DesignError> {
    let (a, b) = with_integral::<T, N, NI, 1>(a, b, c);
    let (a, b) = zero_order_hold(&a, &b, h);
    dlqr(&a, &b, weights)
}

/// Regulator for `x[k+1] = A x[k] + B u[k]`, a system that is known at its samples only, with the sum `s[k+1] = s[k] +
/// h C x[k]`: `u = -K [x; s]`. `NI` must be `N + 1`. Where the system of continuous time is known, take
/// [`sampled_lqi`]: this sum is Euler's rule for the integral.
///
/// # Errors
/// Those of [`dlqr`]. The sum needs a weight, and `B` must reach `y` at frequency 0, or there is no solution.
pub fn dlqi<T: Float, const N: usize, const NI: usize, const M: usize>(
    a: &SMatrix<T, N, N>,
    b: &SMatrix<T, N, M>,
    c: &RowSVector<T, N>,
    h: T,
    weights: &Weights<T, NI, M>,
) -> Result<Regulator<T, NI, M>, DesignError> {
    let (a, b) = with_sum(a, b, c, h);
    dlqr(&a, &b, weights)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix1, Matrix2, RowSVector, Vector2};

    #[test]
    fn a_constant_disturbance_leaves_no_error() {
        // x[k+1] = x[k] + 0.1 (u + 3): without the sum it would settle beside 0.
        let (a, b, c) = (
            Matrix1::new(1.0f64),
            Matrix1::new(0.1),
            RowSVector::<f64, 1>::new(1.0),
        );
        let k = dlqi::<f64, 1, 2, 1>(&a, &b, &c, 0.1, &Weights::diagonal([1.0, 1.0], [1.0]))
            .expect("has a solution")
            .gain;
        let (mut x, mut sum) = (1.0, 0.0);
        for _ in 0..500 {
            let u = -(k[0] * x + k[1] * sum);
            sum += 0.1 * x;
            x += 0.1 * (u + 3.0);
        }
        assert!(
            x.abs() < 1e-9 && (k[1] * sum - 3.0).abs() < 1e-9,
            "{x} {sum}"
        );
    }

    #[test]
    fn an_output_that_the_input_cannot_hold_has_no_integral_action() {
        // A speed cannot be led to another value than 0 while the position is also held.
        let (a, b) = (Matrix2::new(0.0f64, 1.0, 0.0, 0.0), Vector2::new(0.0, 1.0));
        let found = lqi::<f64, 2, 3, 1>(
            &a,
            &b,
            &RowSVector::<f64, 2>::new(0.0, 1.0),
            &Weights::diagonal([1.0; 3], [1.0]),
        );
        assert_eq!(found, Err(DesignError::NotStabilisable));
    }
}
