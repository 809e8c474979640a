//! One gain for every rig within a range.

use crate::arguments::{Names, RigLike};
use crate::background::awaited;
use crate::error;
use furuta_ctrl::design::{Weights, balance_weights};
use furuta_design::polytope::{LENGTHS_AND_MASS, key};
use furuta_design::robust_rig;
use numpy::{IntoPyArray, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A robust linear-quadratic regulator: one gain, with one Lyapunov function, for every rig whose parameters are within
/// a range.
///
/// Upright, continuous time. Of all gains with a guarantee it takes the one with the least mean guaranteed cost over
/// starts of equal variance.
///
/// Parameters
/// ----------
/// rig : Rig
///     Its springs, cables and tilt count as its file has them; delay, lag and a flexible drive in slowest alone.
/// spread : float
///     How far each parameter may be off, as a share of its value; all of them at once.
/// parameters : sequence of str or str, optional
///     Which; the arm's length, the pendulum's length and mass if left out.
/// q : sequence of 4 floats, optional
///     Diagonal of Q; together with r. What `furuta run` balances with if left out.
/// r : float, optional
///     Weight of the command.
///
/// Returns
/// -------
/// dict
///     K (4,): u = -K x; X (4, 4): from x on the cost is at most x' X x for every rig within the range without the
///     effects that remarks names; remarks: dict from effect to why the guarantee does not hold with it; K_nominal
///     (4,): the LQR; slowest and slowest_nominal (1/s): real part of the slowest pole over the rigs at the corners of
///     the range; A (n, 4, 4), B (n, 4, 1): linear models whose convex hull holds those of all rigs within the range.
///
/// Raises
/// ------
/// DesignError
///     A range without a common Lyapunov function (the largest that has one is named), parameters that cannot be off,
///     weights with which there is no gain.
///
/// Examples
/// --------
/// >>> import furuta
/// >>> found = furuta.robust_lqr(furuta.Rig.load("ramos-velasco"), 0.2)
/// >>> found["slowest_nominal"] > 0 > found["slowest"]
/// True
#[pyfunction]
#[pyo3(signature = (rig, spread = 0.2, *, parameters = None, q = None, r = None))]
pub(crate) fn robust_lqr<'py>(
    py: Python<'py>,
    rig: RigLike,
    spread: f64,
    parameters: Option<Names>,
    q: Option<[f64; 4]>,
    r: Option<f64>,
) -> PyResult<Bound<'py, PyDict>> {
    let weights = match (q, r) {
        (Some(q), Some(r)) => Weights::diagonal(q, [r]),
        (None, None) => balance_weights(&rig.rig.params),
        _ => return Err(error::design("give both q and r, or neither")),
    };
    let keys = match parameters {
        Some(Names(names)) => names
            .iter()
            .map(|name| key(name))
            .collect::<Result<Vec<_>, _>>()
            .map_err(error::design)?,
        None => LENGTHS_AND_MASS.to_vec(),
    };
    let rig = rig.rig;
    let found = awaited(py, move || {
        robust_rig::robust_rig(&rig, &keys, spread, &weights)
    })?
    .map_err(error::design)?;
    let out = PyDict::new(py);
    let k = &found.regulator.gain;
    out.set_item("K", k.as_slice().to_vec().into_pyarray(py))?;
    out.set_item(
        "K_nominal",
        found.nominal.as_slice().to_vec().into_pyarray(py),
    )?;
    // Symmetric: rows are columns.
    let cost = found.regulator.cost.as_slice().to_vec();
    out.set_item("X", cost.into_pyarray(py).reshape([4, 4])?)?;
    let remarks = PyDict::new(py);
    for remark in found.remarks() {
        remarks.set_item(remark.effect, remark.to_string())?;
    }
    out.set_item("remarks", remarks)?;
    out.set_item("slowest", found.slowest(k))?;
    out.set_item("slowest_nominal", found.slowest(&found.nominal))?;
    let points = &found.polytope.control_points;
    let a: Vec<f64> = points
        .iter()
        .flat_map(|m| m.a.transpose().as_slice().to_vec())
        .collect();
    let b: Vec<f64> = points
        .iter()
        .flat_map(|m| m.b.as_slice().to_vec())
        .collect();
    out.set_item("A", a.into_pyarray(py).reshape([points.len(), 4, 4])?)?;
    out.set_item("B", b.into_pyarray(py).reshape([points.len(), 4, 1])?)?;
    Ok(out)
}
