//! Linear systems of a few unknowns: Gaussian elimination with row pivoting.

use super::Float;
use nalgebra::SMatrix;

/// `a^-1 b`, or `None` where `a` is singular to working precision or holds what is not a number.
///
/// nalgebra's `try_inverse` uses cofactors up to 4 x 4, which costs digits that a Riccati iteration cannot spare.
pub(crate) fn solve<T: Float, const N: usize, const M: usize>(
    mut a: SMatrix<T, N, N>,
    mut b: SMatrix<T, N, M>,
) -> Option<SMatrix<T, N, M>> {
    for k in 0..N {
        let mut pivot = k;
        for i in k + 1..N {
            if a[(i, k)].abs() > a[(pivot, k)].abs() {
                pivot = i;
            }
        }
        let size = a[(pivot, k)].abs();
        if !(size > T::zero()) || !size.is_finite() {
            return None;
        }
        if pivot != k {
            a.swap_rows(k, pivot);
            b.swap_rows(k, pivot);
        }
        let inverse = T::one() / a[(k, k)];
        for i in k + 1..N {
            let factor = a[(i, k)] * inverse;
            for j in k + 1..N {
                a[(i, j)] = a[(i, j)] - factor * a[(k, j)];
            }
            for j in 0..M {
                b[(i, j)] = b[(i, j)] - factor * b[(k, j)];
            }
        }
    }
    for k in (0..N).rev() {
        for j in 0..M {
            let mut sum = b[(k, j)];
            for i in k + 1..N {
                sum -= a[(k, i)] * b[(i, j)];
            }
            b[(k, j)] = sum / a[(k, k)];
        }
    }
    Some(b)
}

#[cfg(test)]
mod tests {
    use super::solve;
    use nalgebra::{SMatrix, SVector};

    #[test]
    fn a_zero_on_the_diagonal_needs_a_row_swap() {
        let a = SMatrix::<f64, 2, 2>::new(0.0, 2.0, 4.0, 1.0);
        assert_eq!(
            solve(a, SVector::<f64, 2>::new(6.0, 7.0)),
            Some(SVector::<f64, 2>::new(1.0, 3.0))
        );
    }

    #[test]
    fn singular_and_nan_are_refused() {
        let b = SVector::<f64, 2>::new(1.0, 1.0);
        assert_eq!(
            solve(SMatrix::<f64, 2, 2>::new(1.0, 2.0, 2.0, 4.0), b),
            None
        );
        assert_eq!(
            solve(SMatrix::<f64, 2, 2>::new(f64::NAN, 2.0, 2.0, 4.0), b),
            None
        );
    }
}
