//! Linear-quadratic regulators.

use super::riccati::{Answer, Equation};
use super::system::{Plant, Time, plant, required};
use crate::error;
use crate::matrix::{Lies, Matrix, Small};
use furuta_model::discretize::zero_order_hold;
use nalgebra::{SMatrix, SVector};
use pyo3::prelude::*;

/// Continuous-time linear-quadratic regulator: u = -K x minimises the integral of x'Q x + u'R u + 2 x'N u for x' = A x
/// + B u.
///
/// Parameters
/// ----------
/// A : array_like, shape (n, n)
///     n from 1 to 8. In place of A and B one system can stand, as in python-control: a Rig (upright, without its
///     effects) or a control.StateSpace.
/// B : array_like, shape (n, m)
///     m from 1 to 3; (n,) is a column.
/// Q : array_like, shape (n, n)
///     Weight of the state, symmetric.
/// R : array_like, shape (m, m), or a number where m is 1
///     Weight of the input, symmetric, positive definite.
/// N : array_like, shape (n, m), optional
///     Cross weight.
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
/// >>> bool((furuta.lqr("shahzad2022-srv02", np.eye(4), 1)[0] == K).all())
/// True
#[pyfunction]
#[pyo3(signature = (A, B=None, Q=None, R=None, N=None), text_signature = "(A, B=None, Q=None, R=None, N=None)")]
#[allow(non_snake_case)] // keywords in Python
pub(crate) fn lqr<'py>(
    py: Python<'py>,
    A: Matrix<'py>,
    B: Option<Matrix<'py>>,
    Q: Option<Matrix<'py>>,
    R: Option<Matrix<'py>>,
    N: Option<Matrix<'py>>,
) -> PyResult<Answer<'py>> {
    let Plant {
        a,
        b,
        rest: [q, r, n],
        ..
    } = plant("lqr", Time::Continuous, &A, [B], [Q, R, N])?;
    regulator(
        py,
        false,
        a,
        b,
        &required("lqr", "Q", q)?,
        &required("lqr", "R", r)?,
        n,
    )
}

/// Discrete-time linear-quadratic regulator: u = -K x minimises the sum of x'Q x + u'R u + 2 x'N u for x[k+1] = A x[k]
/// + B u[k].
///
/// Parameters
/// ----------
/// A : array_like, shape (n, n)
///     n from 1 to 8. In place of A and B one system can stand, as in python-control: a Rig (upright, without its
///     effects) or a control.StateSpace.
/// B : array_like, shape (n, m)
///     m from 1 to 3; (n,) is a column.
/// Q : array_like, shape (n, n)
///     Weight of the state, symmetric.
/// R : array_like, shape (m, m), or a number where m is 1
///     Weight of the input, symmetric, positive definite.
/// N : array_like, shape (n, m), optional
///     Cross weight.
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
#[pyfunction]
#[pyo3(signature = (A, B=None, Q=None, R=None, N=None), text_signature = "(A, B=None, Q=None, R=None, N=None)")]
#[allow(non_snake_case)] // keywords in Python
pub(crate) fn dlqr<'py>(
    py: Python<'py>,
    A: Matrix<'py>,
    B: Option<Matrix<'py>>,
    Q: Option<Matrix<'py>>,
    R: Option<Matrix<'py>>,
    N: Option<Matrix<'py>>,
) -> PyResult<Answer<'py>> {
    let Plant {
        a,
        b,
        rest: [q, r, n],
        ..
    } = plant("dlqr", Time::Sampled, &A, [B], [Q, R, N])?;
    regulator(
        py,
        true,
        a,
        b,
        &required("dlqr", "Q", q)?,
        &required("dlqr", "R", r)?,
        n,
    )
}

/// Linear-quadratic regulator with integral action: u = -K [x, integral of C x], so that a constant disturbance leaves
/// no error in C x.
///
/// Parameters
/// ----------
/// A : array_like, shape (n, n)
///     n from 1 to 7.
/// B : array_like, shape (n, m)
///     m from 1 to 3.
/// C : array_like, shape (1, n)
///     The output to integrate, for the arm's angle [[1, 0, 0, 0]].
/// Q : array_like, shape (n + 1, n + 1)
///     Weight of the state and, last, of the integral.
/// R : array_like, shape (m, m)
///     Weight of the input, symmetric, positive definite.
/// N : array_like, shape (n + 1, m), optional
///     Cross weight.
/// dt : float, optional
///     Sample period in s, if A and B are those of a sampled system; the integral is then the sum s[k+1] = s[k] + dt C
///     x[k], Euler's rule.
/// hold : float, optional
///     Sample period in s, if A and B are those of continuous time and the command is held between samples. The gain is
///     that of the exactly sampled system, the integral included: what `furuta design lqi --rate` and kind = "lqi" take.
///
/// Returns
/// -------
/// K : numpy.ndarray, shape (m, n + 1)
/// S : numpy.ndarray, shape (n + 1, n + 1)
/// poles : numpy.ndarray of complex, shape (n + 1,)
///
/// Raises
/// ------
/// DesignError
///     As for lqr; without a weight on the integral there is no solution.
///
/// Examples
/// --------
/// >>> import numpy as np, furuta
/// >>> A, B = furuta.linearize(furuta.Rig.load("qube-servo-2"))
/// >>> K, S, poles = furuta.lqi(A, B, [[1, 0, 0, 0]], np.diag([5, 1, 0.1, 0.1, 20]), [[0.1]])
/// >>> K.shape, bool((poles.real < 0).all())
/// ((1, 5), True)
#[pyfunction]
#[pyo3(
    signature = (A, B, C, Q, R, N=None, *, dt=None, hold=None),
    text_signature = "(A, B, C, Q, R, N=None, *, dt=None, hold=None)"
)]
#[allow(non_snake_case, clippy::too_many_arguments)] // They are the matrices' usual names, in python-control's order.
pub(crate) fn lqi<'py>(
    py: Python<'py>,
    A: Matrix<'py>,
    B: Matrix<'py>,
    C: Matrix<'py>,
    Q: Matrix<'py>,
    R: Matrix<'py>,
    N: Option<Matrix<'py>>,
    dt: Option<f64>,
    hold: Option<f64>,
) -> PyResult<Answer<'py>> {
    let (a, b, c) = (
        Small::read("A", &A, Lies::Square)?,
        Small::read("B", &B, Lies::Column)?,
        Small::read("C", &C, Lies::Row)?,
    );
    let states = a.rows();
    if states > 7 {
        return Err(error::design(format!(
            "{states} states; with the integral one more, 1 to 7 are possible here"
        )));
    }
    for (name, m, shape) in [
        ("A", &a, (states, states)),
        ("B", &b, (states, b.cols())),
        ("C", &c, (1, states)),
    ] {
        m.expect(name, shape)?;
    }
    for (name, period) in [("dt", dt), ("hold", hold)] {
        if let Some(h) = period.filter(|h| !(*h > 0.0 && h.is_finite())) {
            return Err(error::design(format!(
                "{name} = {h} s; a sample period is above 0"
            )));
        }
    }
    if dt.is_some() && hold.is_some() {
        return Err(error::design(
            "dt and hold are both given; dt is for A and B of a sampled system, hold for those of continuous time",
        ));
    }
    let (keep, gain) = dt.map_or((0.0, 1.0), |dt| (1.0, dt));
    let a = Small::from_fn(states + 1, states + 1, |i, j| {
        match (i < states, j < states) {
            (true, true) => a.at(i, j),
            (false, true) => gain * c.at(0, j),
            (true, false) => 0.0,
            (false, false) => keep,
        }
    });
    let b = Small::from_fn(states + 1, b.cols(), |i, j| {
        if i < states { b.at(i, j) } else { 0.0 }
    });
    let (a, b) = match hold {
        Some(h) => held(&a, &b, h),
        None => (a, b),
    };
    regulator(py, dt.or(hold).is_some(), a, b, &Q, &R, N)
}

/// The system sampled exactly with its inputs held for `h` seconds. States that there are not are at rest.
fn held(a: &Small, b: &Small, h: f64) -> (Small, Small) {
    let (n, inputs) = (a.rows(), b.cols());
    let at = |m: &Small, i: usize, j: usize| if i < n { m.at(i, j) } else { 0.0 };
    let all = SMatrix::<f64, 8, 8>::from_fn(|i, j| if j < n { at(a, i, j) } else { 0.0 });
    let mut sampled = (*a, *b);
    for input in 0..inputs {
        let (ad, bd) = zero_order_hold(&all, &SVector::from_fn(|i, _| at(b, i, input)), h);
        let before = sampled.1;
        sampled = (
            Small::from_fn(n, n, |i, j| ad[(i, j)]),
            Small::from_fn(
                n,
                inputs,
                |i, j| {
                    if j == input { bd[i] } else { before.at(i, j) }
                },
            ),
        );
    }
    sampled
}

fn regulator<'py>(
    py: Python<'py>,
    discrete: bool,
    a: Small,
    b: Small,
    q: &Matrix<'py>,
    r: &Matrix<'py>,
    n: Option<Matrix<'py>>,
) -> PyResult<Answer<'py>> {
    let equation = Equation {
        discrete,
        a,
        b,
        q: Small::read("Q", q, Lies::Square)?,
        r: Small::read("R", r, Lies::Square)?,
        cross: n.map(|n| Small::read("N", &n, Lies::Column)).transpose()?,
    };
    let solved = equation.solve()?.map_err(error::design)?;
    Ok((
        solved.gain.array(py)?,
        solved.x.array(py)?,
        solved.poles(py),
    ))
}
