//! Between NumPy's arrays, whose sizes are known at run time, and nalgebra's, whose sizes are types.

use crate::error;
use furuta_model::State;
use nalgebra::SMatrix;
use numpy::ndarray::ArrayView2;
use numpy::{
    AllowTypeChange, IntoPyArray, PyArray2, PyArrayLike1, PyArrayLike2, PyArrayMethods, ToPyArray,
};
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

/// A matrix of at most 8 x 8, read once, without a heap.
#[derive(Copy, Clone)]
pub(crate) struct Small {
    rows: usize,
    cols: usize,
    /// By rows, one behind the other.
    entries: [f64; Self::SIDE * Self::SIDE],
}

impl Small {
    const SIDE: usize = 8;

    /// The argument, where it is not larger than that.
    pub(crate) fn read(name: &str, m: &Matrix<'_>) -> PyResult<Self> {
        let view = m.as_array();
        let (rows, cols) = view.dim();
        if rows.max(cols) > Self::SIDE {
            return Err(error::design(format!(
                "{name} has shape ({rows}, {cols}); 1 to 8 states are possible"
            )));
        }
        let mut entries = [0.0; Self::SIDE * Self::SIDE];
        match view.as_slice() {
            Some(all) => entries[..all.len()].copy_from_slice(all),
            None => {
                for (to, from) in entries.iter_mut().zip(view.iter()) {
                    *to = *from;
                }
            }
        }
        Ok(Self {
            rows,
            cols,
            entries,
        })
    }

    /// A matrix from its entries; not more than 8 rows or columns.
    pub(crate) fn from_fn(
        rows: usize,
        cols: usize,
        mut entry: impl FnMut(usize, usize) -> f64,
    ) -> Self {
        let mut entries = [0.0; Self::SIDE * Self::SIDE];
        for i in 0..rows {
            for j in 0..cols {
                entries[i * cols + j] = entry(i, j);
            }
        }
        Self {
            rows,
            cols,
            entries,
        }
    }

    pub(crate) fn identity(side: usize) -> Self {
        Self::from_fn(side, side, |i, j| f64::from(i == j))
    }

    pub(crate) fn from_fixed<const R: usize, const C: usize>(m: &SMatrix<f64, R, C>) -> Self {
        Self::from_fn(R, C, |i, j| m[(i, j)])
    }

    /// Refuses another shape.
    pub(crate) fn expect(&self, name: &str, shape: (usize, usize)) -> PyResult<()> {
        if (self.rows, self.cols) == shape {
            return Ok(());
        }
        Err(error::design(format!(
            "{name} has shape ({}, {}); it must be ({}, {}) here",
            self.rows, self.cols, shape.0, shape.1
        )))
    }

    /// As a matrix of this size.
    pub(crate) fn fixed<const R: usize, const C: usize>(
        &self,
        name: &str,
    ) -> PyResult<SMatrix<f64, R, C>> {
        self.expect(name, (R, C))?;
        Ok(SMatrix::from_fn(|i, j| self.entries[i * C + j]))
    }

    pub(crate) fn rows(&self) -> usize {
        self.rows
    }

    pub(crate) fn cols(&self) -> usize {
        self.cols
    }

    pub(crate) fn at(&self, row: usize, col: usize) -> f64 {
        self.entries[row * self.cols + col]
    }

    pub(crate) fn transpose(&self) -> Self {
        Self::from_fn(self.cols, self.rows, |i, j| self.at(j, i))
    }

    /// The product; the shapes must have been checked to fit.
    pub(crate) fn times(&self, other: &Self) -> Self {
        Self::from_fn(self.rows, other.cols, |i, j| {
            (0..self.cols).map(|k| self.at(i, k) * other.at(k, j)).sum()
        })
    }

    /// As a NumPy array.
    pub(crate) fn array<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let entries = &self.entries[..self.rows * self.cols];
        let view = ArrayView2::from_shape((self.rows, self.cols), entries);
        Ok(view.map_err(error::design)?.to_pyarray(py))
    }
}
