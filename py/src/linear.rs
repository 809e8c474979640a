//! Linear models of the plant.

use crate::arguments::RigLike;
use crate::error;
use crate::matrix::{Lies, Matrix, Small, Vector, array, state};
use furuta_model::linear_plant::{Hold, rigid, rigid_remarks, smooth};
use furuta_model::{Linear, Plant, State};
use numpy::PyArray2;
use pyo3::prelude::*;

type Pair<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>);

/// Jacobians of the equations of motion, exact to rounding: x' = A (x - x0) + B (u - u0).
///
/// Parameters
/// ----------
/// rig : Rig
/// x : array_like, shape (4,), optional
///     State [theta, alpha, theta_dot, alpha_dot] in rad and rad/s; where the rig rests upright with its arm at 0 if
///     not given.
/// u : float, optional
///     Motor command in V; what holds the rig at rest if neither x nor u is given.
/// effects : bool, optional
///     Which of the rig's effects take part. Not given: those that have a slope, such as springs, cables and a tilt, as
///     `furuta design` and the controllers take them; a UserWarning names each of the others. True: all, dry friction
///     as it is at x: at rest it holds the arm. False: none.
///
/// Returns
/// -------
/// A : numpy.ndarray, shape (4, 4)
/// B : numpy.ndarray, shape (4, 1)
///     Per volt of command.
///
/// Examples
/// --------
/// >>> import furuta
/// >>> A, B = furuta.linearize(furuta.Rig.load("shahzad2022-srv02"))
/// >>> [round(float(v), 2) for v in A[2:, 1]]  # published: 54.06, 109.56
/// [54.06, 109.56]
///
/// A spring of the rig file pulls the arm back; dry friction is said to be left out:
///
/// >>> sprung = furuta.Rig.load("shahzad2022-srv02").with_effect("arm.spring", stiffness=0.02, rest=0.0)
/// >>> bool(furuta.linearize(sprung)[0][2, 0] < 0)
/// True
#[pyfunction]
#[pyo3(signature = (rig, x=None, u=0.0, *, effects=None))]
pub(crate) fn linearize<'py>(
    py: Python<'py>,
    rig: RigLike,
    x: Option<Vector<'py>>,
    u: f64,
    effects: Option<bool>,
) -> PyResult<Pair<'py>> {
    let given = x.is_some() || u != 0.0;
    let x = x.map_or(Ok(State::upright()), |x| state("x", &x))?;
    if !u.is_finite() {
        return Err(error::simulation(format!("u = {u} is not a finite number")));
    }
    let rig = rig.rig;
    let whole = || rig.try_plant().map_err(error::rig);
    let linear = match effects {
        Some(true) => furuta_model::linearize(&whole()?, x, u),
        Some(false) => furuta_model::linearize(&rig.nominal_plant(), x, u),
        None => {
            let plant = whole()?;
            error::warn_each(py, rigid_remarks(&plant))?;
            if given {
                furuta_model::linearize(&smooth(&plant), x, u)
            } else {
                at_rest(&plant)?
            }
        }
    };
    Ok((array(py, &linear.a)?, array(py, &linear.b)?))
}

/// The model that designs are made for: upright where the rig rests with its arm at 0, with the effects that have a
/// slope there.
pub(crate) fn at_rest(plant: &Plant<f64>) -> PyResult<Linear> {
    rigid(plant, Hold::Arm(0.0)).map_err(error::design)
}

/// The sampled system x[k+1] = Ad x[k] + Bd u[k] of x' = A x + B u with u held between samples.
///
/// Parameters
/// ----------
/// A : array_like, shape (n, n)
///     n from 1 to 8.
/// B : array_like, shape (n, 1)
/// dt : float
///     Sample period in s.
///
/// Returns
/// -------
/// Ad : numpy.ndarray, shape (n, n)
/// Bd : numpy.ndarray, shape (n, 1)
///
/// Examples
/// --------
/// >>> import furuta
/// >>> Ad, Bd = furuta.zero_order_hold([[0, 1], [0, 0]], [[0], [1]], 0.1)
/// >>> Ad[0, 1].round(12).item(), Bd[:, 0].round(12).tolist()
/// (0.1, [0.005, 0.1])
#[pyfunction]
#[pyo3(signature = (A, B, dt), text_signature = "(A, B, dt)")]
#[allow(non_snake_case)] // keywords in Python
pub(crate) fn zero_order_hold<'py>(
    py: Python<'py>,
    A: Matrix<'py>,
    B: Matrix<'py>,
    dt: f64,
) -> PyResult<Pair<'py>> {
    fn sized<'py, const N: usize>(
        py: Python<'py>,
        a: &Small,
        b: &Small,
        dt: f64,
    ) -> PyResult<Pair<'py>> {
        let (ad, bd) = furuta_model::discretize::zero_order_hold(
            &a.fixed::<N, N>("A")?,
            &b.fixed::<N, 1>("B")?,
            dt,
        );
        if !ad.iter().chain(&bd).all(|x| x.is_finite()) {
            return Err(error::design(format!(
                "over dt = {dt} s an unstable mode of A grows beyond what a number holds: give a shorter dt"
            )));
        }
        Ok((array(py, &ad)?, array(py, &bd)?))
    }
    if !(dt > 0.0 && dt.is_finite()) {
        return Err(error::design(format!(
            "dt = {dt} s; a positive number is needed"
        )));
    }
    let (a, b) = (
        Small::read("A", &A, Lies::Square)?.finite("A")?,
        Small::read("B", &B, Lies::Column)?.finite("B")?,
    );
    match a.rows() {
        1 => sized::<1>(py, &a, &b, dt),
        2 => sized::<2>(py, &a, &b, dt),
        3 => sized::<3>(py, &a, &b, dt),
        4 => sized::<4>(py, &a, &b, dt),
        5 => sized::<5>(py, &a, &b, dt),
        6 => sized::<6>(py, &a, &b, dt),
        7 => sized::<7>(py, &a, &b, dt),
        8 => sized::<8>(py, &a, &b, dt),
        n => Err(error::design(format!(
            "A has {n} rows; 1 to 8 are possible"
        ))),
    }
}
