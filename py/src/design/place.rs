//! Pole placement.

use crate::error;
use crate::matrix::{Lies, Matrix, Small, Vector, vector};
use furuta_ctrl::design;
use numpy::{Complex64, PyArray2};
use pyo3::prelude::*;

/// The gain that gives A - B K these poles, for one input: u = -K x.
///
/// The same for sampled and for continuous systems. The gain of an estimator is place(A.T, C.T, p).T.
///
/// Parameters
/// ----------
/// A : array_like, shape (n, n)
///     n from 1 to 8.
/// B : array_like, shape (n, 1)
/// p : array_like of complex, shape (n,)
///     The poles. Complex ones with their conjugates; all with a real part below 0, or all with a modulus below 1.
///
/// Returns
/// -------
/// K : numpy.ndarray, shape (1, n)
///
/// Raises
/// ------
/// DesignError
///     Shapes that do not fit, poles that are stable neither in continuous nor in discrete time, a complex pole without
///     its conjugate, or a system that the input does not reach entirely.
///
/// Examples
/// --------
/// >>> import furuta
/// >>> furuta.place([[0, 1], [0, 0]], [[0], [1]], [-1 + 1j, -1 - 1j]).tolist()
/// [[2.0, 2.0]]
#[pyfunction]
#[pyo3(signature = (A, B, p), text_signature = "(A, B, p)")]
#[allow(non_snake_case)] // keywords in Python
pub(crate) fn place<'py>(
    py: Python<'py>,
    A: Matrix<'py>,
    B: Matrix<'py>,
    p: Vector<'py>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let (a, b) = (
        Small::read("A", &A, Lies::Square)?,
        Small::read("B", &B, Lies::Column)?,
    );
    let poles: Vec<Complex64> = vector("p", &p, error::design)?;
    stable(&poles)?;
    let n = a.rows();
    a.expect("A", (n, n))?;
    b.expect("B", (n, 1))?;
    if poles.len() != n {
        return Err(error::design(format!(
            "{} poles for {n} states; give one for each",
            poles.len()
        )));
    }
    macro_rules! sized {
        ($($n:literal)*) => {
            match n {
                $($n => sized::<$n>(&a, &b, &poles)?,)*
                _ => return Err(error::design(format!("{n} states; 1 to 8 are possible"))),
            }
        };
    }
    sized!(1 2 3 4 5 6 7 8).array(py)
}

/// Refuses poles that are stable neither as those of a continuous system nor as those of a sampled one.
fn stable(poles: &[Complex64]) -> PyResult<()> {
    let grows = poles.iter().enumerate().find(|(_, p)| p.re >= 0.0);
    let grows_sampled = poles.iter().enumerate().find(|(_, p)| p.norm() >= 1.0);
    let (Some((i, p)), Some((k, z))) = (grows, grows_sampled) else {
        return Ok(());
    };
    Err(error::design(format!(
        "p[{i}] = {p} is not stable in continuous time (real part below 0), nor p[{k}] = {z} in discrete time \
         (modulus below 1): the loop would grow; give poles that are all stable in one of the two"
    )))
}

fn sized<const N: usize>(a: &Small, b: &Small, poles: &[Complex64]) -> PyResult<Small> {
    let wanted = std::array::from_fn(|i| poles[i]);
    let gain = design::place(&a.fixed::<N, N>("A")?, &b.fixed::<N, 1>("B")?, &wanted);
    Ok(Small::from_fixed(&gain.map_err(error::design)?))
}
