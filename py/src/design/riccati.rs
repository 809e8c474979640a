//! Riccati equations of a size known at run time: what regulators and estimators share.

use super::by_size;
use crate::error;
use crate::matrix::{Lies, Matrix, Small};
use furuta_ctrl::design::{self, DesignError, Weights, poles};
use nalgebra::allocator::Allocator;
use nalgebra::{Const, DefaultAllocator, DimDiff, DimSub, U1};
use numpy::{Complex64, PyArray1, PyArray2};
use pyo3::prelude::*;

/// Gain or solution, solution or gain, poles.
pub(super) type Answer<'py> = (
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray1<Complex64>>,
);

/// A Riccati equation, continuous or discrete, its matrices under their usual names.
pub(super) struct Equation {
    pub(super) discrete: bool,
    pub(super) a: Small,
    pub(super) b: Small,
    pub(super) q: Small,
    pub(super) r: Small,
    pub(super) cross: Option<Small>,
}

/// Its answer.
pub(super) struct Solved {
    pub(super) x: Small,
    pub(super) gain: Small,
    pub(super) poles: [Complex64; 8],
}

impl Equation {
    /// Solves it. A few microseconds: to let other threads have the interpreter meanwhile would take longer than it
    /// gives.
    pub(super) fn solve(&self) -> PyResult<Result<Solved, DesignError>> {
        by_size!((self.a.rows(), self.b.cols()), sized(self); 1 2 3 4 5 6 7 8)
    }
}

fn sized<const N: usize, const M: usize>(e: &Equation) -> PyResult<Result<Solved, DesignError>>
where
    Const<N>: DimSub<U1>,
    DefaultAllocator: Allocator<Const<N>, DimDiff<Const<N>, U1>> + Allocator<DimDiff<Const<N>, U1>>,
{
    let (a, b) = (e.a.fixed::<N, N>("A")?, e.b.fixed::<N, M>("B")?);
    let mut weights = Weights::new(e.q.fixed("Q")?, e.r.fixed("R")?);
    if let Some(cross) = &e.cross {
        weights = weights.with_cross(cross.fixed("the cross term")?);
    }
    let solve = if e.discrete {
        design::riccati::discrete
    } else {
        design::riccati::continuous
    };
    let solution = match solve(&a, &b, &weights) {
        Ok(solution) => solution,
        Err(e) => return Ok(Err(e)),
    };
    let Some(values) = poles(&(a - b * solution.gain)) else {
        return Err(error::design(
            "the eigenvalues of the closed loop did not converge",
        ));
    };
    let mut poles = [Complex64::default(); 8];
    poles[..N].copy_from_slice(&values);
    Ok(Ok(Solved {
        x: Small::from_fixed(&solution.x),
        gain: Small::from_fixed(&solution.gain),
        poles,
    }))
}

impl Solved {
    /// The poles as NumPy's.
    pub(super) fn poles<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<Complex64>> {
        PyArray1::from_slice(py, &self.poles[..self.x.rows()])
    }

    /// As python-control orders a Riccati equation's answer: solution, poles, gain.
    fn answer<'py>(&self, py: Python<'py>) -> PyResult<Solution<'py>> {
        Ok((self.x.array(py)?, self.poles(py), self.gain.array(py)?))
    }
}

type Solution<'py> = (
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray1<Complex64>>,
    Bound<'py, PyArray2<f64>>,
);

/// Continuous-time algebraic Riccati equation A'X + X A - (X B + S) R^-1 (B'X + S') + Q = 0: its stabilising solution.
///
/// Parameters
/// ----------
/// A : array_like, shape (n, n)
///     n from 1 to 8.
/// B : array_like, shape (n, m)
///     m from 1 to 3.
/// Q : array_like, shape (n, n)
///     Symmetric.
/// R : array_like, shape (m, m), optional
///     Symmetric, positive definite; the identity if not given.
/// S : array_like, shape (n, m), optional
///     Cross term.
///
/// Returns
/// -------
/// X : numpy.ndarray, shape (n, n)
/// L : numpy.ndarray of complex, shape (n,)
///     Poles of A - B G.
/// G : numpy.ndarray, shape (m, n)
///     The gain R^-1 (B'X + S'). The order X, L, G is python-control's.
///
/// Raises
/// ------
/// DesignError
///     Shapes that do not fit, weights that cannot be, no stabilising solution (and why), or a residual above 1e-10.
///
/// Examples
/// --------
/// >>> import furuta
/// >>> X, L, G = furuta.care([[1.0]], [[1.0]], [[1.0]])
/// >>> round(float(X[0, 0]), 6)  # 1 + sqrt(2)
/// 2.414214
#[pyfunction]
#[pyo3(signature = (A, B, Q, R=None, S=None), text_signature = "(A, B, Q, R=None, S=None)")]
#[allow(non_snake_case)] // keywords in Python
pub(crate) fn care<'py>(
    py: Python<'py>,
    A: Matrix<'py>,
    B: Matrix<'py>,
    Q: Matrix<'py>,
    R: Option<Matrix<'py>>,
    S: Option<Matrix<'py>>,
) -> PyResult<Solution<'py>> {
    let b = Small::read("B", &B, Lies::Column)?;
    let r = match R {
        Some(r) => Small::read("R", &r, Lies::Square)?,
        None => Small::identity(b.cols()),
    };
    solution(py, false, &A, b, &Q, r, S)
}

/// Discrete-time algebraic Riccati equation A'X A - X - (A'X B + S)(R + B'X B)^-1 (B'X A + S') + Q = 0: its stabilising
/// solution.
///
/// Parameters
/// ----------
/// A : array_like, shape (n, n)
///     n from 1 to 8.
/// B : array_like, shape (n, m)
///     m from 1 to 3.
/// Q : array_like, shape (n, n)
///     Symmetric.
/// R : array_like, shape (m, m)
///     Symmetric, positive definite.
/// S : array_like, shape (n, m), optional
///     Cross term.
///
/// Returns
/// -------
/// X : numpy.ndarray, shape (n, n)
/// L : numpy.ndarray of complex, shape (n,)
///     Poles of A - B G.
/// G : numpy.ndarray, shape (m, n)
///     The gain (R + B'X B)^-1 (B'X A + S'). The order X, L, G is python-control's.
///
/// Raises
/// ------
/// DesignError
///     Shapes that do not fit, weights that cannot be, no stabilising solution (and why), or a residual above 1e-10.
///
/// Examples
/// --------
/// >>> import furuta
/// >>> X, L, G = furuta.dare([[2.0]], [[1.0]], [[1.0]], [[1.0]])
/// >>> round(float(X[0, 0]), 6)  # 2 + sqrt(5)
/// 4.236068
#[pyfunction]
#[pyo3(signature = (A, B, Q, R, S=None), text_signature = "(A, B, Q, R, S=None)")]
#[allow(non_snake_case)] // keywords in Python
pub(crate) fn dare<'py>(
    py: Python<'py>,
    A: Matrix<'py>,
    B: Matrix<'py>,
    Q: Matrix<'py>,
    R: Matrix<'py>,
    S: Option<Matrix<'py>>,
) -> PyResult<Solution<'py>> {
    let (b, r) = (
        Small::read("B", &B, Lies::Column)?,
        Small::read("R", &R, Lies::Square)?,
    );
    solution(py, true, &A, b, &Q, r, S)
}

fn solution<'py>(
    py: Python<'py>,
    discrete: bool,
    a: &Matrix<'py>,
    b: Small,
    q: &Matrix<'py>,
    r: Small,
    s: Option<Matrix<'py>>,
) -> PyResult<Solution<'py>> {
    let equation = Equation {
        discrete,
        a: Small::read("A", a, Lies::Square)?,
        b,
        q: Small::read("Q", q, Lies::Square)?,
        r,
        cross: s.map(|s| Small::read("S", &s, Lies::Column)).transpose()?,
    };
    equation.solve()?.map_err(error::design)?.answer(py)
}
