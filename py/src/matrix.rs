//! Between NumPy's arrays, whose sizes are known at run time, and nalgebra's, whose sizes are types.

use crate::arguments::kind;
use crate::error;
use furuta_model::State;
use nalgebra::SMatrix;
use numpy::ndarray::ArrayView2;
use numpy::{
    AllowTypeChange, Element, IntoPyArray, PyArray2, PyArrayDescrMethods, PyArrayLikeDyn,
    PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods, ToPyArray,
};
use pyo3::intern;
use pyo3::prelude::*;

/// A vector argument: any array or sequence of numbers. It is read under its name, see [`vector`].
pub(crate) type Vector<'py> = Bound<'py, PyAny>;
/// A matrix argument: any array or nested sequence of numbers. It is read under its name, see [`Small::read`].
pub(crate) type Matrix<'py> = Bound<'py, PyAny>;

/// Makes an error of Python's of a message.
type Refuse = fn(String) -> PyErr;

/// A shape as NumPy prints it.
fn shape(of: &[usize]) -> String {
    match of {
        [one] => format!("({one},)"),
        many => format!(
            "({})",
            many.iter()
                .map(ToString::to_string)
                .collect::<Vec<_>>()
                .join(", ")
        ),
    }
}

/// The argument as an array of whatever shape.
pub(crate) fn numbers<'py, T: Element>(
    name: &str,
    given: &Bound<'py, PyAny>,
    refuse: Refuse,
) -> PyResult<PyArrayLikeDyn<'py, T, AllowTypeChange>>
where
    PyArrayLikeDyn<'py, T, AllowTypeChange>: for<'a> FromPyObject<'a, 'py>,
{
    as_it_is(name, given, refuse, T::get_dtype(given.py()).kind())?;
    given.extract().map_err(|_| {
        let kind = kind(given);
        refuse(format!(
            "{name} must be an array of numbers; a {kind} was given that is none"
        ))
    })
}

/// Refuses what NumPy would turn into numbers of another meaning without a word: values behind a mask, complex numbers
/// without their imaginary part, times as counts of some unit.
fn as_it_is(name: &str, given: &Bound<'_, PyAny>, refuse: Refuse, wanted: u8) -> PyResult<()> {
    let py = given.py();
    let own = given.cast_exact::<PyUntypedArray>().ok();
    let kind = match own {
        Some(array) => char::from(array.dtype().kind()),
        None => given
            .getattr(intern!(py, "dtype"))
            .and_then(|dtype| dtype.getattr(intern!(py, "kind")))
            .and_then(|kind| kind.extract())
            // What has no type of its own, as a list, is looked at number by number.
            .unwrap_or('?'),
    };
    let why = match kind {
        'c' if wanted != b'c' => {
            "holds complex numbers; real numbers are expected: give the real part of it"
        }
        'm' | 'M' => "holds times; numbers are expected: give seconds",
        _ if own.is_none() && kind != '?' && is_masked(given)? => {
            "is an array with masked entries, which have no value: fill them or leave them out"
        }
        _ => return Ok(()),
    };
    Err(refuse(format!("{name} {why}")))
}

/// Whether it is an array of `numpy.ma` of which an entry is masked.
fn is_masked(given: &Bound<'_, PyAny>) -> PyResult<bool> {
    let py = given.py();
    let ma = py.import(intern!(py, "numpy.ma"))?;
    ma.getattr(intern!(py, "is_masked"))?
        .call1((given,))?
        .extract()
}

/// The numbers of a vector: of shape (n,), or (1, n) or (n, 1), as python-control takes them, too.
pub(crate) fn vector<'py, T: Element + Copy>(
    name: &str,
    given: &Bound<'py, PyAny>,
    refuse: Refuse,
) -> PyResult<Vec<T>>
where
    PyArrayLikeDyn<'py, T, AllowTypeChange>: for<'a> FromPyObject<'a, 'py>,
{
    let array = numbers::<T>(name, given, refuse)?;
    let view = array.as_array();
    match view.shape() {
        [_] | [1, _] | [_, 1] => Ok(view.iter().copied().collect()),
        [] => Err(refuse(format!(
            "{name} is a single number; it must be an array of shape (n,)"
        ))),
        other => Err(refuse(format!(
            "{name} has shape {}; it must be (n,)",
            shape(other)
        ))),
    }
}

/// States, one a row.
pub(crate) fn states(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Vec<[f64; 4]>> {
    let array = numbers::<f64>(name, given, error::said)?;
    let view = array.as_array();
    match view.shape() {
        [4] | [_, 4] => {}
        other => {
            return Err(error::simulation(format!(
                "{name} has shape {}; it must be (n, 4), a state [theta, alpha, theta_dot, alpha_dot] in each row",
                shape(other)
            )));
        }
    }
    let all: Vec<f64> = view.iter().copied().collect();
    Ok(all
        .chunks_exact(4)
        .map(|x| std::array::from_fn(|i| x[i]))
        .collect())
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
    let values: Vec<f64> = vector(name, x, error::said)?;
    let given = values.len();
    let Ok(values) = <[f64; 4]>::try_from(values) else {
        return Err(error::simulation(format!(
            "{name} has shape ({given},); it must be (4,), a state [theta, alpha, theta_dot, alpha_dot] (rad, rad/s)"
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

/// What an array of shape (n,) is taken for where a matrix is asked for.
#[derive(Copy, Clone, PartialEq, Eq)]
pub(crate) enum Lies {
    /// A column, as an input matrix of one input.
    Column,
    /// A row, as an output matrix of one output.
    Row,
    /// Nothing, but for n = 1: a square matrix is asked for.
    Square,
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

    /// The argument, where it is not larger than that. A number is a matrix of one entry, and an array of one dimension
    /// is a row or a column as it `lies`, as in python-control.
    pub(crate) fn read(name: &str, m: &Matrix<'_>, lies: Lies) -> PyResult<Self> {
        let array = numbers::<f64>(name, m, error::design)?;
        let view = array.as_array();
        let (rows, cols) = match (view.shape(), lies) {
            ([], _) | ([1], _) => (1, 1),
            ([n], Lies::Column) => (*n, 1),
            ([n], Lies::Row) => (1, *n),
            ([n], Lies::Square) => {
                return Err(error::design(format!(
                    "{name} has shape ({n},); a square matrix is expected: np.diag({name}) has these numbers on its \
                     diagonal"
                )));
            }
            ([rows, cols], _) => (*rows, *cols),
            (other, _) => {
                return Err(error::design(format!(
                    "{name} has shape {}; a matrix is expected",
                    shape(other)
                )));
            }
        };
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

    /// Refuses an entry that is not finite.
    pub(crate) fn finite(self, name: &str) -> PyResult<Self> {
        let used = &self.entries[..self.rows * self.cols];
        match used.iter().position(|x| !x.is_finite()) {
            None => Ok(self),
            Some(k) => Err(error::design(format!(
                "{name}[{}, {}] = {} is not a finite number",
                k / self.cols,
                k % self.cols,
                used[k]
            ))),
        }
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
