//! Between NumPy's arrays, whose sizes are known at run time, and nalgebra's, whose sizes are types.

use crate::error;
use furuta_model::State;
use nalgebra::SMatrix;
use numpy::{AllowTypeChange, IntoPyArray, PyArray2, PyArrayLike1, PyArrayLike2, PyArrayMethods};
use pyo3::prelude::*;

/// A vector argument: any array or sequence of numbers.
pub(crate) type Vector<'py> = PyArrayLike1<'py, f64, AllowTypeChange>;
/// A matrix argument: any array or nested sequence of numbers.
pub(crate) type Matrix<'py> = PyArrayLike2<'py, f64, AllowTypeChange>;

/// The argument as a matrix of this size.
pub(crate) fn fixed<const R: usize, const C: usize>(
    name: &str,
    m: &Matrix<'_>,
) -> PyResult<SMatrix<f64, R, C>> {
    let view = m.as_array();
    if view.dim() != (R, C) {
        let (rows, cols) = view.dim();
        return Err(error::design(format!(
            "{name} has shape ({rows}, {cols}); it must be ({R}, {C}) here"
        )));
    }
    Ok(SMatrix::from_fn(|r, c| view[[r, c]]))
}

/// A matrix as a NumPy array of shape (R, C).
pub(crate) fn array<'py, T: numpy::Element + Copy, const R: usize, const C: usize>(
    py: Python<'py>,
    m: &SMatrix<T, R, C>,
) -> PyResult<Bound<'py, PyArray2<T>>> {
    // nalgebra stores columns, NumPy rows.
    let rows: Vec<T> = (0..R)
        .flat_map(|r| (0..C).map(move |c| m[(r, c)]))
        .collect();
    rows.into_pyarray(py).reshape([R, C])
}

/// Four finite numbers as a state.
pub(crate) fn state(name: &str, x: &Vector<'_>) -> PyResult<State<f64>> {
    let view = x.as_array();
    let values: Vec<f64> = view.iter().copied().collect();
    let Ok(values) = <[f64; 4]>::try_from(values) else {
        return Err(error::simulation(format!(
            "{name} has {} numbers; a state has 4: theta, alpha, theta_dot, alpha_dot (rad, rad/s)",
            view.len()
        )));
    };
    let state = State::from(values);
    if !state.is_finite() {
        return Err(error::simulation(format!(
            "{name} = {values:?} holds a number that is not finite"
        )));
    }
    Ok(state)
}
