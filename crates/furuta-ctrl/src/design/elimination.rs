//! Linear systems of a few unknowns: LU factors with row pivoting.

use super::Float;
use nalgebra::SMatrix;

/// `P A = L U` of a small matrix, for any number of right-hand sides.
///
/// nalgebra's `try_inverse` uses cofactors up to 4 x 4, which costs digits that a Riccati iteration cannot spare.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Lu<T: Float, const N: usize> {
    /// `L` below the diagonal, `U` above; on the diagonal the reciprocals of `U`'s.
    factors: SMatrix<T, N, N>,
    /// The row that was exchanged with row `k` in step `k`.
    exchanged: [usize; N],
}

impl<T: Float, const N: usize> Lu<T, N> {
    /// The factors, or `None` where `a` is singular to working precision or holds what is not a number.
    pub(crate) fn new(mut a: SMatrix<T, N, N>) -> Option<Self> {
        let mut exchanged = [0; N];
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
            exchanged[k] = pivot;
            if pivot != k {
                a.swap_rows(k, pivot);
            }
            let inverse = T::one() / a[(k, k)];
            a[(k, k)] = inverse;
            for i in k + 1..N {
                a[(i, k)] *= inverse;
            }
            for j in k + 1..N {
                let above = a[(k, j)];
                for i in k + 1..N {
                    a[(i, j)] = a[(i, j)] - a[(i, k)] * above;
                }
            }
        }
        Some(Self {
            factors: a,
            exchanged,
        })
    }

    /// `a^-1 b`.
    pub(crate) fn solve<const M: usize>(&self, mut b: SMatrix<T, N, M>) -> SMatrix<T, N, M> {
        let a = &self.factors;
        for (k, &row) in self.exchanged.iter().enumerate() {
            if row != k {
                b.swap_rows(k, row);
            }
        }
        // By columns of the transpose: all right-hand sides at once, side by side in memory.
        let mut x = b.transpose();
        for k in 0..N {
            let known = x.column(k).into_owned();
            for i in k + 1..N {
                let factor = a[(i, k)];
                for j in 0..M {
                    x[(j, i)] -= factor * known[j];
                }
            }
        }
        for k in (0..N).rev() {
            let known = x.column(k) * a[(k, k)];
            x.set_column(k, &known);
            for i in 0..k {
                let factor = a[(i, k)];
                for j in 0..M {
                    x[(j, i)] -= factor * known[j];
                }
            }
        }
        x.transpose()
    }
}

/// `a^-1 b`, or `None` where `a` is singular to working precision or holds what is not a number.
pub(crate) fn solve<T: Float, const N: usize, const M: usize>(
    a: SMatrix<T, N, N>,
    b: SMatrix<T, N, M>,
) -> Option<SMatrix<T, N, M>> {
    Lu::new(a).map(|lu| lu.solve(b))
}

/// The lower triangular `L` of `a = L L'`, or which pivot is not above 0 and what it is.
pub(crate) fn cholesky<T: Float, const N: usize>(
    a: &SMatrix<T, N, N>,
) -> Result<SMatrix<T, N, N>, (usize, T)> {
    let mut l = SMatrix::<T, N, N>::zeros();
    for k in 0..N {
        let mut pivot = a[(k, k)];
        for j in 0..k {
            pivot -= l[(k, j)] * l[(k, j)];
        }
        if !(pivot > T::zero()) || !pivot.is_finite() {
            return Err((k, pivot));
        }
        let root = pivot.sqrt();
        l[(k, k)] = root;
        for i in k + 1..N {
            let mut sum = a[(i, k)];
            for j in 0..k {
                sum -= l[(i, j)] * l[(k, j)];
            }
            l[(i, k)] = sum / root;
        }
    }
    Ok(l)
}

/// `L^-1 b` for a lower triangular `L` whose diagonal is above 0.
pub(crate) fn forward<T: Float, const N: usize, const M: usize>(
    l: &SMatrix<T, N, N>,
    mut b: SMatrix<T, N, M>,
) -> SMatrix<T, N, M> {
    for j in 0..M {
        for k in 0..N {
            let mut sum = b[(k, j)];
            for i in 0..k {
                sum -= l[(k, i)] * b[(i, j)];
            }
            b[(k, j)] = sum / l[(k, k)];
        }
    }
    b
}

/// `L'^-1 b` for a lower triangular `L` whose diagonal is above 0.
pub(crate) fn backward<T: Float, const N: usize, const M: usize>(
    l: &SMatrix<T, N, N>,
    mut b: SMatrix<T, N, M>,
) -> SMatrix<T, N, M> {
    for j in 0..M {
        for k in (0..N).rev() {
            let mut sum = b[(k, j)];
            for i in k + 1..N {
                sum -= l[(i, k)] * b[(i, j)];
            }
            b[(k, j)] = sum / l[(k, k)];
        }
    }
    b
}

#[cfg(test)]
mod tests {
    use super::{backward, cholesky, forward, solve};
    use nalgebra::{Matrix2, SMatrix, SVector, Vector2};

    #[test]
    fn a_zero_on_the_diagonal_needs_a_row_swap() {
        let a = SMatrix::<f64, 2, 2>::new(0.0, 2.0, 4.0, 1.0);
        assert_eq!(
            solve(a, SVector::<f64, 2>::new(6.0, 7.0)),
            Some(SVector::<f64, 2>::new(1.0, 3.0))
        );
    }

    #[test]
    fn every_order_of_rows() {
        // A permuted triangle: each step has to fetch its pivot from elsewhere.
        #[rustfmt::skip]
        let a = SMatrix::<f64, 4, 4>::from_row_slice(&[
            0.0, 0.0, 0.0, 4.0,
            8.0, 1.0, 2.0, 3.0,
            0.0, 0.0, 2.0, 5.0,
            0.0, 4.0, 1.0, 1.0,
        ]);
        let x = SVector::<f64, 4>::new(1.0, -2.0, 3.0, -4.0);
        assert_eq!(solve(a, a * x), Some(x));
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

    #[test]
    fn cholesky_factor() {
        let a = Matrix2::new(4.0f64, 2.0, 2.0, 10.0);
        let l = cholesky(&a).expect("positive definite");
        assert_eq!(l, Matrix2::new(2.0, 0.0, 1.0, 3.0));
        let b = Vector2::new(2.0, 7.0);
        assert_eq!(forward(&l, b), Vector2::new(1.0, 2.0));
        assert_eq!(l.transpose() * backward(&l, b), b);
        assert_eq!(
            cholesky(&Matrix2::new(1.0, 2.0, 2.0, 1.0)),
            Err((1, -3.0f64))
        );
    }
}
