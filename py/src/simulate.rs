//! Trajectories of the plant.

use crate::error;
use crate::matrix::{Matrix, Vector, state};
use crate::rig::PyRig;
use numpy::{IntoPyArray, PyArray2, PyArrayMethods};
use pyo3::prelude::*;

/// Steps between two looks at Ctrl-C: some milliseconds of work.
const STEPS_PER_CHECK: usize = 20_000;

/// Simulates the rig, its effects included, under a command held between samples.
///
/// Parameters
/// ----------
/// rig : Rig
/// x0 : array_like, shape (4,)
///     Initial state [theta, alpha, theta_dot, alpha_dot] in rad and rad/s; alpha = 0 is upright, pi hanging.
/// u : array_like, shape (N,)
///     Motor command in V; u[k] acts from row k to row k + 1. It is applied as given: the rig's command limit does not clip it.
/// dt : float
///     Sample period in s, at most 1.
/// substeps : int, optional
///     Runge-Kutta steps (4th order) per sample. One is enough for dt of a few ms.
///
/// Returns
/// -------
/// numpy.ndarray, shape (N + 1, 4)
///     True states, row 0 being x0. See `measure` for what the encoders would read.
///
/// Raises
/// ------
/// SimulationError
///     A number that is not finite, a period out of range, or a state that grows beyond all numbers (dt too long).
///
/// Examples
/// --------
/// >>> import numpy as np, furuta
/// >>> rig = furuta.Rig.load("qube-servo-2")
/// >>> x = furuta.simulate(rig, [0, np.pi, 0, 0], np.full(500, 0.5), dt=0.002)
/// >>> x.shape
/// (501, 4)
/// >>> bool(x[-1, 0] > 0.1)  # half a volt turns the arm
/// True
#[pyfunction]
#[pyo3(signature = (rig, x0, u, dt, *, substeps=1), text_signature = "(rig, x0, u, dt, *, substeps=1)")]
pub(crate) fn simulate<'py>(
    py: Python<'py>,
    rig: PyRef<'py, PyRig>,
    x0: Vector<'py>,
    u: Vector<'py>,
    dt: f64,
    substeps: usize,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    if substeps == 0 {
        return Err(error::simulation("substeps = 0; at least 1 is needed"));
    }
    let h = dt / substeps as f64;
    let plant = rig.rig.try_plant::<f64>().map_err(error::rig)?;
    plant.check_period(dt).map_err(error::simulation)?;
    plant.check_period(h).map_err(error::simulation)?;
    let mut now = plant.rest(state("x0", &x0)?);
    let u: Vec<f64> = u.as_array().iter().copied().collect();
    if let Some(k) = u.iter().position(|v| !v.is_finite()) {
        return Err(error::simulation(format!(
            "u[{k}] = {} is not a finite number",
            u[k]
        )));
    }
    let mut out = Vec::with_capacity(4 * (u.len() + 1));
    out.extend(now.x.to_array());
    for (begin, commands) in u.chunks(STEPS_PER_CHECK.div_ceil(substeps)).enumerate() {
        let lost = py.detach(|| {
            for (k, &u) in commands.iter().enumerate() {
                for _ in 0..substeps {
                    plant.step(&mut now, u, h);
                }
                if !now.x.is_finite() {
                    return Some(k);
                }
                out.extend(now.x.to_array());
            }
            None
        });
        if let Some(k) = lost {
            let row = begin * STEPS_PER_CHECK.div_ceil(substeps) + k + 1;
            return Err(error::simulation(format!(
                "the state is no longer finite at row {row}: use a shorter dt or more substeps (dt = {dt} s, substeps = {substeps})"
            )));
        }
        py.check_signals()?;
    }
    out.into_pyarray(py).reshape([u.len() + 1, 4])
}

/// Angles that the rig's encoders would show for true states, rounded to counts, sensor effects of the rig included.
///
/// Parameters
/// ----------
/// rig : Rig
/// x : array_like, shape (N, 4)
///     True states as returned by `simulate`, rad and rad/s.
///
/// Returns
/// -------
/// numpy.ndarray, shape (N, 2)
///     Measured [theta, alpha] in rad.
///
/// Examples
/// --------
/// >>> import furuta
/// >>> rig = furuta.Rig.load("qube-servo-2").with_effect("sensor.alpha.offset", angle=0.05)
/// >>> float(furuta.measure(rig, [[0, 0, 0, 0]])[0, 1].round(2))
/// 0.05
#[pyfunction]
#[pyo3(text_signature = "(rig, x)")]
pub(crate) fn measure<'py>(
    py: Python<'py>,
    rig: PyRef<'py, PyRig>,
    x: Matrix<'py>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let x = x.as_array();
    let (rows, columns) = x.dim();
    if columns != 4 {
        return Err(error::simulation(format!(
            "x has shape ({rows}, {columns}); states have 4 columns"
        )));
    }
    let plant = rig.rig.try_plant::<f64>().map_err(error::rig)?;
    let counts = rig.rig.sensors.resolution();
    let mut out = Vec::with_capacity(2 * rows);
    for row in x.rows() {
        let read = plant.reading([row[0], row[1]]);
        out.extend((0..2).map(|i| (read[i] / counts[i]).round() * counts[i]));
    }
    out.into_pyarray(py).reshape([rows, 2])
}
