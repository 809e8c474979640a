//! What can be wrong with a design problem.

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
        })
    }
}

/// Why a Riccati equation has no usable answer. Rows and columns count from 0.
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
    /// The weight of the input is not positive definite: some input would cost nothing.
    #[error(
        "R must be positive definite, but its pivot {index} is {pivot:e}; give every input a weight above 0"
    )]
    NotPositiveDefinite {
        /// Which pivot of the Cholesky factorisation failed.
        index: usize,
        /// Its value (0 or below).
        pivot: f64,
    },
    /// No feedback of this cost stabilises: an unstable mode cannot be reached by the input, or a mode on the stability boundary costs nothing.
    #[error(
        "no stabilising solution (measure of stability {measure}, must be below 1): either the input cannot reach an unstable mode, or a mode on the stability boundary has no weight in Q"
    )]
    NoStabilisingSolution {
        /// Spectral radius of the best closed loop found (continuous time: of its Cayley transform); NaN where the iteration broke down.
        measure: f64,
    },
    /// The iteration ended, but what it found does not solve the equation well; a pole of the closed loop
    /// lies next to the stability boundary, or the problem is badly scaled for this precision.
    #[error(
        "the Riccati equation is solved only to {residual:e} (relative; allowed {allowed:e}): give every state a weight, scale them alike, or use f64"
    )]
    NotConverged {
        /// Relative residual of the equation.
        residual: f64,
        /// The largest one accepted.
        allowed: f64,
    },
}
