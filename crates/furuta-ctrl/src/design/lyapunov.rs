//! Lyapunov equations of stable systems, by squaring (Smith 1968): `X = sum of (A')^k Q A^k`, twice as many terms with
//! every step.

use super::Float;
use super::elimination::Lu;
use nalgebra::SMatrix;

/// Squarings at most: a mode within 1e-13 of the boundary has died out after that.
pub(crate) const SQUARINGS: u32 = 46;

/// The `X` that solves `A'XA - X + Q = 0` for `Q = Q'`; `None` where `A` is not stable (its powers do not die out) or
/// not finite.
///
/// ```
/// use furuta_ctrl::design::lyapunov;
/// use nalgebra::Matrix1;
/// let x = lyapunov::discrete(&Matrix1::new(0.5f64), &Matrix1::new(3.0)).ok_or("not stable")?;
/// assert!((x[0] - 4.0).abs() < 1e-14); // 3 / (1 - 0.25)
/// assert!(lyapunov::discrete(&Matrix1::new(1.0), &Matrix1::new(1.0)).is_none());
/// # Ok::<(), &str>(())
/// ```
#[must_use]
pub fn discrete<T: Float, const N: usize>(
    a: &SMatrix<T, N, N>,
    q: &SMatrix<T, N, N>,
) -> Option<SMatrix<T, N, N>> {
    let (mut power, mut x) = (*a, *q);
    for _ in 0..SQUARINGS {
        x += power.transpose() * x * power;
        power = squared(&power);
        let size = power.norm_squared();
        if size < T::default_epsilon() {
            // What is left of the sum is below rounding; the next term settles it.
            x += power.transpose() * x * power;
            let x = symmetric(x);
            return x.iter().all(|v| v.is_finite()).then_some(x);
        }
        if !size.is_finite() {
            return None;
        }
    }
    None
}

/// The `X` that solves `A'X + XA + Q = 0` for `Q = Q'`; `None` where `A` is not stable or not finite.
///
/// ```
/// use furuta_ctrl::design::lyapunov;
/// use nalgebra::Matrix1;
/// let x = lyapunov::continuous(&Matrix1::new(-2.0f64), &Matrix1::new(4.0)).ok_or("not stable")?;
/// assert!((x[0] - 1.0).abs() < 1e-14);
/// assert!(lyapunov::continuous(&Matrix1::new(0.0), &Matrix1::new(1.0)).is_none());
/// # Ok::<(), &str>(())
/// ```
#[must_use]
pub fn continuous<T: Float, const N: usize>(
    a: &SMatrix<T, N, N>,
    q: &SMatrix<T, N, N>,
) -> Option<SMatrix<T, N, N>> {
    let (cayley, inverse) = cayley(a)?;
    let weighted = inverse.transpose() * q * inverse;
    discrete(&cayley, &weighted)
}

/// `(g + a)(g - a)^-1`, whose eigenvalues lie inside the unit circle where those of `a` lie left of the imaginary axis,
/// and `sqrt(2 g) (g - a)^-1`; `g` is of the size of `a`.
pub(crate) fn cayley<T: Float, const N: usize>(
    a: &SMatrix<T, N, N>,
) -> Option<(SMatrix<T, N, N>, SMatrix<T, N, N>)> {
    let g = a.norm();
    let one = SMatrix::<T, N, N>::identity();
    let inverse = Lu::new(one * g - a)?.solve(one);
    Some((inverse * (g + g) - one, inverse * (g + g).sqrt()))
}

/// `m^2`.
///
/// Never inlined: LLVM 22.1 (rustc 1.95 with `opt-level = 3` and thin LTO) vectorises a loop that squares a 2 x 2
/// matrix in place into one that squares something else; without its SLP vectoriser, and in nightly 1.97, the same
/// source is right.
#[inline(never)]
pub(crate) fn squared<T: Float, const N: usize>(m: &SMatrix<T, N, N>) -> SMatrix<T, N, N> {
    m * m
}

/// Half of `m` and its transpose.
pub(crate) fn symmetric<T: Float, const N: usize>(m: SMatrix<T, N, N>) -> SMatrix<T, N, N> {
    (m + m.transpose()) * nalgebra::convert::<f64, T>(0.5)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix2, Matrix3};

    #[test]
    fn residuals_of_slow_and_fast_modes() {
        let a = Matrix3::new(0.999, 5.0, 1.0, 0.0, -0.9, 2.0, 0.0, 0.0, 0.1);
        let q = Matrix3::new(1.0, 0.2, 0.0, 0.2, 3.0, 0.1, 0.0, 0.1, 0.5);
        let x = discrete(&a, &q).expect("stable");
        assert!((a.transpose() * x * a - x + q).norm() < 1e-13 * x.norm());
        let a = Matrix3::new(-1e-3, 5.0, 1.0, 0.0, -9.0, 2.0, 0.0, 0.0, -100.0);
        let x = continuous(&a, &q).expect("stable");
        let xa = x * a;
        assert!((xa + xa.transpose() + q).norm() < 1e-9 * xa.norm());
    }

    #[test]
    fn unstable_marginal_and_nan_are_refused() {
        let q = Matrix2::identity();
        let turn = Matrix2::new(0.0, 1.0, -1.0, 0.0);
        assert_eq!(discrete(&turn, &q), None);
        assert_eq!(continuous(&turn, &q), None);
        assert_eq!(continuous(&(turn + q), &q), None);
        assert_eq!(discrete(&(turn * f64::NAN), &q), None);
        assert_eq!(continuous(&Matrix2::zeros(), &q), None);
    }
}
