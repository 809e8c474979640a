//! Linear-quadratic regulators and controllability. The designs are written for sizes known at compile time; here a size is looked up.

use crate::error;
use crate::matrix::{Matrix, array, fixed};
use furuta_ctrl::design::{DesignError, Regulator, Weights};
use nalgebra::SMatrix;
use numpy::{Complex64, IntoPyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;

type Answer<'py> = (
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray1<Complex64>>,
);

/// Calls `$sized::<N, M>` for the sizes of `$b`, N = 1..=8 states and M = 1 or 2 inputs.
macro_rules! by_size {
    ($b:expr, $sized:ident $arguments:tt; $($n:literal)*) => {
        match $b.as_array().dim() {
            $(($n, 1) => $sized::<$n, 1> $arguments, ($n, 2) => $sized::<$n, 2> $arguments,)*
            (n, m) => Err(error::design(format!("B has shape ({n}, {m}); 1 to 8 states and 1 or 2 inputs are possible"))),
        }
    };
}

macro_rules! regulator {
    ($function:ident, $(#[$doc:meta])*) => {
        $(#[$doc])*
        #[pyfunction]
        #[pyo3(text_signature = "(A, B, Q, R)")]
        pub(crate) fn $function<'py>(
            py: Python<'py>,
            a: Matrix<'py>,
            b: Matrix<'py>,
            q: Matrix<'py>,
            r: Matrix<'py>,
        ) -> PyResult<Answer<'py>> {
            fn sized<'py, const N: usize, const M: usize>(
                py: Python<'py>,
                a: &Matrix<'py>,
                b: &Matrix<'py>,
                q: &Matrix<'py>,
                r: &Matrix<'py>,
            ) -> PyResult<Answer<'py>> {
                let (a, b): (SMatrix<f64, N, N>, SMatrix<f64, N, M>) = (fixed("A", a)?, fixed("B", b)?);
                let weights = Weights::new(fixed("Q", q)?, fixed("R", r)?);
                let found: Result<Regulator<f64, N, M>, DesignError> =
                    py.detach(|| furuta_ctrl::design::$function(&a, &b, &weights));
                let found = found.map_err(error::design)?;
                // The closed loop was checked to be stable; its poles are read off with LAPACK's method on a run-time size.
                let square = nalgebra::DMatrix::from_iterator(N, N, found.closed_loop.iter().copied());
                let poles: Vec<Complex64> = square.complex_eigenvalues().iter().copied().collect();
                Ok((array(py, &found.gain)?, array(py, &found.cost)?, poles.into_pyarray(py)))
            }
            by_size!(b, sized(py, &a, &b, &q, &r); 1 2 3 4 5 6 7 8)
        }
    };
}

regulator!(
    lqr,
    /// Continuous-time linear-quadratic regulator: u = -K x minimises the integral of x'Q x + u'R u for x' = A x + B u.
    ///
    /// Parameters
    /// ----------
    /// A : array_like, shape (n, n)
    ///     n from 1 to 8.
    /// B : array_like, shape (n, m)
    ///     m 1 or 2.
    /// Q : array_like, shape (n, n)
    ///     Weight of the state, symmetric.
    /// R : array_like, shape (m, m)
    ///     Weight of the input, symmetric, positive definite.
    ///
    /// Returns
    /// -------
    /// K : numpy.ndarray, shape (m, n)
    ///     The gain, V per unit of state for a furuta rig.
    /// S : numpy.ndarray, shape (n, n)
    ///     The cost from state x on is x'S x.
    /// poles : numpy.ndarray of complex, shape (n,)
    ///     Poles of A - B K, 1/s.
    ///
    /// Raises
    /// ------
    /// DesignError
    ///     Shapes that do not fit, weights that cannot be, or no gain that stabilises.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, furuta
    /// >>> A, B = furuta.linearize(furuta.Rig.load("shahzad2022-srv02"))
    /// >>> K, S, poles = furuta.lqr(A, B, np.eye(4), [[1]])
    /// >>> K.round(1).tolist()
    /// [[-1.0, 27.7, -2.0, 3.6]]
);

regulator!(
    dlqr,
    /// Discrete-time linear-quadratic regulator: u = -K x minimises the sum of x'Q x + u'R u for x[k+1] = A x[k] + B u[k].
    ///
    /// Parameters
    /// ----------
    /// A : array_like, shape (n, n)
    ///     n from 1 to 8.
    /// B : array_like, shape (n, m)
    ///     m 1 or 2.
    /// Q : array_like, shape (n, n)
    ///     Weight of the state, symmetric.
    /// R : array_like, shape (m, m)
    ///     Weight of the input, symmetric, positive definite.
    ///
    /// Returns
    /// -------
    /// K : numpy.ndarray, shape (m, n)
    /// S : numpy.ndarray, shape (n, n)
    /// poles : numpy.ndarray of complex, shape (n,)
    ///     Poles of A - B K, inside the unit circle.
    ///
    /// Raises
    /// ------
    /// DesignError
    ///     Shapes that do not fit, weights that cannot be, or no gain that stabilises.
    ///
    /// Examples
    /// --------
    /// >>> import furuta
    /// >>> K, S, poles = furuta.dlqr([[2.0]], [[1.0]], [[1.0]], [[1.0]])
    /// >>> round(float(S[0, 0]), 6)  # 2 + sqrt(5)
    /// 4.236068
);

type Reach<'py> = (Bound<'py, PyArray2<f64>>, usize, f64);

/// What the input of x' = A x + B u (or of x[k+1] = A x[k] + B u[k]) can reach: Kalman's controllability matrix and its rank.
///
/// The rank is counted on a copy of the matrix in which units of time and of the states drop out, so that a pendulum in millimetres is
/// as controllable as one in metres. Observability of (A, C) is the dual: controllability(A.T, C.T).
///
/// Parameters
/// ----------
/// A : array_like, shape (n, n)
///     n from 1 to 8.
/// B : array_like, shape (n, m)
///     m 1 or 2.
///
/// Returns
/// -------
/// W : numpy.ndarray, shape (n, n * m)
///     [B, A B, ..., A^(n-1) B], not scaled.
/// rank : int
///     The number of states that the input can reach; n if the system is controllable.
/// condition : float
///     Largest over smallest singular value of the scaled matrix; inf if the rank is below n.
///
/// Raises
/// ------
/// DesignError
///     Shapes that do not fit, or entries that are not finite.
///
/// Examples
/// --------
/// >>> import furuta
/// >>> A, B = furuta.linearize(furuta.Rig.load("qube-servo-2"))
/// >>> W, rank, condition = furuta.controllability(A, B)
/// >>> rank
/// 4
/// >>> furuta.controllability(A.T, [[0], [1], [0], [0]])[1]  # the pendulum's encoder alone never shows where the arm points
/// 3
#[pyfunction]
#[pyo3(text_signature = "(A, B)")]
pub(crate) fn controllability<'py>(
    py: Python<'py>,
    a: Matrix<'py>,
    b: Matrix<'py>,
) -> PyResult<Reach<'py>> {
    fn sized<'py, const N: usize, const M: usize>(
        py: Python<'py>,
        a: &Matrix<'py>,
        b: &Matrix<'py>,
    ) -> PyResult<Reach<'py>> {
        let (a, b): (SMatrix<f64, N, N>, SMatrix<f64, N, M>) = (fixed("A", a)?, fixed("B", b)?);
        let found = furuta_ctrl::design::controllability(&a, &b).map_err(error::design)?;
        let blocks = furuta_ctrl::design::controllability_matrix(&a, &b);
        let rows: Vec<f64> = (0..N)
            .flat_map(|row| {
                blocks
                    .iter()
                    .flat_map(move |block| (0..M).map(move |col| block[(row, col)]))
            })
            .collect();
        let w = rows.into_pyarray(py).reshape([N, N * M])?;
        Ok((w, found.rank, found.condition()))
    }
    by_size!(b, sized(py, &a, &b); 1 2 3 4 5 6 7 8)
}
