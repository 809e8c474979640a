//! Transfer functions of linear models, by polynomials.

use nalgebra::{RealField, RowSVector, SMatrix, SVector};

/// The angle that is looked at.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Output {
    /// The arm's.
    Theta,
    /// The pendulum's.
    Alpha,
}

impl Output {
    /// The column's name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Theta => "theta",
            Self::Alpha => "alpha",
        }
    }
}

/// `G(s) = (n_0 + n_1 s + ... ) / (d_0 + d_1 s + ... + d_(N-1) s^(N-1) + s^N)`: coefficients by rising power, the
/// leading 1 left out.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct TransferFunction<T, const N: usize> {
    /// `n_0, ..., n_(N-1)`.
    pub numerator: [T; N],
    /// `d_0, ..., d_(N-1)` of the monic denominator, whose roots are the poles.
    pub denominator: [T; N],
}

/// `c (s I - A)^-1 b` of `x' = A x + b u`, `y = c x`, by the Faddeev-LeVerrier recursion.
///
/// Exact in exact arithmetic; in floating point meant for a handful of states of like size, as here. Poles and zeros
/// that cancel are kept.
///
/// ```
/// use furuta_model::transfer::transfer_function;
/// use nalgebra::{matrix, vector};
/// // A mass on a spring with damping: 1 / (s² + 0.5 s + 4).
/// let g = transfer_function(&matrix![0.0, 1.0; -4.0, -0.5], &vector![0.0, 1.0], &matrix![1.0, 0.0]);
/// assert_eq!((g.numerator, g.denominator), ([1.0, 0.0], [4.0, 0.5]));
/// ```
#[must_use]
pub fn transfer_function<T: RealField + Copy, const N: usize>(
    a: &SMatrix<T, N, N>,
    b: &SVector<T, N>,
    c: &RowSVector<T, N>,
) -> TransferFunction<T, N> {
    let mut numerator = [T::zero(); N];
    let mut denominator = [T::zero(); N];
    // adj(s I - A) = M_1 s^(N-1) + ... + M_N with M_1 = I, M_(k+1) = A M_k + d_(N-k) I, d_(N-k) = -trace(A M_k) / k.
    let identity = SMatrix::<T, N, N>::identity();
    let mut m = identity;
    let mut k = T::one();
    for power in (0..N).rev() {
        numerator[power] = (c * m * b)[0];
        let am = a * m;
        let d = -am.trace() / k;
        denominator[power] = d;
        m = am + identity * d;
        k += T::one();
    }
    TransferFunction {
        numerator,
        denominator,
    }
}

#[cfg(test)]
mod tests {
    use super::transfer_function;
    use nalgebra::{matrix, vector};

    #[test]
    fn a_companion_matrix_gives_its_coefficients_back() {
        let a = matrix![0.0, 1.0, 0.0; 0.0, 0.0, 1.0; -6.0, -11.0, -5.0];
        let g = transfer_function(&a, &vector![0.0, 0.0, 1.0], &matrix![7.0, 3.0, 2.0]);
        assert_eq!(g.denominator, [6.0, 11.0, 5.0]);
        assert_eq!(g.numerator, [7.0, 3.0, 2.0]);
    }
}
