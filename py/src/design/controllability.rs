//! What an input reaches.

use super::by_size;
use crate::error;
use crate::matrix::{Lies, Matrix, Small};
use nalgebra::SMatrix;
use numpy::{IntoPyArray, PyArray2, PyArrayMethods};
use pyo3::prelude::*;

type Reach<'py> = (Bound<'py, PyArray2<f64>>, usize, f64);

/// What the input of x' = A x + B u (or of x[k+1] = A x[k] + B u[k]) can reach: Kalman's controllability matrix and its
/// rank.
///
/// The rank is counted on a copy of the matrix in which units of time and of the states drop out, so that a pendulum in
/// millimetres is as controllable as one in metres. Observability of (A, C) is the dual: controllability(A.T, C.T).
///
/// Parameters
/// ----------
/// A : array_like, shape (n, n)
///     n from 1 to 8.
/// B : array_like, shape (n, m)
///     m from 1 to 3.
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
/// >>> furuta.controllability(A.T, [[0], [1], [0], [0]])[1]  # the pendulum's encoder alone does not show theta
/// 3
#[pyfunction]
#[pyo3(signature = (A, B), text_signature = "(A, B)")]
#[allow(non_snake_case)] // keywords in Python
pub(crate) fn controllability<'py>(
    py: Python<'py>,
    A: Matrix<'py>,
    B: Matrix<'py>,
) -> PyResult<Reach<'py>> {
    fn sized<'py, const N: usize, const M: usize>(
        py: Python<'py>,
        a: &Small,
        b: &Small,
    ) -> PyResult<Reach<'py>> {
        let (a, b): (SMatrix<f64, N, N>, SMatrix<f64, N, M>) = (a.fixed("A")?, b.fixed("B")?);
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
    let (a, b) = (
        Small::read("A", &A, Lies::Square)?,
        Small::read("B", &B, Lies::Column)?,
    );
    by_size!((b.rows(), b.cols()), sized(py, &a, &b); 1 2 3 4 5 6 7 8)
}
