//! The classes `Supervisor` and `SwingUp`: the control system of the firmware, stepped from Python.

use crate::arguments::RigLike;
use crate::controller::PyController;
use crate::error;
use crate::estimator::with_settings;
use crate::kept::cloned;
use crate::matrix::{Vector, state};
use furuta_ctrl::controllers::{Controller, SWING_UP, SwingUp, SwingUpState};
use furuta_ctrl::estimators::Measurement;
use furuta_ctrl::settings::Settings;
use furuta_ctrl::supervisor::{Output, Request, Supervisor, SupervisorState};
use furuta_ctrl::{Config, Site};
use furuta_model::State;
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// The whole control system, estimator, swing-up, catch, balance, limits and faults, one sample at a time: the very
/// code that `furuta run` and the firmware run, in double precision.
///
/// Parameters
/// ----------
/// rig : Rig
///     What is designed for. Or the name of a built-in rig, or the path of a rig file.
/// controller : Controller, optional
///     A controller file; the standard one if not given.
/// dt : float, optional
///     Sample period in s; the controller's, or 0.002.
/// start : bool, optional
///     True: swing up and balance from the first sample on. False: the motor is off until `request("start")`.
///
/// Raises
/// ------
/// ControllerError
///     A controller that the rig cannot have at this sample period.
///
/// Examples
/// --------
/// >>> import numpy as np, furuta
/// >>> rig = furuta.Rig.load("shahzad2022-srv02")
/// >>> supervisor = furuta.Supervisor(rig)
/// >>> plant = furuta.Simulator(rig, [0, np.pi, 0, 0], supervisor.dt)
/// >>> command = 0.0
/// >>> for _ in range(2500):  # the command that was decided at a sample acts from the next one on
/// ...     held, (command, mode) = command, supervisor.step(plant.t, *plant.reading)
/// ...     x = plant.step(held)
/// >>> mode, bool(abs(x[1]) < 0.05)
/// ('balance', True)
#[pyclass(name = "Supervisor", module = "furuta")]
#[derive(Clone)]
pub(crate) struct PySupervisor {
    supervisor: Box<Supervisor<f64>>,
    memory: SupervisorState<f64>,
    start: bool,
    period: f64,
    rig: String,
    /// When the last sample was, s.
    last: Option<f64>,
    output: Option<Output<f64>>,
    /// The command that acts from the next sample on, V.
    decided: f64,
}

cloned!(PySupervisor);

#[pymethods]
impl PySupervisor {
    #[new]
    #[pyo3(signature = (rig, controller=None, dt=None, *, start=true))]
    fn new(
        rig: RigLike,
        controller: Option<PyRef<'_, PyController>>,
        dt: Option<f64>,
        start: bool,
    ) -> PyResult<Self> {
        let period = dt.unwrap_or_else(|| controller.as_ref().map_or(0.002, |c| c.period()));
        let config = controller.map_or_else(Config::default, |c| c.config().clone());
        let supervisor =
            Supervisor::design(&config, &Site::of(&rig.rig, period)).map_err(error::controller)?;
        let mut supervisor = Self {
            memory: supervisor.start(),
            supervisor: Box::new(supervisor),
            start,
            period,
            rig: rig.rig.name,
            last: None,
            output: None,
            decided: 0.0,
        };
        supervisor.reset();
        Ok(supervisor)
    }

    /// One sample.
    ///
    /// Parameters
    /// ----------
    /// t : float
    ///     When it was taken, s; samples that were lost since the one before are told by it.
    /// theta, alpha : float
    ///     Measured angles in rad; alpha = 0 is upright. What is not a number is a fault.
    /// target : float, optional
    ///     Where the arm is to be once the pendulum is up, rad.
    /// held : float, optional
    ///     V, what the motor holds from this sample to the next, where it is not the command of the sample before: a rig
    ///     that rounds, or one that was told otherwise.
    ///
    /// Returns
    /// -------
    /// command : float
    ///     V, for the motor to hold from the next sample on. Always finite and within the command limit.
    /// mode : str
    ///     "idle", "swing-up", "balance", "stopping", "braking" or "fault".
    ///
    /// Raises
    /// ------
    /// ControllerError
    ///     A time that is not after the one before, `target` or `held` that is not finite.
    #[pyo3(signature = (t, theta, alpha, *, target=0.0, held=None))]
    fn step(
        &mut self,
        t: f64,
        theta: f64,
        alpha: f64,
        target: f64,
        held: Option<f64>,
    ) -> PyResult<(f64, &'static str)> {
        if let Some(held) = held.filter(|held| !held.is_finite()) {
            return Err(error::controller(format!(
                "held = {held} V is not a finite number; leave it out where the motor holds the command of the sample \
                 before"
            )));
        }
        if !target.is_finite() {
            return Err(error::controller(format!(
                "target = {target} rad is not a finite number"
            )));
        }
        let periods = match self.last {
            None if t.is_finite() => 1.0,
            Some(last) if t > last => ((t - last) / self.period).round().max(1.0),
            last => {
                return Err(error::controller(format!(
                    "t = {t} s is not after the sample before{}: time goes on; reset() begins anew",
                    last.map_or_else(String::new, |last| format!(" at {last} s"))
                )));
            }
        };
        self.last = Some(t);
        let measurement = Measurement {
            theta,
            alpha,
            held: held.unwrap_or(self.decided),
            // Beyond the range of the type either way the estimators begin anew.
            periods: periods.min(f64::from(u32::MAX)) as u32,
        };
        let output = self
            .supervisor
            .update(&mut self.memory, &measurement, target);
        self.output = Some(output);
        self.decided = output.u;
        Ok((output.u, output.mode.name()))
    }

    /// Asks for a change of mode.
    ///
    /// Parameters
    /// ----------
    /// what : {"start", "stop", "reset"}
    ///     Swing up and balance; let go; leave the fault.
    ///
    /// Returns
    /// -------
    /// bool
    ///     False where it makes no sense in the present mode.
    fn request(&mut self, what: &str) -> PyResult<bool> {
        let request = match what {
            "start" => Request::Start,
            "stop" => Request::Stop,
            "reset" => Request::Reset,
            other => {
                return Err(error::controller(format!(
                    "what = {other:?} is none of \"start\", \"stop\", \"reset\""
                )));
            }
        };
        Ok(self.memory.request(request))
    }

    /// Forgets everything: as before the first sample.
    fn reset(&mut self) {
        self.memory = self.supervisor.start();
        if self.start {
            self.memory.request(Request::Start);
        }
        (self.last, self.output, self.decided) = (None, None, 0.0);
    }

    /// The present mode.
    #[getter]
    fn mode(&self) -> &'static str {
        self.memory.mode().name()
    }

    /// Why the motor was switched off, in words; None while it was not.
    #[getter]
    fn fault(&self) -> Option<String> {
        self.memory.fault().map(|fault| fault.to_string())
    }

    /// The state estimated at the last sample, [theta, alpha, theta_dot, alpha_dot] in rad and rad/s; None before the
    /// first.
    #[getter]
    fn estimate<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.output
            .map(|output| output.x.to_array().to_vec().into_pyarray(py))
    }

    /// Where the arm was asked to be at the last sample, rad: the target is approached at a limited speed.
    #[getter]
    fn reference(&self) -> f64 {
        self.output.map_or(0.0, |output| output.reference)
    }

    /// Sample period, s.
    #[getter]
    fn dt(&self) -> f64 {
        self.period
    }

    fn __repr__(&self) -> String {
        format!(
            "<furuta.Supervisor for {:?} at {} s: {}>",
            self.rig,
            self.period,
            self.mode()
        )
    }
}

/// The swing-up alone: a state in, a command out. It pumps energy into the pendulum until it rises to upright, and does
/// not catch it.
///
/// Parameters
/// ----------
/// rig : Rig
///     Or the name of a built-in rig, or the path of a rig file.
/// dt : float, optional
///     Sample period in s.
/// **settings : float
///     As in the section [swing_up] of a controller file; `furuta controllers swing_up` tells of each.
///
/// Raises
/// ------
/// ControllerError
///     A setting that is not possible.
///
/// Examples
/// --------
/// >>> import numpy as np, furuta
/// >>> swing_up = furuta.SwingUp("shahzad2022-srv02")
/// >>> plant = furuta.Simulator("shahzad2022-srv02", [0, np.pi, 0, 0], 0.002)
/// >>> top = min(abs(plant.step(swing_up.update(plant.x))[1]) for _ in range(2000))
/// >>> bool(top < 0.3)
/// True
#[pyclass(name = "SwingUp", module = "furuta")]
#[derive(Clone)]
pub(crate) struct PySwingUp {
    swing_up: SwingUp<f64>,
    memory: SwingUpState<f64>,
    period: f64,
}

cloned!(PySwingUp);

#[pymethods]
impl PySwingUp {
    #[new]
    #[pyo3(signature = (rig, dt=0.002, **settings))]
    fn new(rig: RigLike, dt: f64, settings: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let config = Config {
            swing_up: with_settings(Settings::new(&SWING_UP), settings, |text| {
                error::controller(text)
            })?,
            ..Config::default()
        };
        let swing_up = Supervisor::design(&config, &Site::of(&rig.rig, dt))
            .map_err(error::controller)?
            .swing_up;
        Ok(Self {
            memory: swing_up.start(),
            swing_up,
            period: dt,
        })
    }

    /// The command in V for the state x, to be held for one sample period; finite and within the command limit.
    ///
    /// Parameters
    /// ----------
    /// x : array_like, shape (4,)
    ///     State [theta, alpha, theta_dot, alpha_dot] in rad and rad/s.
    fn update(&mut self, x: Vector<'_>) -> PyResult<f64> {
        let x = state("x", &x)?;
        Ok(self
            .swing_up
            .update(&mut self.memory, &x, &State::upright(), self.period))
    }

    /// Energy in J that the pendulum lacks at the state x to coast up to upright; below 0 where it has too much.
    fn missing_energy(&self, x: Vector<'_>) -> PyResult<f64> {
        Ok(self.swing_up.missing_energy(&state("x", &x)?))
    }

    /// Forgets everything: as before the first sample.
    fn start(&mut self) {
        self.memory = self.swing_up.start();
    }

    fn __repr__(&self) -> String {
        format!("<furuta.SwingUp at {} s>", self.period)
    }
}
