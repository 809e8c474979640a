//! Steady-state Kalman gains, by the regulator of the transposed system.

use super::riccati::{Answer, Equation};
use crate::error;
use crate::matrix::{Matrix, Small};
use pyo3::prelude::*;

/// Continuous-time steady-state Kalman gain for x' = A x + B u + G w, y = C x + v with white noises w and v.
///
/// Parameters
/// ----------
/// A : array_like, shape (n, n)
///     n from 1 to 8.
/// G : array_like, shape (n, q)
///     How the process noise enters.
/// C : array_like, shape (p, n)
///     p from 1 to 3 measurements.
/// QN : array_like, shape (q, q)
///     Spectral density of w, symmetric.
/// RN : array_like, shape (p, p)
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
#[pyo3(signature = (a, g, c, qn, rn, nn=None), text_signature = "(A, G, C, QN, RN, NN=None)")]
pub(crate) fn lqe<'py>(
    py: Python<'py>,
    a: Matrix<'py>,
    g: Matrix<'py>,
    c: Matrix<'py>,
    qn: Matrix<'py>,
    rn: Matrix<'py>,
    nn: Option<Matrix<'py>>,
) -> PyResult<Answer<'py>> {
    estimator(py, false, [&a, &g, &c, &qn, &rn], nn)
}

/// Discrete-time steady-state Kalman gain for x[k+1] = A x[k] + B u[k] + G w[k], y[k] = C x[k] + v[k] with white noises
/// w and v.
///
/// Parameters
/// ----------
/// A : array_like, shape (n, n)
///     n from 1 to 8.
/// G : array_like, shape (n, q)
///     How the process noise enters.
/// C : array_like, shape (p, n)
///     p from 1 to 3 measurements.
/// QN : array_like, shape (q, q)
///     Covariance of w, symmetric.
/// RN : array_like, shape (p, p)
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
#[pyo3(signature = (a, g, c, qn, rn, nn=None), text_signature = "(A, G, C, QN, RN, NN=None)")]
pub(crate) fn dlqe<'py>(
    py: Python<'py>,
    a: Matrix<'py>,
    g: Matrix<'py>,
    c: Matrix<'py>,
    qn: Matrix<'py>,
    rn: Matrix<'py>,
    nn: Option<Matrix<'py>>,
) -> PyResult<Answer<'py>> {
    estimator(py, true, [&a, &g, &c, &qn, &rn], nn)
}

fn estimator<'py>(
    py: Python<'py>,
    discrete: bool,
    [a, g, c, qn, rn]: [&Matrix<'py>; 5],
    nn: Option<Matrix<'py>>,
) -> PyResult<Answer<'py>> {
    let (a, g, c) = (
        Small::read("A", a)?,
        Small::read("G", g)?,
        Small::read("C", c)?,
    );
    let (qn, rn) = (Small::read("QN", qn)?, Small::read("RN", rn)?);
    let (n, noises, p) = (a.rows(), g.cols(), c.rows());
    a.expect("A", (n, n))?;
    g.expect("G", (n, noises))?;
    c.expect("C", (p, n))?;
    qn.expect("QN", (noises, noises))?;
    rn.expect("RN", (p, p))?;
    let cross = match nn {
        Some(nn) => {
            let nn = Small::read("NN", &nn)?;
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
