//! Where the poles lie.

use super::Float;
use super::elimination::solve;
use super::lyapunov::squared;
use nalgebra::allocator::Allocator;
use nalgebra::{Complex, Const, DefaultAllocator, DimDiff, DimSub, SMatrix, Schur, U1};

/// Squarings in [`spectral_radius`]: `m^(2^40)` settles the radius to about 1e-11 even for a mode that repeats.
const SQUARINGS: u32 = 40;

/// Largest magnitude among the eigenvalues of `m`, by repeated squaring: `radius = lim |m^(2^k)|^(2^-k)`.
///
/// It needs no eigenvalue decomposition, always ends, and returns NaN where `m` is not finite.
///
/// ```
/// use nalgebra::Matrix2;
/// let turn_and_shrink = Matrix2::new(0.0, -0.5, 0.5, 0.0); // eigenvalues +-0.5i
/// assert!((furuta_ctrl::design::spectral_radius(&turn_and_shrink) - 0.5f64).abs() < 1e-9);
/// ```
pub fn spectral_radius<T: Float, const N: usize>(m: &SMatrix<T, N, N>) -> T {
    if m.iter().any(|x| !x.is_finite()) {
        return T::zero() / T::zero();
    }
    // m^(2^k) = exp(log_scale) * power, with power kept at norm 1; `share` = 2^-k.
    let mut power = *m;
    let mut log_radius = T::zero();
    let mut share = T::one();
    let half: T = nalgebra::convert(0.5);
    for _ in 0..SQUARINGS {
        let size = power.norm();
        if !(size > T::zero()) {
            return T::zero();
        }
        log_radius += share * size.ln();
        power /= size;
        power = squared(&power);
        share *= half;
    }
    log_radius.exp()
}

/// Whether `x[k+1] = a x[k]` dies out: all eigenvalues inside the unit circle.
pub fn is_schur<T: Float, const N: usize>(a: &SMatrix<T, N, N>) -> bool {
    below_one(spectral_radius(a))
}

/// Whether `dx/dt = a x` dies out: all eigenvalues left of the imaginary axis.
///
/// Tested on the Cayley transform `(g + a)(g - a)^-1`, which maps the left half plane into the unit circle.
///
/// ```
/// use nalgebra::Matrix2;
/// assert!(furuta_ctrl::design::is_hurwitz(&Matrix2::new(0.0, 1.0, -2.0, -0.1)));
/// assert!(!furuta_ctrl::design::is_hurwitz(&Matrix2::new(0.0, 1.0, 2.0, -0.1)));
/// ```
pub fn is_hurwitz<T: Float, const N: usize>(a: &SMatrix<T, N, N>) -> bool {
    below_one(cayley_radius(a))
}

/// Whether a spectral radius lies inside the unit circle by more than its own rounding; false for NaN.
fn below_one<T: Float>(radius: T) -> bool {
    radius < T::one() - T::default_epsilon() * nalgebra::convert(16.0)
}

/// Spectral radius of the Cayley transform of `a`: below 1 exactly where `a` is Hurwitz.
pub(crate) fn cayley_radius<T: Float, const N: usize>(a: &SMatrix<T, N, N>) -> T {
    let g = a.norm();
    if g == T::zero() {
        return T::one();
    }
    let shift = SMatrix::<T, N, N>::identity() * g;
    // (g - a) is singular only where a has the eigenvalue g > 0: unstable, and so is the answer 'infinite'.
    match solve(shift - a, shift + a) {
        Some(cayley) => spectral_radius(&cayley),
        None => T::one() / T::zero(),
    }
}

/// The eigenvalues of `a`, in the order the Schur form gives them; `None` where `a` is not finite or the decomposition
/// does not converge.
///
/// ```
/// use nalgebra::Matrix2;
/// let [p, q] = furuta_ctrl::design::poles(&Matrix2::new(0.0f64, 1.0, -2.0, -3.0)).ok_or("no poles")?;
/// assert!((p.re + q.re + 3.0).abs() < 1e-12 && p.im == 0.0);
/// # Ok::<(), &str>(())
/// ```
pub fn poles<T: Float, const N: usize>(a: &SMatrix<T, N, N>) -> Option<[Complex<T>; N]>
where
    Const<N>: DimSub<U1>,
    DefaultAllocator: Allocator<Const<N>, DimDiff<Const<N>, U1>> + Allocator<DimDiff<Const<N>, U1>>,
{
    if a.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let schur = Schur::<T, Const<N>>::try_new(*a, T::default_epsilon(), 100 * N)?;
    let values = schur.complex_eigenvalues();
    Some(core::array::from_fn(|i| values[i]))
}

#[cfg(test)]
mod tests {
    use super::{is_hurwitz, is_schur, poles, spectral_radius};
    use nalgebra::{Matrix1, Matrix2, Matrix3};

    #[test]
    fn radius_of_a_defective_matrix() {
        // Jordan block: |m^k| grows like k * 0.9^(k-1), the slowest case for squaring.
        let jordan = Matrix3::new(0.9f64, 1.0, 0.0, 0.0, 0.9, 1.0, 0.0, 0.0, 0.9);
        assert!((spectral_radius(&jordan) - 0.9).abs() < 1e-9);
        assert!(is_schur(&jordan));
        assert_eq!(
            spectral_radius(&Matrix2::new(0.0, 1.0, 0.0, 0.0)),
            0.0,
            "nilpotent"
        );
        assert!(spectral_radius(&Matrix1::new(f64::NAN)).is_nan());
    }

    #[test]
    fn boundary_is_not_stable() {
        assert!(!is_schur(&Matrix2::new(0.0f64, -1.0, 1.0, 0.0)));
        assert!(!is_hurwitz(&Matrix2::new(0.0f64, 1.0, 0.0, 0.0)));
        assert!(!is_hurwitz(&Matrix1::new(0.0f64)));
        assert!(!is_hurwitz(&Matrix1::new(3.0f64)));
        assert!(!is_hurwitz(&Matrix1::new(f64::NAN)));
    }

    #[test]
    fn poles_of_one_state_and_of_garbage() {
        assert_eq!(poles(&Matrix1::new(-2.5f64)).map(|p| p[0].re), Some(-2.5));
        assert_eq!(poles(&Matrix2::new(f64::NAN, 0.0, 0.0, 1.0)), None);
    }
}
