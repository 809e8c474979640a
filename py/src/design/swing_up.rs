//! Swing-up by optimisation.

use crate::arguments::RigLike;
use crate::background::awaited;
use crate::controller::PyController;
use crate::error;
use furuta_ctrl::ControllerFile;
use furuta_ctrl::file::MadeFor;
use furuta_ctrl::trajectory::WhenLost;
use furuta_design::optimal::SwingUpProblem;
use furuta_design::swing_up::UPRIGHT;
use numpy::{IntoPyArray, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// The voltages that bring a rig from hanging to upright soonest within its limits, and gains that follow them: direct
/// multiple shooting on the nonlinear model with the rig file's smooth effects, and a time-varying LQR.
///
/// Minimised is T/T_p + effort mean (u/u_max)^2, T_p being the period of the hanging pendulum's small swings. It is a
/// local optimum, the best that a search from several numbers of swings finds. Some seconds of work.
///
/// Parameters
/// ----------
/// rig : Rig
///     Or the name of a built-in rig, or the path of a rig file.
/// controller : Controller, optional
///     Whose other sections and sample period the answer keeps; the standard ones if not given.
/// dt : float, optional
///     Sample period of the answer's controller in s; the controller's, or 0.002.
/// reserve : float, optional
///     Share of the command limit that is left to the feedback, 0 to 0.5; 0.05.
/// effort : float, optional
///     Weight of the voltage against the time; 0.03.
/// arm_limit : float, optional
///     Largest arm angle either way, rad; eight tenths of the rig file's limit, else of a turn.
/// arm_speed, pendulum_speed : float, optional
///     Largest speeds, rad/s; nine tenths of the rig file's limits, else speeds that are hardly reached.
/// intervals : int, optional
///     Intervals in which the voltage is held, 10 to 127.
/// when_lost : {"energy", "stop"}, optional
///     Where the rig has left the trajectory: energy swing-up goes on, or the motor is switched off.
///
/// Returns
/// -------
/// dict
///     seconds: time to upright; arrival: from when on the pendulum is within 0.2 rad of upright, s; t (n+1,): s;
///     x (n+1, 4): [theta, alpha, theta_dot, alpha_dot] at these times, rad and rad/s; u (n,): V, held from each time
///     to the next; K (n+1, 4): u = u(t) - K (x - x(t)); arm: largest arm angle, rad; gap: how far the equations of motion
///     are missed at most, rad, speeds over the pendulum's frequency; cost: what was minimised; optimal: whether the
///     search ended at a local optimum; left_out: effects of the rig file that the optimisation leaves out; controller:
///     Controller that follows it, for Supervisor, simulate and save.
///
/// Raises
/// ------
/// DesignError
///     A number outside its range, or a rig for which no swing-up within its limits was found.
/// ControllerError
///     A controller that the rig cannot have.
///
/// Examples
/// --------
/// >>> import numpy as np, furuta
/// >>> found = furuta.design_swing_up("shahzad2022-srv02", intervals=40)
/// >>> found["optimal"], found["x"].shape, bool(found["seconds"] < 0.8)
/// (True, (41, 4), True)
/// >>> supervisor = furuta.Supervisor("shahzad2022-srv02", found["controller"])
/// >>> plant = furuta.Simulator("shahzad2022-srv02", [0, np.pi, 0, 0], supervisor.dt)
/// >>> command = 0.0
/// >>> for _ in range(500):  # the command that was decided at a sample acts from the next one on
/// ...     held, (command, mode) = command, supervisor.step(plant.t, *plant.reading)
/// ...     x = plant.step(held)
/// >>> mode, bool(abs(x[1]) < 0.1)
/// ('balance', True)
#[pyfunction]
#[pyo3(signature = (
    rig, controller = None, dt = None, *, reserve = None, effort = None, arm_limit = None, arm_speed = None,
    pendulum_speed = None, intervals = 100, when_lost = "energy"
))]
#[allow(clippy::too_many_arguments)] // keywords
pub(crate) fn design_swing_up<'py>(
    py: Python<'py>,
    rig: RigLike,
    controller: Option<PyRef<'_, PyController>>,
    dt: Option<f64>,
    reserve: Option<f64>,
    effort: Option<f64>,
    arm_limit: Option<f64>,
    arm_speed: Option<f64>,
    pendulum_speed: Option<f64>,
    intervals: usize,
    when_lost: &str,
) -> PyResult<Bound<'py, PyDict>> {
    let when_lost = match when_lost {
        "energy" => WhenLost::Energy,
        "stop" => WhenLost::Stop,
        other => {
            return Err(error::design(format!(
                "when_lost = {other:?} is none of \"energy\", \"stop\""
            )));
        }
    };
    let period = dt.unwrap_or_else(|| controller.as_ref().map_or(0.002, |c| c.period()));
    let mut config = controller.map_or_else(furuta_ctrl::Config::default, |c| c.config().clone());
    let standard = SwingUpProblem::new(rig.rig.clone());
    let problem = SwingUpProblem {
        reserve: reserve.unwrap_or(standard.reserve),
        effort: effort.unwrap_or(standard.effort),
        arm_angle: arm_limit.unwrap_or(standard.arm_angle),
        arm_speed: arm_speed.unwrap_or(standard.arm_speed),
        pendulum_speed: pendulum_speed.unwrap_or(standard.pendulum_speed),
        intervals,
        ..standard
    };
    let found = awaited(py, move || problem.solve(&|_| ()))?.map_err(error::design)?;
    config.trajectory = Some(found.trajectory(when_lost).map_err(error::design)?);
    let file = ControllerFile {
        made_for: MadeFor {
            rig: Some(rig.rig.name.clone()),
            rate: None,
        },
        config,
    };
    let follows = PyController::new(file, &rig, period)?;
    let points = found.states.len();
    let times: Vec<f64> = (0..points).map(|k| found.interval * k as f64).collect();
    let states: Vec<f64> = found.states.iter().flat_map(|x| x.to_array()).collect();
    let out = PyDict::new(py);
    out.set_item("seconds", found.seconds())?;
    out.set_item("arrival", found.arrival(UPRIGHT))?;
    out.set_item("t", times.into_pyarray(py))?;
    out.set_item("x", states.into_pyarray(py).reshape([points, 4])?)?;
    out.set_item("u", found.commands.clone().into_pyarray(py))?;
    out.set_item(
        "K",
        found.gains.concat().into_pyarray(py).reshape([points, 4])?,
    )?;
    out.set_item("arm", found.arm())?;
    out.set_item("gap", found.gap)?;
    out.set_item("cost", found.cost)?;
    out.set_item("optimal", found.optimal)?;
    out.set_item("left_out", found.left_out)?;
    out.set_item("controller", follows)?;
    Ok(out)
}
