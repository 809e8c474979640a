//! Steady motions and the source papers' experiments.

use crate::arguments::RigLike;
use crate::background::awaited;
use crate::error;
use furuta_design::arm_step::{self as step, Contender as Holder};
use furuta_design::closed_loop::Sample;
use furuta_design::ramos_velasco::{Contender, Experiment};
use furuta_design::steady_motion::Motion;
use furuta_design::{largest_sine as sine, ramos_velasco as ramos, shahzad2022 as shahzad};
use furuta_model::Rig;
use furuta_model::linear_plant::{Hold, Load, rigid_remarks};
use furuta_model::params::Coefficients;
use furuta_model::series::DEGREE;
use numpy::{IntoPyArray, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Adds the functions of this file to the module.
pub(crate) fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(steady_motion, m)?)?;
    m.add_function(wrap_pyfunction!(largest_sine, m)?)?;
    m.add_function(wrap_pyfunction!(shahzad2022, m)?)?;
    m.add_function(wrap_pyfunction!(arm_step, m)?)?;
    m.add_function(wrap_pyfunction!(ramos_velasco, m)?)?;
    m.add_function(wrap_pyfunction!(ramos_velasco_draws, m)?)
}

fn coefficients(rig: &Rig, planar: bool) -> Coefficients<f64> {
    flat(rig.params.coefficients(), planar)
}

/// Without the sin(alpha)² inertia where `planar`.
fn flat(c: Coefficients<f64>, planar: bool) -> Coefficients<f64> {
    Coefficients {
        swing: if planar { 0.0 } else { c.swing },
        ..c
    }
}

type Polynomials<'py> = (
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
);

/// The steady motion on which a pendulum follows alpha = w2, a sine: power series in (w1, w2), w1' = lambda_ w2, w2' =
/// -lambda_ w1.
///
/// The solution of the regulator equation (Francis, Byrnes, Isidori). Coefficients are laid out as
/// `numpy.polynomial.polynomial.polyval2d(w1, w2, c)` expects them.
///
/// Parameters
/// ----------
/// rig : Rig
///     Springs and cables take part by their slopes where they let it rest, about which the series is. A UserWarning
///     names each effect that cannot.
/// lambda_ : float
///     Frequency of the sine, rad/s.
/// order : int
///     Of the series, 1 to 15; a controller file takes at most 7.
/// planar : bool
///     Without the sin(alpha)**2 inertia, as in the model of Ramos-Velasco et al. (whose beta is -alpha).
///
/// Returns
/// -------
/// theta, theta_dot, u : numpy.ndarray, shape (8, 8); beyond order 7 (order + 1, order + 1)
///     Coefficient [i, j] of w1**i w2**j in the arm's angle (rad), its speed (rad/s), the command (V).
///
/// Raises
/// ------
/// DesignError
///     An order or a frequency that is not possible; effects that let nothing rest upright, or that pull the pendulum
///     by where the arm is, such as arm.tilt.
///
/// Examples
/// --------
/// >>> import furuta
/// >>> theta, theta_dot, u = furuta.steady_motion(furuta.Rig.load("ramos-velasco"), 1.0, planar=True)
/// >>> [float(theta[i, j].round(2)) for i, j in [(0, 1), (2, 1), (0, 3)]]
/// [81.23, 18.69, 21.81]
#[pyfunction]
#[pyo3(signature = (rig, lambda_, *, order = 5, planar = false))]
pub(crate) fn steady_motion<'py>(
    py: Python<'py>,
    rig: RigLike,
    lambda_: f64,
    order: usize,
    planar: bool,
) -> PyResult<Polynomials<'py>> {
    let plant = rig.rig.try_plant().map_err(error::design)?;
    let load = Load::of(&plant, Hold::Arm(0.0)).map_err(error::design)?;
    let c = flat(plant.coefficients, planar);
    let steady = Motion::solve_under(&c, &load, lambda_, order).map_err(error::design)?;
    error::warn_each(py, rigid_remarks(&plant))?;
    let degree = order.max(DEGREE);
    let array = |which: usize| {
        let place = |i| (0..=degree).map(move |j| (i, j));
        let rows: Vec<f64> = (0..=degree)
            .flat_map(place)
            .map(|(i, j)| steady.coefficients(i, j)[which])
            .collect();
        rows.into_pyarray(py).reshape([degree + 1, degree + 1])
    };
    Ok((array(0)?, array(1)?, array(2)?))
}

/// The largest sine of `lambda_` rad/s that a pendulum can follow while its arm moves periodically, friction of the
/// hinge left out.
///
/// A fast arm pulls the pendulum outwards: beyond this amplitude no controller tracks.
///
/// Parameters
/// ----------
/// rig : Rig
/// lambda_ : float
///     Frequency of the sine, rad/s.
/// planar : bool
///     Without the sin(alpha)**2 inertia.
///
/// Returns
/// -------
/// float or None
///     Amplitude, rad; None where any up to 1.5 rad is possible.
///
/// Raises
/// ------
/// DesignError
///     A frequency that is not possible.
///
/// Examples
/// --------
/// >>> import furuta
/// >>> round(furuta.largest_sine(furuta.Rig.load("ramos-velasco"), 1.0), 3)
/// 0.073
#[pyfunction]
#[pyo3(signature = (rig, lambda_, *, planar = false))]
pub(crate) fn largest_sine(rig: RigLike, lambda_: f64, planar: bool) -> PyResult<Option<f64>> {
    if !(lambda_ > 0.0 && lambda_.is_finite()) {
        return Err(error::design(format!(
            "lambda_ = {lambda_} rad/s is not possible; a finite frequency above 0 is needed"
        )));
    }
    Ok(sine::amplitude(&coefficients(&rig.rig, planar), lambda_))
}

/// A run as arrays.
fn run<'py>(py: Python<'py>, samples: &[Sample]) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    let column = |value: fn(&Sample) -> f64| -> Vec<f64> { samples.iter().map(value).collect() };
    let rows = |value: fn(&Sample) -> [f64; 4]| {
        let rows: Vec<f64> = samples.iter().flat_map(value).collect();
        rows.into_pyarray(py).reshape([samples.len(), 4])
    };
    out.set_item("t", column(|s| s.t).into_pyarray(py))?;
    out.set_item("u", column(|s| s.u).into_pyarray(py))?;
    out.set_item("x", rows(|s| s.x.to_array())?)?;
    out.set_item("reference", rows(|s| s.reference.to_array())?)?;
    Ok(out)
}

/// Ten seconds of the experiments of Shahzad et al. 2022: the LQR of Q = I, R = 1 holds the pendulum.
///
/// Parameters
/// ----------
/// task : {"step", "steps", "push"}
///     The arm's reference steps by 0.1 rad after a second; it does so every second, there and back; the pendulum is
///     pushed.
/// on : {"linear", "nonlinear", "rig"}
///     The paper's linear model, the nonlinear one, that with encoders and friction. The push acts in the nonlinear
///     ones alone.
///
/// Returns
/// -------
/// dict
///     t, u of shape (N,), x, reference of shape (N, 4); 1000 samples a second.
///
/// Examples
/// --------
/// >>> import furuta
/// >>> run = furuta.papers.shahzad2022("step", "nonlinear")
/// >>> float(abs(run["x"][:, 1]).max().round(4))
/// 0.0032
#[pyfunction]
#[pyo3(signature = (task = "steps", on = "nonlinear"))]
pub(crate) fn shahzad2022<'py>(
    py: Python<'py>,
    task: &str,
    on: &str,
) -> PyResult<Bound<'py, PyDict>> {
    let task = match task {
        "step" => shahzad::Task::Step,
        "steps" => shahzad::Task::Steps,
        "push" => shahzad::Task::Push,
        _ => return Err(unknown("task", task, "step, steps, push")),
    };
    let on = match on {
        "linear" => shahzad::On::Linear,
        "nonlinear" => shahzad::On::Nonlinear,
        "rig" => shahzad::On::Rig,
        _ => return Err(unknown("on", on, "linear, nonlinear, rig")),
    };
    let rig = builtin("shahzad2022-srv02")?;
    let samples = awaited(py, move || {
        shahzad::run(&rig, task, on, &shahzad::Settings::default())
    })?
    .map_err(error::simulation)?;
    run(py, &samples)
}

/// A step of the arm under four controllers with the same weights, from rest on the nonlinear model: what knowing the
/// limits is worth.
///
/// LQR; sliding mode on its surface; model predictive control that lets the pendulum lean only so far, solved to the
/// end in each sample (Clarabel) and by the controller's own active-set method (as on a microcontroller).
///
/// Parameters
/// ----------
/// rig : Rig
///     Its effects are left out.
/// step : float
///     Where the arm is to go from zero, rad.
/// q : sequence of 4 floats, optional
///     Diagonal of Q; together with r. If left out the step asks for twice the full command.
/// r : float, optional
///     Weight of the command.
/// pendulum_angle : float, optional
///     How far the pendulum may lean, rad; half of what it leans under the LQR if left out.
/// rate : float
///     Samples per second, Hz.
/// duration : float
///     s.
/// iterations : int
///     Largest number of changes of the active limits in each sample.
///
/// Returns
/// -------
/// dict
///     pendulum_limit (rad), command_limit (V), and for each of "lqr", "sliding", "mpc_clarabel", "mpc_active_set" a
///     dict: t, u of shape (N,), x, reference of shape (N, 4); settle (s, None where it does not), overshoot (part of
///     the step), alpha_max (rad), u_max (V), violations (samples beyond the pendulum's limit), saturated (samples at
///     the command limit), effort (V**2 s), cost, up.
///
/// Raises
/// ------
/// SimulationError
///     Numbers outside their ranges, weights with which there is no gain.
///
/// Examples
/// --------
/// >>> import furuta
/// >>> study = furuta.arm_step(furuta.Rig.load("qube-servo-2"), pendulum_angle=0.1, duration=2.0)
/// >>> [round(study[name]["alpha_max"], 2) for name in ("lqr", "mpc_clarabel", "mpc_active_set")]
/// [0.21, 0.1, 0.1]
#[pyfunction]
#[pyo3(signature = (rig, step = 0.5, *, q = None, r = None, pendulum_angle = None, rate = 500.0, duration = 5.0,
    iterations = 200))]
#[allow(clippy::too_many_arguments)] // keywords of a Python function
pub(crate) fn arm_step<'py>(
    py: Python<'py>,
    rig: RigLike,
    step: f64,
    q: Option<[f64; 4]>,
    r: Option<f64>,
    pendulum_angle: Option<f64>,
    rate: f64,
    duration: f64,
    iterations: usize,
) -> PyResult<Bound<'py, PyDict>> {
    if q.is_some() != r.is_some() {
        return Err(error::simulation("give both q and r, or neither"));
    }
    let experiment = step::Experiment {
        step,
        rate,
        duration,
        weights: q.zip(r),
        pendulum: pendulum_angle,
        iterations,
    };
    let rig = rig.rig;
    let study = awaited(py, move || experiment.run(&rig))?.map_err(error::simulation)?;
    let out = PyDict::new(py);
    out.set_item("pendulum_limit", study.pendulum)?;
    out.set_item("command_limit", study.command)?;
    for one in &study.runs {
        let name = match one.contender {
            Holder::Lqr => "lqr",
            Holder::Sliding => "sliding",
            Holder::InteriorPoint => "mpc_clarabel",
            Holder::ActiveSet => "mpc_active_set",
        };
        let (f, columns) = (&one.figures, run(py, &one.samples)?);
        columns.set_item("settle", f.settle)?;
        columns.set_item("overshoot", f.overshoot)?;
        columns.set_item("alpha_max", f.alpha)?;
        columns.set_item("u_max", f.command)?;
        columns.set_item("violations", f.violations)?;
        columns.set_item("saturated", f.saturated)?;
        columns.set_item("effort", f.effort)?;
        columns.set_item("cost", f.cost)?;
        columns.set_item("up", f.up)?;
        out.set_item(name, columns)?;
    }
    Ok(out)
}

fn unknown(name: &str, given: &str, known: &str) -> PyErr {
    error::simulation(format!("{name} = \"{given}\" is none of {known}"))
}

fn builtin(name: &str) -> PyResult<Rig> {
    Rig::builtin(name).ok_or_else(|| error::rig(format!("{name} is not built in")))
}

fn experiment(on: &str, amplitude: Option<f64>, order: Option<usize>) -> PyResult<Experiment> {
    let rig = builtin("ramos-velasco")?;
    let mut experiment = match on {
        "planar" => Experiment::paper(&rig),
        "full" => Experiment::full(&rig),
        "rig" => Experiment::rig_like(&rig),
        _ => return Err(unknown("on", on, "planar, full, rig")),
    };
    experiment.amplitude = amplitude.unwrap_or(experiment.amplitude);
    experiment.order = order.unwrap_or(experiment.order);
    Ok(experiment)
}

fn contender(controller: &str) -> PyResult<Contender> {
    Ok(match controller {
        "regulator" => Contender::Regulator,
        "regulator_lqr" => Contender::RegulatorLqr,
        "normal_form" => Contender::NormalForm,
        "layer" => Contender::Layer,
        "twisting" => Contender::Twisting,
        _ => {
            return Err(unknown(
                "controller",
                controller,
                "regulator, regulator_lqr, normal_form, layer, twisting",
            ));
        }
    })
}

/// The experiment of Ramos-Velasco et al.: the pendulum follows a sine while arm length, pendulum length and mass are
/// off from 2 to 10 s.
///
/// Parameters
/// ----------
/// controller : {"regulator", "regulator_lqr", "normal_form", "layer", "twisting"}
///     Their sec. 4.1 with their gain; with that of an LQR; their sec. 4.2; sliding modes on the LQR's surface with a
///     boundary layer, by super-twisting.
/// on : {"planar", "full", "rig"}
///     Their planar model; the full one with a smaller sine; that at 500 Hz with encoders and friction.
/// factors : (float, float, float), optional
///     On the arm's length, the pendulum's length, its mass, while they are off; nothing is off if not given.
/// amplitude : float, optional
///     Of the sine, rad.
/// order : int, optional
///     Of the series for the regulator equation, 1 to 7.
///
/// Returns
/// -------
/// dict
///     t, u of shape (N,), x, reference of shape (N, 4); alpha = -beta. A run ends where the pendulum has fallen.
///
/// Raises
/// ------
/// SimulationError
///     An experiment that is not possible.
///
/// Examples
/// --------
/// >>> import furuta
/// >>> run = furuta.papers.ramos_velasco("normal_form", factors=(1.2, 1.2, 1.2))
/// >>> error = run["x"][4000:10000, 1] - run["reference"][4000:10000, 1]
/// >>> bool(abs(error).max() < 0.03)
/// True
#[pyfunction]
#[pyo3(signature = (controller = "normal_form", on = "planar", *, factors = None, amplitude = None, order = None))]
pub(crate) fn ramos_velasco<'py>(
    py: Python<'py>,
    controller: &str,
    on: &str,
    factors: Option<(f64, f64, f64)>,
    amplitude: Option<f64>,
    order: Option<usize>,
) -> PyResult<Bound<'py, PyDict>> {
    let experiment = experiment(on, amplitude, order)?;
    let contender = contender(controller)?;
    let (length, com, mass) = factors.unwrap_or((1.0, 1.0, 1.0));
    let factors = [length, com, mass];
    if !factors.iter().all(|f| f.is_finite() && *f > 0.0) {
        return Err(error::simulation(format!(
            "factors = {factors:?} must be finite and above 0"
        )));
    }
    let samples = awaited(py, move || {
        experiment
            .controller(contender)
            .and_then(|controller| experiment.run(&controller, factors))
    })?
    .map_err(error::simulation)?;
    run(py, &samples)
}

/// The same experiment on many draws of the three parameters, each uniform within `spread`, on all cores.
///
/// Returns
/// -------
/// dict
///     factors of shape (draws, 3); bound (rad, largest tracking error from 4 to 10 s, inf where the pendulum fell),
///     rms (rad), chatter (V/s, total variation of the command a second) of shape (draws,).
///
/// Examples
/// --------
/// >>> import furuta
/// >>> bool(furuta.papers.ramos_velasco_draws("layer", draws=8)["bound"].max() < 0.05)
/// True
#[pyfunction]
#[pyo3(signature = (controller = "normal_form", on = "planar", *, draws = 500, spread = 0.2, seed = 1, amplitude = None,
    order = None))]
#[allow(clippy::too_many_arguments)] // keywords of a Python function
pub(crate) fn ramos_velasco_draws<'py>(
    py: Python<'py>,
    controller: &str,
    on: &str,
    draws: usize,
    spread: f64,
    seed: u64,
    amplitude: Option<f64>,
    order: Option<usize>,
) -> PyResult<Bound<'py, PyDict>> {
    let experiment = experiment(on, amplitude, order)?;
    let contender = contender(controller)?;
    if !(0.0..=0.9).contains(&spread) {
        return Err(error::simulation(format!(
            "spread = {spread} must be between 0 and 0.9"
        )));
    }
    let drawn = awaited(py, move || {
        ramos::draws(&experiment, contender, draws, spread, seed, &|| ())
    })?
    .map_err(error::simulation)?
    .draws;
    let out = PyDict::new(py);
    let column = |value: fn(&ramos::Outcome) -> f64| -> Vec<f64> {
        drawn.iter().map(|d| value(&d.outcome)).collect()
    };
    let factors: Vec<f64> = drawn.iter().flat_map(|d| d.factors).collect();
    out.set_item(
        "factors",
        factors.into_pyarray(py).reshape([drawn.len(), 3])?,
    )?;
    out.set_item("bound", column(|o| o.bound).into_pyarray(py))?;
    out.set_item("rms", column(|o| o.rms).into_pyarray(py))?;
    out.set_item("chatter", column(|o| o.chatter).into_pyarray(py))?;
    Ok(out)
}
