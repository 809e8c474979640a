//! The PID pair, tuned by a relay.

use super::closed_loop::{margins, period};
use crate::arguments::RigLike;
use crate::background::awaited;
use crate::error;
use furuta_design::relay::{Relay, ultimate};
use furuta_design::rig_loop::RigLoop;
use furuta_model::linear_plant::Amplitudes;
use numpy::IntoPyArray;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Tunes the pair of PID controllers (`kind = "pid"`) by a relay on the simulated rig, upright, in place of the
/// pendulum's controller (K. J. Astrom, T. Hagglund, 1984).
///
/// The rig has its effects, encoders and command limit; a command acts from the sample after the one it is decided at.
/// The gains allow for the springs and cables that the rig names.
///
/// Parameters
/// ----------
/// rig : Rig
/// rate : float, optional
///     Samples per second.
/// amplitude : float, optional
///     What the relay commands either way, V; three tenths of the command limit if not given.
/// hysteresis : float, optional
///     Angle beyond which it switches, rad; 0: wherever the encoder shows another sign.
/// time_limit : float, optional
///     The experiment ends after this time at the latest, s.
///
/// Returns
/// -------
/// dict
///     ultimate_gain (V/rad), ultimate_period (s): of the loop from command to the pendulum's angle; described_gain:
///     the gain by the relay's describing function; phase: of the command against the angle, rad, which the encoder's
///     steps and the samples leave; amplitude (V), hysteresis (rad), lean, arm (furthest angles, rad), time (s); model:
///     gain and period by the linear model and an ideal relay; pendulum_gains, arm_gains: [kp, ki, kd] for a controller
///     file; margins: as closed_loop has them, of the pair without its low pass, one sample of delay not counted.
///
/// Raises
/// ------
/// DesignError
///     Numbers outside their ranges; a pendulum that falls, or does not oscillate steadily; a rig whose command is the
///     arm's acceleration, on which a relay does not oscillate; gains under which the linear loop with the standard
///     estimator grows.
///
/// Examples
/// --------
/// >>> import furuta
/// >>> found = furuta.relay(furuta.Rig.load("shahzad2022-srv02"))
/// >>> found["margins"]["stable"], bool(0.7 < found["ultimate_gain"] / found["model"][0] < 0.85)
/// (True, True)
#[pyfunction]
#[pyo3(signature = (rig, *, rate = 500.0, amplitude = None, hysteresis = 0.0, time_limit = 10.0))]
pub(crate) fn relay<'py>(
    py: Python<'py>,
    rig: RigLike,
    rate: f64,
    amplitude: Option<f64>,
    hysteresis: f64,
    time_limit: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let experiment = Relay {
        amplitude,
        hysteresis,
        period: period(rate)?,
        time_limit,
    };
    let rig = rig.rig.clone();
    let period = experiment.period;
    let tried = rig.clone();
    let (found, model) = awaited(py, move || {
        (experiment.run(&tried), ultimate(&tried, period, 0.0))
    })?;
    let (found, model) = (found.map_err(error::design)?, model.map_err(error::design)?);
    let gains = found.gains(&rig, period).map_err(error::design)?;
    let closed =
        RigLoop::new(&rig, gains.law(), Some(period), &Amplitudes::NONE).map_err(error::design)?;
    let out = PyDict::new(py);
    for (name, value) in [
        ("ultimate_gain", found.gain),
        ("ultimate_period", found.period),
        ("described_gain", found.described),
        ("phase", found.phase),
        ("amplitude", found.amplitude),
        ("hysteresis", found.hysteresis),
        ("lean", found.lean),
        ("arm", found.arm),
        ("time", found.time),
    ] {
        out.set_item(name, value)?;
    }
    out.set_item("model", model)?;
    out.set_item("pendulum_gains", gains.pendulum.to_vec().into_pyarray(py))?;
    out.set_item("arm_gains", gains.arm.to_vec().into_pyarray(py))?;
    let judged = awaited(py, move || closed.margins())?;
    out.set_item("margins", margins(py, &judged)?)?;
    Ok(out)
}
