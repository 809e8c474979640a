//! What can be wrong with a design problem.

use super::Float;
use nalgebra::SMatrix;

/// Which matrix of a design problem an error speaks of.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Entry {
    /// The state matrix `A`.
    A,
    /// The input matrix `B`.
    B,
    /// The output matrix `C`.
    C,
    /// The weight of the state, `Q`.
    Q,
    /// The weight of the input, `R`.
    R,
    /// The cross weight of state and input, `N`.
    N,
    /// The covariance of the process noise, `W`.
    W,
    /// The covariance of the measurement noise, `V`.
    V,
    /// The cross covariance of both noises.
    NoiseCross,
    /// The poles that are asked for.
    Poles,
}

impl Entry {
    /// What this entry of a regulator's problem is in the estimator's problem that it stands for.
    fn of_dual(self) -> Self {
        match self {
            Entry::B => Entry::C,
            Entry::Q => Entry::W,
            Entry::R => Entry::V,
            Entry::N => Entry::NoiseCross,
            same => same,
        }
    }
}

impl core::fmt::Display for Entry {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Entry::A => "A",
            Entry::B => "B",
            Entry::C => "C",
            Entry::Q => "Q",
            Entry::R => "R",
            Entry::N => "N",
            Entry::W => "W (process noise)",
            Entry::V => "V (measurement noise)",
            Entry::NoiseCross => "N (cross covariance of the noises)",
            Entry::Poles => "poles",
        })
    }
}

/// Why a design problem has no usable answer. Rows and columns count from 0.
#[derive(Copy, Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DesignError {
    /// An entry is NaN or infinite.
    #[error("{matrix}[{row},{col}] is not a finite number")]
    NotFinite {
        /// The matrix it was found in.
        matrix: Entry,
        /// Its row.
        row: usize,
        /// Its column.
        col: usize,
    },
    /// A weight is not symmetric.
    #[error(
        "{matrix} must be symmetric, but {matrix}[{row},{col}] and {matrix}[{col},{row}] differ by {difference:e}"
    )]
    NotSymmetric {
        /// The weight, `Q` or `R`.
        matrix: Entry,
        /// Row of the larger difference.
        row: usize,
        /// Column of the larger difference.
        col: usize,
        /// `matrix[row,col] - matrix[col,row]`.
        difference: f64,
    },
    /// The weight of the input is not positive definite: some input would cost nothing. Or a covariance: some
    /// measurement would be exact.
    #[error(
        "{matrix} must be positive definite, but its pivot {index} is {pivot:e}; give every input a weight \
         and every measurement a noise above 0"
    )]
    NotPositiveDefinite {
        /// The weight or covariance, `R` or `V`.
        matrix: Entry,
        /// Which pivot of the Cholesky factorisation failed.
        index: usize,
        /// Its value (0 or below).
        pivot: f64,
    },
    /// The input cannot reach an unstable mode, or only through rounding: no feedback stabilises.
    #[error(
        "the input cannot reach a mode of A that is unstable or on the stability boundary, so no feedback \
         stabilises: check A and B, or take that mode out of the model"
    )]
    NotStabilisable,
    /// The measurement does not show an unstable mode, or only through rounding: no estimator is stable.
    #[error(
        "the measurement does not show a mode of A that is unstable or on the stability boundary, so no \
         estimator is stable: check A and C, or measure more"
    )]
    NotDetectable,
    /// The input does not reach every state, so not every pole can be moved.
    #[error(
        "the input reaches only {rank} of the states' directions, so not every pole can be placed: check A \
         and B, or take the others out of the model"
    )]
    NotControllable {
        /// How many directions of the state it reaches.
        rank: usize,
    },
    /// A complex pole without its conjugate: no real gain has it.
    #[error("pole {index} ({re} {im:+}i) lacks its complex conjugate: give both")]
    PoleWithoutConjugate {
        /// Its place in the list.
        index: usize,
        /// Its real part.
        re: f64,
        /// Its imaginary part.
        im: f64,
    },
    /// Feedback could stabilise, but the one of least cost does not.
    #[error(
        "no stabilising solution (measure of stability {measure}, must be below 1): a mode on the \
         stability boundary has no weight (no noise), or [Q, N; N', R] is not positive semidefinite; \
         give every state a weight, and none that is many orders of magnitude from the others"
    )]
    NoStabilisingSolution {
        /// Spectral radius of the best closed loop found (continuous time: of its Cayley transform); NaN where the
        /// iteration broke down.
        measure: f64,
    },
    /// The iteration ended, but what it found does not solve the equation well; a pole of the closed loop
    /// lies next to the stability boundary, or the problem is badly scaled for this precision.
    #[error(
        "the Riccati equation is solved only to {residual:e} (relative; allowed {allowed:e}): give every \
         state a weight, or use f64"
    )]
    NotConverged {
        /// Relative residual of the equation.
        residual: f64,
        /// The largest one accepted.
        allowed: f64,
    },
}

impl DesignError {
    /// The error of a regulator's problem for `(A', C')` in the words of the estimator's problem for `(A, C)` that it
    /// stands for.
    #[must_use]
    pub fn of_dual(self) -> Self {
        match self {
            Self::NotFinite { matrix, row, col } => {
                // A, B are the transposes of A, C.
                let matrix = matrix.of_dual();
                let (row, col) = match matrix {
                    Entry::A | Entry::C => (col, row),
                    _ => (row, col),
                };
                Self::NotFinite { matrix, row, col }
            }
            Self::NotSymmetric {
                matrix,
                row,
                col,
                difference,
            } => Self::NotSymmetric {
                matrix: matrix.of_dual(),
                row,
                col,
                difference,
            },
            Self::NotPositiveDefinite {
                matrix,
                index,
                pivot,
            } => Self::NotPositiveDefinite {
                matrix: matrix.of_dual(),
                index,
                pivot,
            },
            Self::NotStabilisable => Self::NotDetectable,
            other => other,
        }
    }
}

/// Refuses a matrix with an entry that is NaN or infinite.
pub(crate) fn finite<T: Float, const R: usize, const C: usize>(
    m: &SMatrix<T, R, C>,
    matrix: Entry,
) -> Result<(), DesignError> {
    for row in 0..R {
        for col in 0..C {
            if !m[(row, col)].is_finite() {
                return Err(DesignError::NotFinite { matrix, row, col });
            }
        }
    }
    Ok(())
}
