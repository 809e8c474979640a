//! A rig with its effects under a linear law.

use crate::arguments::RigLike;
use crate::background::awaited;
use crate::controller::PyController;
use crate::error;
use crate::matrix::{Vector, vector};
use furuta_ctrl::controllers::{Lqi, StateFeedback};
use furuta_ctrl::estimators::{AnyEstimator, Estimator};
use furuta_ctrl::settings::Settings;
use furuta_ctrl::{Config, ControllerFile, Site};
use furuta_design::rehearsal;
use furuta_design::rig_loop::{Law, Margins, ObservedLoop, RigLoop};
use furuta_model::Rig;
use furuta_model::linear_plant::Amplitudes;
use numpy::{IntoPyArray, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;

/// The closed loop of a rig with its effects under u = -K x - ki * integral of theta: poles and margins.
///
/// Springs, cables and tilt count where they let the rig rest under this law; a flexible drive, a lag and delays are
/// states of the loop (a delay exactly, for any share of a sample; in continuous time by a Padé approximation). x is
/// the true state at the sample: estimators, counts and limits are in `rehearse`.
///
/// Parameters
/// ----------
/// rig : Rig
/// K : array_like, shape (4,) or (5,), Controller, or path
///     On [theta, alpha, theta_dot, alpha_dot], in V/rad and V s/rad; the fifth, if any, on the integral of theta, in
///     V/(rad s). Or a controller, or a controller file, by the law that it is near upright: an mpc by its regulator, a
///     scheduled_lqr while the arm rests, a pid without its low pass.
/// rate : float, optional
///     Samples per second, the command held between samples. If not given, that of the Controller, or continuous time;
///     a file needs one.
/// amplitudes : sequence of 3 floats, optional
///     Amplitudes of the arm's speed (rad/s), the pendulum's speed (rad/s) and the command (V) for which friction and
///     voltage maps without a slope are replaced by their describing functions; 0 leaves them out.
/// omega : array_like, optional
///     Frequencies (rad/s) at which the loop's response is wanted.
///
/// Returns
/// -------
/// dict
///     states: names of the loop's states; A: the closed loop's matrix in their order; poles (in 1/s, or of the sampled
///     system); growth: largest real part of the poles as those of continuous time, 1/s; equilibrium: theta, alpha
///     (rad), motor and command (V); delay: of command and encoders together, s; remarks: dict from effect to what of
///     it is not in the matrices; margins: dict of stable, gain (lower and upper factor), phase (rad), delay (s), disk
///     (0 to 2) and frequencies (rad/s) of the lower gain, upper gain, phase and disk margin; with_estimator (where a
///     rate is given): growth, poles and margins of the same loop as it is run, the law given the standard estimator's
///     state, which looks ahead over one sample and the command's delay; response: L at omega, the loop broken at the
///     command, where -1 is the edge of stability.
///
/// Raises
/// ------
/// DesignError
///     Effects that let nothing rest upright, a rate at which the rig cannot be stepped, shapes that do not fit, or a
///     controller without a linear law.
///
/// Examples
/// --------
/// >>> import furuta, numpy as np
/// >>> rig = furuta.Rig.load("shahzad2022-srv02")
/// >>> K, _, _ = furuta.lqr(*furuta.linearize(rig), np.diag([1, 10, 0, 0]), 0.01)
/// >>> loop = furuta.closed_loop(rig, K[0])
/// >>> loop["margins"]["gain"][1], loop["margins"]["phase"] > 1.04  # an LQR's: no upper limit, 60 degrees
/// (inf, True)
#[pyfunction]
#[pyo3(signature = (rig, K, *, rate = None, amplitudes = None, omega = None))]
#[allow(non_snake_case)]
pub(crate) fn closed_loop<'py>(
    py: Python<'py>,
    rig: RigLike,
    K: Given<'py>,
    rate: Option<f64>,
    amplitudes: Option<[f64; 3]>,
    omega: Option<Vector<'py>>,
) -> PyResult<Bound<'py, PyDict>> {
    let given = rate.map(period).transpose()?;
    let (law, period, estimator) = K.law(&rig.rig, given)?;
    let [arm_speed, pendulum_speed, command] = amplitudes.unwrap_or_default();
    if ![arm_speed, pendulum_speed, command]
        .iter()
        .all(|a| a.is_finite() && *a >= 0.0)
    {
        return Err(error::design(
            "amplitudes must be three numbers of at least 0",
        ));
    }
    let amplitudes = Amplitudes {
        arm_speed,
        pendulum_speed,
        command,
    };
    let closed = RigLoop::new(&rig.rig, law, period, &amplitudes).map_err(error::design)?;
    let out = PyDict::new(py);
    let states = closed.states();
    let n = states.len();
    out.set_item("states", states)?;
    // nalgebra stores columns, NumPy rows.
    let matrix = closed.matrix().transpose().as_slice().to_vec();
    out.set_item("A", matrix.into_pyarray(py).reshape([n, n])?)?;
    out.set_item("poles", closed.poles().into_pyarray(py))?;
    out.set_item("growth", closed.growth())?;
    let at = &closed.plant.at;
    let equilibrium = PyDict::new(py);
    equilibrium.set_item("theta", at.x.theta)?;
    equilibrium.set_item("alpha", at.x.alpha)?;
    equilibrium.set_item("motor", at.volts)?;
    equilibrium.set_item("command", at.command)?;
    out.set_item("equilibrium", equilibrium)?;
    out.set_item("delay", closed.delay())?;
    let remarks = PyDict::new(py);
    for remark in &closed.plant.remarks {
        remarks.set_item(remark.effect, remark.to_string())?;
    }
    out.set_item("remarks", remarks)?;
    let of = closed.clone();
    let found = awaited(py, move || of.margins())?;
    out.set_item("margins", margins(py, &found)?)?;
    if let Some(observed) = observed(&rig.rig, &closed, &estimator) {
        let (found, growth, poles) = awaited(py, move || {
            (observed.margins(), observed.growth(), observed.poles())
        })?;
        let with_estimator = PyDict::new(py);
        with_estimator.set_item("growth", growth)?;
        with_estimator.set_item("poles", poles.into_pyarray(py))?;
        with_estimator.set_item("margins", margins(py, &found)?)?;
        out.set_item("with_estimator", with_estimator)?;
    }
    if let Some(omega) = omega {
        let omega: Vec<f64> = vector("omega", &omega, error::design)?;
        if let Some(k) = omega.iter().position(|w| !w.is_finite()) {
            return Err(error::design(format!(
                "omega[{k}] = {} is not a finite number",
                omega[k]
            )));
        }
        let response: Vec<_> = omega.iter().map(|w| closed.response(*w)).collect();
        out.set_item("response", response.into_pyarray(py))?;
    }
    Ok(out)
}

/// Tries a law on the nonlinear model of a rig with its effects, encoders and limits before anything moves.
///
/// The standard control system of `furuta run` with this law, upright from 0.02 rad for 30 s; a command acts from the
/// sample after the one it is decided at.
///
/// Parameters
/// ----------
/// rig : Rig
/// K : array_like, shape (4,) or (5,)
///     As in `closed_loop`.
/// rate : float, optional
///     Samples per second.
///
/// Returns
/// -------
/// dict
///     fell: when it fell or was stopped, s, or None; fault: why it was stopped, or None; arm, pendulum: furthest
///     angles in the last half, rad; at_limit: share of the samples at the command limit.
///
/// Raises
/// ------
/// DesignError
///     A rig that cannot have this control system.
///
/// Examples
/// --------
/// >>> import furuta
/// >>> rig = furuta.Rig.load("shahzad2022-srv02")
/// >>> furuta.rehearse(rig, [-2.0, 30.0, -1.5, 3.0])["fell"] is None
/// True
/// >>> furuta.rehearse(rig, [2.0, -30.0, 1.5, -3.0])["fell"] is None
/// False
#[pyfunction]
#[pyo3(signature = (rig, K, *, rate = 500.0))]
#[allow(non_snake_case)]
pub(crate) fn rehearse<'py>(
    py: Python<'py>,
    rig: RigLike,
    K: Vector<'py>,
    rate: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let law = law(&K)?;
    let period = period(rate)?;
    let settings = if law.integral == 0.0 {
        StateFeedback::<f64>::settings()
    } else {
        Lqi::<f64>::settings()
    };
    let mut settings = settings.with("gain", &law.gain).map_err(error::design)?;
    if law.integral != 0.0 {
        settings = settings
            .with("integral_gain", &[law.integral])
            .map_err(error::design)?;
    }
    let rig = rig.rig.clone();
    let told = awaited(py, move || {
        rehearsal::rehearse(&Config::with_controller(settings), &rig, period, 0.0)
    })?
    .map_err(error::design)?;
    let out = PyDict::new(py);
    out.set_item("fell", told.fell)?;
    out.set_item("fault", told.fault.map(|f| f.to_string()))?;
    out.set_item("arm", told.swept[0])?;
    out.set_item("pendulum", told.swept[1])?;
    out.set_item("at_limit", told.at_limit)?;
    Ok(out)
}

/// The same loop with an estimator, where it is sampled.
fn observed(rig: &Rig, closed: &RigLoop, estimator: &Settings) -> Option<ObservedLoop> {
    let site = Site::of(rig, closed.period?);
    let estimator = AnyEstimator::<f64>::design(estimator, &site).ok()?;
    closed.observed(estimator.linear()?)
}

pub(super) fn margins<'py>(py: Python<'py>, found: &Margins) -> PyResult<Bound<'py, PyDict>> {
    let margins = PyDict::new(py);
    margins.set_item("stable", found.stable)?;
    margins.set_item("gain", (found.gain[0], found.gain[1]))?;
    margins.set_item("phase", found.phase)?;
    margins.set_item("delay", found.delay)?;
    margins.set_item("disk", found.disk)?;
    margins.set_item("frequencies", found.at.to_vec())?;
    Ok(margins)
}

/// What stands for a law: a gain, a controller or a controller file.
#[derive(FromPyObject)]
pub(crate) enum Given<'py> {
    Controller(PyRef<'py, PyController>),
    File(PathBuf),
    Gain(Vector<'py>),
}

impl Given<'_> {
    /// The law, the sample period (s) and the estimator's settings, for a loop at `period` if one is given.
    fn law(&self, rig: &Rig, period: Option<f64>) -> PyResult<(Law, Option<f64>, Settings)> {
        match self {
            Self::Gain(k) => Ok((law(k)?, period, Config::default().estimator)),
            Self::Controller(controller) => {
                if let Some(period) = period {
                    controller.check_period(period)?;
                }
                let law = Law::of(&controller.supervisor.balance).map_err(error::design)?;
                let estimator = controller.config().estimator.clone();
                Ok((law, Some(controller.period()), estimator))
            }
            Self::File(path) => {
                let period = period.ok_or_else(|| {
                    error::design(format!(
                        "{}: a controller file needs a rate, the samples per second that it is made for",
                        path.display()
                    ))
                })?;
                let file = ControllerFile::load(path).map_err(error::controller)?;
                let law = Law::of_controller(&file.config.controller, &Site::of(rig, period));
                let law = law.map_err(|e| error::design(format!("{}: {e}", path.display())))?;
                Ok((law, Some(period), file.config.estimator))
            }
        }
    }
}

fn law(k: &Vector<'_>) -> PyResult<Law> {
    let k: Vec<f64> = vector("K", k, error::design)?;
    if !k.iter().all(|k| k.is_finite()) {
        return Err(error::design(format!(
            "K = {k:?} holds a number that is not finite"
        )));
    }
    match k[..] {
        [a, b, c, d] => Ok(Law::of_states([a, b, c, d])),
        [a, b, c, d, integral] => Ok(Law {
            gain: [a, b, c, d],
            integral,
        }),
        _ => Err(error::design(format!(
            "K has {} numbers; give 4, or 5 with one on the integral of theta",
            k.len()
        ))),
    }
}

pub(super) fn period(rate: f64) -> PyResult<f64> {
    if rehearsal::RATES.contains(&rate) {
        return Ok(1.0 / rate);
    }
    let (low, high) = (rehearsal::RATES.start(), rehearsal::RATES.end());
    Err(error::design(format!(
        "rate = {rate} Hz is outside the allowed range [{low}, {high}] Hz"
    )))
}
