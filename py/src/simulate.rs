//! Trajectories of the plant, one at a time.

use crate::arguments::RigLike;
use crate::controlled::{SimulationRequest, controlled, targets};
use crate::controller::PyController;
use crate::error;
use crate::matrix::{Matrix, Vector, state, states, vector};
use crate::rig::PyRig;
use furuta_model::Plant;
use furuta_model::effects::{Acts, Law};
use furuta_model::simulate::{SimulationError, follow};
use numpy::{IntoPyArray, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Simulates the rig, its effects included, under a command held between samples.
///
/// Each call begins anew: at run time 0, and with what effects remember as after a long rest at x0. To go on where a
/// call ended, sample by sample, use `furuta.Simulator`: calls of one sample each would forget.
///
/// Parameters
/// ----------
/// rig : Rig
/// x0 : array_like, shape (4,)
///     Initial state [theta, alpha, theta_dot, alpha_dot] in rad and rad/s; alpha = 0 is upright, pi hanging. What
///     effects remember (late commands, lagging voltage, bristles, backlash) starts as after a long rest there.
/// u : array_like, shape (N,)
///     Motor command in V; u[k] acts from row k to row k + 1. It is applied as given: the rig's command limit does not
///     clip it.
/// dt : float
///     Sample period in s, at most 1.
/// substeps : int, optional
///     Runge-Kutta steps (4th order) per sample. One is enough for dt of a few ms. With a Controller that works without
///     `estimator`, at least as many as make each at most 1 ms long.
/// run : int, optional
///     Which run this is, from 0: a kick ("disturbance.kick", "disturbance.arm_kick") belongs to one run.
/// encoders : bool, optional
///     True: return what the encoders read as well.
/// controller : Controller or callable, optional
///     A control system: it swings up, catches and balances, on the encoders' readings, and its command acts one sample
///     after it is decided, as on a real rig. `u` is then added to its command (zeros: nothing is), within the rig's
///     command limit. Or any callable: `controller(t, x)` gives the command in V for the time t (s) and the state x of
///     shape (4,) that the estimator sees.
/// reference : array_like, shape () or (N,), optional
///     With a controller: where the arm is to be once the pendulum is up, rad; 0 if not given.
/// ideal : bool, optional
///     With a controller: the file's controller (or the callable) alone, on the true states and without delay; the
///     file's controller must start near upright.
/// estimator : Estimator or callable, optional
///     With a controller: what it sees the rig through; the callable's is "kalman" if not given. Any callable will do:
///     `estimator(t, theta, alpha, held)` gives the state, shape (4,), for measured angles (rad) and the command (V)
///     that the motor holds. A Controller then acts alone, without its own estimator, swing-up and limits.
///
/// Returns
/// -------
/// numpy.ndarray, shape (N + 1, 4)
///     True states, row 0 being x0.
/// numpy.ndarray, shape (N,)
///     Only with `controller`: the command that acts from row k to row k + 1, V.
/// list of str, N entries
///     Only with `controller`: its mode: "swing-up", "balance", "braking" after a limit, or "fault", from which on the
///     motor is off; "callable" where Python decides.
/// numpy.ndarray, shape (N + 1, 2)
///     Only with `encoders`: measured [theta, alpha] in rad, rounded to counts, effects of the sensors included.
///
/// Raises
/// ------
/// SimulationError
///     A number that is not finite, a period out of range (for a delay or a flexible coupling, too), or a state that
///     grows beyond all numbers (dt too long).
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
/// >>> late = rig.with_effect("sensor.delay", delay=0.004)
/// >>> x, y = furuta.simulate(late, [0, np.pi, 0, 0], np.full(500, 0.5), dt=0.002, encoders=True)
/// >>> bool(abs(y[2:] - x[:-2, :2]).max() < 2 * np.pi / 2048)  # two samples late, rounded to counts
/// True
/// >>> srv02 = furuta.Rig.load("shahzad2022-srv02")
/// >>> standard = furuta.Controller.from_toml("", srv02, dt=0.002)
/// >>> x, u, modes = furuta.simulate(srv02, [0, np.pi, 0, 0], np.zeros(2500), dt=0.002, controller=standard)
/// >>> modes[0], modes[-1], bool(abs(u).max() <= 10)
/// ('swing-up', 'balance', True)
/// >>> K, S, poles = furuta.lqr(srv02, np.eye(4), 1)
/// >>> x, u, modes = furuta.simulate(srv02, [0, 0.1, 0, 0], np.zeros(500), 0.002, controller=lambda t, x: -K @ x)
/// >>> bool(abs(x[-1, 1]) < 0.02)
/// True
#[pyfunction]
#[pyo3(
    signature = (
        rig, x0, u, dt, *, substeps=1, run=0, encoders=false, controller=None, reference=None, ideal=false,
        estimator=None
    ),
    text_signature = "(rig, x0, u, dt, *, substeps=1, run=0, encoders=False, controller=None, \
        reference=None, ideal=False, estimator=None)"
)]
#[allow(clippy::too_many_arguments)] // keywords in Python
pub(crate) fn simulate<'py>(
    py: Python<'py>,
    rig: RigLike,
    x0: Vector<'py>,
    u: Vector<'py>,
    dt: f64,
    substeps: usize,
    run: usize,
    encoders: bool,
    controller: Option<Bound<'py, PyAny>>,
    reference: Option<Bound<'py, PyAny>>,
    ideal: bool,
    estimator: Option<Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let own = controller
        .as_ref()
        .map(|controller| controller.cast::<PyController>());
    if matches!(own, Some(Err(_))) || estimator.is_some() {
        let keywords = PyDict::new(py);
        keywords.set_item("substeps", substeps)?;
        keywords.set_item("run", run)?;
        keywords.set_item("encoders", encoders)?;
        keywords.set_item("controller", &controller)?;
        keywords.set_item("reference", reference)?;
        keywords.set_item("ideal", ideal)?;
        keywords.set_item("estimator", estimator)?;
        let rig = PyRig { rig: rig.rig };
        return py
            .import("furuta._loop")?
            .getattr("simulate")?
            .call((rig, x0, u, dt), Some(&keywords));
    }
    if let Some(Ok(controller)) = own {
        let added: Vec<f64> = vector("u", &u, error::said)?;
        let request = SimulationRequest {
            x0: state("x0", &x0)?,
            reference: targets(reference.as_ref(), added.len())?,
            added,
            period: dt,
            substeps,
            run,
            encoders,
            ideal,
        };
        return controlled(py, &rig.rig, &controller.borrow(), &request);
    }
    if reference.is_some() || ideal {
        return Err(error::simulation(
            "reference and ideal belong to a controller: give controller=...",
        ));
    }
    let rig = &rig.rig;
    let plant = rig.try_plant::<f64>().map_err(error::rig)?;
    let mut start = plant.rest(state("x0", &x0)?);
    start.run = run;
    let u: Vec<f64> = vector("u", &u, error::said)?;
    let rows = u.len() + 1;
    let mut states = Vec::with_capacity(4 * rows);
    let mut readings = Vec::with_capacity(if encoders { 2 * rows } else { 0 });
    let mut interrupt = None;
    let done = py.detach(|| {
        let proceed = |_| match Python::attach(|py| py.check_signals()) {
            Ok(()) => true,
            Err(signal) => {
                interrupt = Some(signal);
                false
            }
        };
        follow(&plant, start, &u, dt, substeps, proceed, |s| {
            states.extend(s.x.to_array());
            if encoders {
                readings.extend(rig.sensors.quantised(plant.measure(s)));
            }
        })
    });
    if let Some(signal) = interrupt {
        return Err(signal);
    }
    done.map_err(|e| match e {
        SimulationError::Command { sample, value } => {
            error::simulation(format!("u[{sample}] = {value} is not a finite number"))
        }
        SimulationError::Diverged { sample } => error::simulation(format!(
            "the state is no longer finite at row {}: use a shorter dt or more substeps (dt = {dt} s, \
             substeps = {substeps})",
            sample + 1
        )),
        e => error::simulation(e),
    })?;
    let states = states.into_pyarray(py).reshape([rows, 4])?;
    if !encoders {
        return Ok(states.into_any());
    }
    let readings = readings.into_pyarray(py).reshape([rows, 2])?;
    Ok((states, readings).into_pyobject(py)?.into_any())
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
/// Raises
/// ------
/// SimulationError
///     States of another shape or that are not finite, or a rig whose readings do not follow from the state alone:
///     encoders that are late ("sensor.delay"), an encoder on the motor behind backlash. `simulate(...,
///     encoders=True)` knows them.
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
    rig: RigLike,
    x: Matrix<'py>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let x = states("x", &x)?;
    if let Some(k) = x.iter().position(|row| !row.iter().all(|v| v.is_finite())) {
        return Err(error::simulation(format!(
            "x[{k}] = {:?} holds a number that is not finite",
            x[k]
        )));
    }
    let rows = x.len();
    let plant = rig.rig.try_plant::<f64>().map_err(error::rig)?;
    if let Some(id) = beyond_the_state(&plant) {
        return Err(error::simulation(format!(
            "{id}: what the encoders read does not follow from the states alone; call simulate(..., encoders=True)"
        )));
    }
    let mut out = Vec::with_capacity(2 * rows);
    for row in x {
        out.extend(rig.rig.sensors.quantised(plant.reading([row[0], row[1]])));
    }
    out.into_pyarray(py).reshape([rows, 2])
}

/// The effect for which readings depend on more than the mechanical state.
fn beyond_the_state(plant: &Plant<f64>) -> Option<&'static str> {
    plant
        .effects()
        .iter()
        .find(|e| e.spec().acts.includes(Acts::SENSOR_DELAY) || e.drive().encoder_on_motor)
        .map(|e| e.spec().id)
}
