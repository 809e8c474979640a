//! Steady-state Kalman gains, by the regulator of the transposed system.

use super::riccati::{Answer, Equation};
use super::system::{Plant, Time, plant, required};
use crate::error;
use crate::matrix::{Lies, Matrix, Small};
use pyo3::prelude::*;

/// Continuous-time steady-state Kalman gain for x' = A x + B u + G w, y = C x + v with white noises w and v.
///
/// Parameters
/// ----------
/// A : array_like, shape (n, n)
///     n from 1 to 8. In place of A, G and C one system can stand, as in python-control, whose input then carries the
///     noise: a control.StateSpace, or a Rig (upright, without its effects; its encoders measure).
/// G : array_like, shape (n, q)
///     How the process noise enters; (n,) is a column.
/// C : array_like, shape (p, n)
///     p from 1 to 3 measurements; (n,) is a row.
/// QN : array_like, shape (q, q), or a number where q is 1
///     Spectral density of w, symmetric.
/// RN : array_like, shape (p, p), or a number where p is 1
///     Spectral density of v, symmetric, positive definite.
/// NN : array_like, shape (q, p), optional
///     Their cross density.
///
/// Returns
/// -------
/// L : numpy.ndarray, shape (n, p)
///     The gain in xhat' = A xhat + B u + L (y - C xhat).
/// P : numpy.ndarray, shape (n, n)
///     Covariance of the estimate's error.
/// poles : numpy.ndarray of complex, shape (n,)
///     Poles of A - L C.
///
/// Raises
/// ------
/// DesignError
///     Shapes that do not fit, covariances that cannot be, or a mode that the measurement does not show.
///
/// Examples
/// --------
/// >>> import furuta
/// >>> L, P, poles = furuta.lqe([[-1.0]], [[1.0]], [[1.0]], [[1.0]], [[1.0]])
/// >>> round(float(L[0, 0]), 6)  # sqrt(2) - 1
/// 0.414214
#[pyfunction]
#[pyo3(
    signature = (A, G=None, C=None, QN=None, RN=None, NN=None),
    text_signature = "(A, G=None, C=None, QN=None, RN=None, NN=None)"
)]
#[allow(non_snake_case)] // keywords in Python
pub(crate) fn lqe<'py>(
    py: Python<'py>,
    A: Matrix<'py>,
    G: Option<Matrix<'py>>,
    C: Option<Matrix<'py>>,
    QN: Option<Matrix<'py>>,
    RN: Option<Matrix<'py>>,
    NN: Option<Matrix<'py>>,
) -> PyResult<Answer<'py>> {
    let plant = plant("lqe", Time::Continuous, &A, [G, C], [QN, RN, NN])?;
    estimator(py, "lqe", plant)
}

/// Discrete-time steady-state Kalman gain for x[k+1] = A x[k] + B u[k] + G w[k], y[k] = C x[k] + v[k] with white noises
/// w and v.
///
/// Parameters
/// ----------
/// A : array_like, shape (n, n)
///     n from 1 to 8. In place of A, G and C one system can stand, as in python-control, whose input then carries the
///     noise: a control.StateSpace, or a Rig (upright, without its effects; its encoders measure).
/// G : array_like, shape (n, q)
///     How the process noise enters; (n,) is a column.
/// C : array_like, shape (p, n)
///     p from 1 to 3 measurements; (n,) is a row.
/// QN : array_like, shape (q, q), or a number where q is 1
///     Covariance of w, symmetric.
/// RN : array_like, shape (p, p), or a number where p is 1
///     Covariance of v, symmetric, positive definite.
/// NN : array_like, shape (q, p), optional
///     Their cross covariance E[w v'].
///
/// Returns
/// -------
/// L : numpy.ndarray, shape (n, p)
///     The gain of the predictor xhat[k+1] = A xhat[k] + B u[k] + L (y[k] - C xhat[k]), as in python-control.
/// P : numpy.ndarray, shape (n, n)
///     Covariance of the prediction's error. The gain that corrects with the measurement of the same instant is
///     P C' (C P C' + RN)^-1.
/// poles : numpy.ndarray of complex, shape (n,)
///     Poles of A - L C.
///
/// Raises
/// ------
/// DesignError
///     Shapes that do not fit, covariances that cannot be, or a mode that the measurement does not show.
///
/// Examples
/// --------
/// >>> import furuta
/// >>> L, P, poles = furuta.dlqe([[1.0]], [[1.0]], [[1.0]], [[1.0]], [[1.0]])
/// >>> round(float(P[0, 0]), 6)  # the golden ratio
/// 1.618034
#[pyfunction]
#[pyo3(
    signature = (A, G=None, C=None, QN=None, RN=None, NN=None),
    text_signature = "(A, G=None, C=None, QN=None, RN=None, NN=None)"
)]
#[allow(non_snake_case)] // keywords in Python
pub(crate) fn dlqe<'py>(
    py: Python<'py>,
    A: Matrix<'py>,
    G: Option<Matrix<'py>>,
    C: Option<Matrix<'py>>,
    QN: Option<Matrix<'py>>,
    RN: Option<Matrix<'py>>,
    NN: Option<Matrix<'py>>,
) -> PyResult<Answer<'py>> {
    let plant = plant("dlqe", Time::Sampled, &A, [G, C], [QN, RN, NN])?;
    estimator(py, "dlqe", plant)
}

fn estimator<'py>(py: Python<'py>, function: &str, plant: Plant<'py>) -> PyResult<Answer<'py>> {
    let Plant {
        time,
        a,
        b: g,
        c,
        rest: [qn, rn, nn],
    } = plant;
    let discrete = time == Time::Sampled;
    let read = |name, given| Small::read(name, &required(function, name, given)?, Lies::Square);
    let (qn, rn) = (read("QN", qn)?, read("RN", rn)?);
    let (n, noises, p) = (a.rows(), g.cols(), c.rows());
    a.expect("A", (n, n))?;
    g.expect("G", (n, noises))?;
    c.expect("C", (p, n))?;
    qn.expect("QN", (noises, noises))?;
    rn.expect("RN", (p, p))?;
    let cross = match nn {
        Some(nn) => {
            let nn = Small::read("NN", &nn, Lies::Column)?;
            nn.expect("NN", (noises, p))?;
            Some(g.times(&nn))
        }
        None => None,
    };
    let equation = Equation {
        discrete,
        a: a.transpose(),
        b: c.transpose(),
        q: g.times(&qn).times(&g.transpose()),
        r: rn,
        cross,
    };
    let solved = equation.solve()?.map_err(|e| error::design(e.of_dual()))?;
    Ok((
        solved.gain.transpose().array(py)?,
        solved.x.array(py)?,
        solved.poles(py),
    ))
}
