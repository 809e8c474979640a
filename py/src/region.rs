//! Regions of attraction.

use crate::arguments::RigLike;
use crate::background::told;
use crate::controller::PyController;
use crate::error;
use furuta_design::region::{Grid, On, Region};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use std::sync::mpsc::Sender;

/// Angles, speeds, and which of their pairs are inside.
type Map<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray2<bool>>,
);

/// From which angles and speeds of the pendulum, the arm at rest, a controller brings it upright: by simulation over a
/// grid.
///
/// The file's controller alone acts, on the true state and without delay, its voltage limited; a run settles if the
/// pendulum ends upright without having lain down, and without the arm passing the controller's limit.
///
/// Parameters
/// ----------
/// rig : Rig
///     What is controlled, its effects included.
/// controller : Controller
/// alpha : float, optional
///     Largest angle from upright, rad.
/// speed : float, optional
///     Largest speed, of the pendulum's small-angle frequency.
/// points : int, optional
///     Along each axis, 2 to 1000.
/// progress : callable, optional
///     Called with how many starts are done and how many there are, in the calling thread.
///
/// Returns
/// -------
/// alpha : numpy.ndarray, shape (points,)
///     Angles, rad.
/// alpha_dot : numpy.ndarray, shape (points,)
///     Speeds, rad/s.
/// inside : numpy.ndarray of bool, shape (points, points)
///     Whether the start (alpha[i], alpha_dot[j]) settles, at [j, i], as matplotlib's pcolormesh expects it.
///
/// Raises
/// ------
/// SimulationError
///     A grid or a rig that is not possible.
///
/// Examples
/// --------
/// >>> import furuta
/// >>> rig = furuta.Rig.load("shahzad2022-srv02")
/// >>> lqr = furuta.Controller.from_toml("", rig, dt=0.002)
/// >>> alpha, alpha_dot, inside = furuta.region_of_attraction(rig, lqr, points=9)
/// >>> bool(inside[4, 4]), bool(inside[8, 8])  # upright at rest; leaning over and falling
/// (True, False)
/// >>> bool((inside == inside[::-1, ::-1]).all())
/// True
#[pyfunction]
#[pyo3(
    signature = (rig, controller, *, alpha=1.2, speed=2.0, points=61, progress=None),
    text_signature = "(rig, controller, *, alpha=1.2, speed=2.0, points=61, progress=None)"
)]
pub(crate) fn region_of_attraction<'py>(
    py: Python<'py>,
    rig: RigLike,
    controller: PyRef<'py, PyController>,
    alpha: f64,
    speed: f64,
    points: usize,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Map<'py>> {
    for (name, value) in [("alpha", alpha), ("speed", speed)] {
        if !(value > 0.0 && value.is_finite()) {
            return Err(error::simulation(format!(
                "{name} = {value} must be a finite number above 0"
            )));
        }
    }
    if !(2..=1000).contains(&points) {
        return Err(error::simulation(format!(
            "points = {points} must be 2 to 1000"
        )));
    }
    let grid = Grid {
        alpha,
        speed,
        points,
    };
    let (rig, control) = (rig.rig, controller.supervisor.clone());
    let period = controller.period();
    let arm = control.thresholds.arm_angle_limit;
    let work = move |send: &Sender<usize>| {
        // Where the call has ended early there is no reader any more: unwinding ends the work, too.
        let tell = |done| {
            if send.send(done).is_err() {
                std::panic::resume_unwind(Box::new("the call has ended"));
            }
        };
        Region::of(&rig, On::Rig, &control.balance, &grid, period, arm, &tell)
    };
    let tell = |done: usize| match progress {
        Some(call) => call.call1((done, points * points)).map(drop),
        None => Ok(()),
    };
    let region = told(py, work, tell)?.map_err(error::simulation)?;
    let n = region.alpha.len();
    Ok((
        region.alpha.into_pyarray(py),
        region.alpha_dot.into_pyarray(py),
        region.inside.into_pyarray(py).reshape([n, n])?,
    ))
}
