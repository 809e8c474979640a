//! Calibration, validation and the planning of experiments.

use crate::error;
use crate::recording::{Read, read, refuse_suspicion};
use crate::rig::PyRig;
use furuta_ident::calibrate::{Options, Outcome, Plan};
use furuta_ident::recording::against_rig;
use furuta_ident::validate::Validation;
use furuta_model::Rig;
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;

/// What `calibrate` found. Attributes and JSON have the names of the JSON contract; numbers are SI, unknown ones None.
///
/// Attributes
/// ----------
/// parameters : dict
///     By key: nominal, fitted, std, interval (95 %), unit, identifiable, at_bound.
/// fitted : list of str
///     Keys of the fitted parameters, in the order of `correlation`.
/// correlation : list of list of float
///     Of their errors.
/// combinations : list of dict
///     Ratios of what the equations of motion are made of, right whatever the held parameters are: name, formula, nominal, fitted, std, unit.
/// identifiability : dict
///     What the recordings can tell: rank, parameters, condition, directions, held.
/// fit : list of dict
///     By recording and angle: run, channel, nominal, calibrated, noise_floor (RMS errors, rad), fit_percent.
/// chi : float
///     RMS of the residuals over the noise: 1 is the floor.
/// profiles : list of dict
///     Profile likelihoods asked for: key, unit, values, rise, interval.
/// notices : list of str
/// seconds : float
/// rig : Rig
///     With the fitted values.
#[pyclass(name = "Calibration", module = "furuta", frozen)]
pub(crate) struct PyCalibration {
    outcome: Outcome,
    contract: Py<PyDict>,
}

#[pymethods]
impl PyCalibration {
    /// The JSON contract as text.
    fn to_json(&self) -> String {
        self.outcome.calibration.to_json()
    }

    /// The JSON contract as a new dict.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        parsed(py, &self.to_json())
    }

    /// The calibration in plain text: what the recordings can tell, the parameters with their 95 % intervals, how well the model follows.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, furuta
    /// >>> rig = furuta.Rig.load("qube-servo-2")
    /// >>> t = 0.002 * np.arange(3000)
    /// >>> u = 3 * np.sin(2 * t * (1 + t))
    /// >>> x = furuta.simulate(rig, [0, np.pi, 0, 0], u[:-1], 0.002)
    /// >>> theta, alpha = furuta.measure(rig, x).T
    /// >>> found = furuta.calibrate({"t": t, "u": u, "theta": theta, "alpha": alpha}, rig)
    /// >>> print(found.summary().splitlines()[0])  # doctest: +ELLIPSIS
    /// What these recordings can tell: 7 of 15 parameters' combinations show; condition number of the fitted 6: ...
    fn summary(&self) -> String {
        self.outcome.calibration.summary()
    }

    /// Draws the calibration with matplotlib: intervals, measured against predicted, profiles.
    ///
    /// Parameters
    /// ----------
    /// run : str, optional
    ///     Name of the recording to show; the first if not given.
    ///
    /// Returns
    /// -------
    /// matplotlib.figure.Figure
    #[pyo3(signature = (*, run=None))]
    fn plot<'py>(slf: Bound<'py, Self>, run: Option<&str>) -> PyResult<Bound<'py, PyAny>> {
        slf.py()
            .import("furuta._plot_calibration")?
            .call_method1("plot", (&slf, run))
    }

    /// What `plot` draws: for each stretch of a recording run, t, u, and measured, nominal, calibrated as `[theta, alpha]` (None where nothing was predicted).
    fn curves<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        self.outcome
            .curves
            .iter()
            .map(|c| {
                let d = PyDict::new(py);
                d.set_item("run", &c.run)?;
                d.set_item("t", &c.t)?;
                d.set_item("u", &c.u)?;
                for (name, series) in [
                    ("measured", &c.measured),
                    ("nominal", &c.nominal),
                    ("calibrated", &c.calibrated),
                ] {
                    d.set_item(name, series.to_vec())?;
                }
                Ok(d)
            })
            .collect()
    }

    /// The calibration at a glance, for notebooks.
    fn _repr_html_(&self) -> String {
        furuta_ident::report::calibration_card(&self.outcome.calibration)
    }

    /// Writes the report, one self-contained HTML page, to this path.
    fn report(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| std::fs::write(path, furuta_ident::report::calibration(&self.outcome)))?;
        Ok(())
    }

    /// The rig with the fitted values.
    #[getter]
    fn rig(&self) -> PyRig {
        PyRig {
            rig: self.outcome.rig.clone(),
        }
    }

    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        field(self.contract.bind(py), "parameters")
    }

    #[getter]
    fn fitted(&self) -> Vec<String> {
        self.outcome.calibration.fitted.clone()
    }

    #[getter]
    fn correlation<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        field(self.contract.bind(py), "correlation")
    }

    #[getter]
    fn combinations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        field(self.contract.bind(py), "combinations")
    }

    #[getter]
    fn identifiability<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        field(self.contract.bind(py), "identifiability")
    }

    #[getter]
    fn fit<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        field(self.contract.bind(py), "fit")
    }

    #[getter]
    fn chi(&self) -> f64 {
        self.outcome.calibration.chi
    }

    /// Profile likelihoods asked for.
    #[getter]
    fn profiles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        if self.outcome.calibration.profiles.is_empty() {
            return Ok(pyo3::types::PyList::empty(py).into_any());
        }
        field(self.contract.bind(py), "profiles")
    }

    #[getter]
    fn notices(&self) -> Vec<String> {
        self.outcome.calibration.notices.clone()
    }

    #[getter]
    fn seconds(&self) -> f64 {
        self.outcome.calibration.seconds
    }

    fn __repr__(&self) -> String {
        let c = &self.outcome.calibration;
        format!("<furuta.Calibration of {}: {}>", c.rig, c.fitted.join(", "))
    }

    fn __str__(&self) -> String {
        self.summary()
    }
}

/// How well a rig file predicts recordings.
///
/// Attributes
/// ----------
/// channels : list of dict
///     By stretch and angle: run, channel, simulated, fit_percent, rms, noise_floor, whiteness, cross, steps.
/// notices : list of str
#[pyclass(name = "Validation", module = "furuta", frozen)]
pub(crate) struct PyValidation {
    validation: Validation,
    contract: Py<PyDict>,
}

#[pymethods]
impl PyValidation {
    /// The JSON contract as text.
    fn to_json(&self) -> String {
        self.validation.to_json()
    }

    /// The JSON contract as a new dict.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        parsed(py, &self.to_json())
    }

    /// The validation as tables.
    fn summary(&self) -> String {
        self.validation.summary()
    }

    /// Draws the residuals' correlations with their 99 % bounds and the errors after fixed times with matplotlib.
    fn plot(slf: Bound<'_, Self>) -> PyResult<Bound<'_, PyAny>> {
        slf.py()
            .import("furuta._plot_calibration")?
            .call_method1("plot_validation", (&slf,))
    }

    #[getter]
    fn channels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        field(self.contract.bind(py), "channels")
    }

    #[getter]
    fn notices(&self) -> Vec<String> {
        self.validation.notices.clone()
    }

    fn __str__(&self) -> String {
        self.summary()
    }
}

/// What to record so that the parameters of a rig become known.
///
/// Attributes
/// ----------
/// parameters : list of str
///     Keys of the parameters that are to become known.
/// experiments : list of dict
///     All that the rig bears, the most telling first: excitation, arguments, seconds, volts, arm, log_det, efficiency, std (relative, by parameter).
/// sequence : list of int
///     Which to make one after the other.
/// after : list of list of float
///     Relative standard deviations after each of these.
#[pyclass(name = "ExperimentPlan", module = "furuta", frozen)]
pub(crate) struct PyPlan {
    plan: Plan,
    contract: Py<PyDict>,
}

#[pymethods]
impl PyPlan {
    /// The JSON contract as text.
    fn to_json(&self) -> String {
        self.plan.to_json()
    }

    /// The JSON contract as a new dict.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        parsed(py, &self.to_json())
    }

    /// The plan as a table, with the commands that make the recordings.
    #[pyo3(signature = (rig="RIG"))]
    fn summary(&self, rig: &str) -> String {
        self.plan.summary(rig)
    }

    #[getter]
    fn parameters(&self) -> Vec<String> {
        self.plan.parameters.clone()
    }

    #[getter]
    fn experiments<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        field(self.contract.bind(py), "experiments")
    }

    #[getter]
    fn sequence(&self) -> Vec<usize> {
        self.plan.sequence.clone()
    }

    #[getter]
    fn after(&self) -> Vec<Vec<f64>> {
        self.plan.after.clone()
    }

    fn __str__(&self) -> String {
        self.summary("RIG")
    }
}

fn field<'py>(contract: &Bound<'py, PyDict>, name: &str) -> PyResult<Bound<'py, PyAny>> {
    contract
        .get_item(name)?
        .ok_or_else(|| PyKeyError::new_err(name.to_owned()))
}

fn parsed<'py>(py: Python<'py>, json: &str) -> PyResult<Bound<'py, PyDict>> {
    Ok(py
        .import("json")?
        .call_method1("loads", (json,))?
        .cast_into::<PyDict>()?)
}

/// Recordings of this rig, checked against it.
fn checked(given: &Bound<'_, PyAny>, rig: &Rig, accept_suspicious: bool) -> PyResult<Read> {
    let mut all = read(given, accept_suspicious)?;
    for notice in against_rig(&all.recordings, rig) {
        refuse_suspicion(&notice, accept_suspicious)?;
        all.notices.push(notice.to_string());
    }
    Ok(all)
}

/// Fits the parameters of a rig file to recordings: what they can tell, and values with 95 % intervals.
///
/// Parameters
/// ----------
/// recordings : path, dict, or list of these
///     As for `diagnose`; rates may differ, hanging and upright may be mixed.
/// rig : Rig
///     As its data sheet describes it, effects included.
/// free : list of str, optional
///     Keys of the parameters to fit ("arm.inertia", "arm.coulomb.torque"); all that the recordings determine if not given.
/// hold : list of str, optional
///     Keys of parameters to hold although they show.
/// profile : list of str, optional
///     Keys of parameters whose profile likelihood is wanted.
/// horizon : float, optional
///     Length of the predictions that are fitted where the pendulum hangs, s.
/// body_length : float, optional
///     Length of the pendulum from hinge to tip, m: neither centre of mass nor inertia lies beyond it.
/// accept_suspicious : bool, optional
///     Use recordings even if they look as if a convention were broken.
///
/// Returns
/// -------
/// Calibration
///
/// Raises
/// ------
/// RecordingError
///     A recording that cannot be used: which, where, why, what to do.
/// CalibrateError
///     Recordings too short, in which nothing moves, that determine nothing asked for; unknown keys.
///
/// Examples
/// --------
/// >>> import numpy as np, furuta
/// >>> rig = furuta.Rig.load("qube-servo-2")
/// >>> t = 0.002 * np.arange(3000)
/// >>> u = 3 * np.sin(2 * t * (1 + t))
/// >>> x = furuta.simulate(rig, [0, np.pi, 0, 0], u[:-1], 0.002)
/// >>> theta, alpha = furuta.measure(rig, x).T
/// >>> found = furuta.calibrate({"t": t, "u": u, "theta": theta, "alpha": alpha}, rig, free=["arm.inertia"])
/// >>> p = found.parameters["arm.inertia"]
/// >>> abs(p["fitted"] - p["nominal"]) < 1e-3 * p["nominal"]
/// True
#[pyfunction]
#[pyo3(
    signature = (recordings, rig, *, free=None, hold=None, profile=None, horizon=2.0, body_length=None, accept_suspicious=false),
    text_signature = "(recordings, rig, *, free=None, hold=None, profile=None, horizon=2.0, body_length=None, accept_suspicious=False)"
)]
#[allow(clippy::too_many_arguments)] // keywords, for Python
pub(crate) fn calibrate(
    py: Python<'_>,
    recordings: &Bound<'_, PyAny>,
    rig: PyRef<'_, PyRig>,
    free: Option<Vec<String>>,
    hold: Option<Vec<String>>,
    profile: Option<Vec<String>>,
    horizon: f64,
    body_length: Option<f64>,
    accept_suspicious: bool,
) -> PyResult<PyCalibration> {
    let rig = rig.rig.clone();
    let given = checked(recordings, &rig, accept_suspicious)?;
    let options = Options {
        free: free.unwrap_or_default(),
        hold: hold.unwrap_or_default(),
        profile: profile.unwrap_or_default(),
        horizon,
        body_length,
    };
    let mut outcome = py
        .detach(|| furuta_ident::calibrate::calibrate(&given.recordings, &rig, &options))
        .map_err(error::calibrate)?;
    outcome.calibration.notices.splice(0..0, given.notices);
    let contract = parsed(py, &outcome.calibration.to_json())?.unbind();
    Ok(PyCalibration { outcome, contract })
}

/// Judges a rig file by recordings that it was not fitted to: fit in per cent, residual tests with their 99 % bounds, errors after fixed times.
///
/// Parameters
/// ----------
/// recordings : path, dict, or list of these
///     As for `diagnose`.
/// rig : Rig
/// accept_suspicious : bool, optional
///     Use recordings even if they look as if a convention were broken.
///
/// Returns
/// -------
/// Validation
///
/// Raises
/// ------
/// RecordingError, CalibrateError
///     As for `calibrate`.
///
/// Examples
/// --------
/// >>> import numpy as np, furuta
/// >>> rig = furuta.Rig.load("qube-servo-2")
/// >>> t = 0.002 * np.arange(3000)
/// >>> u = 3 * np.sin(2 * t * (1 + t))
/// >>> x = furuta.simulate(rig, [0, np.pi, 0, 0], u[:-1], 0.002)
/// >>> theta, alpha = furuta.measure(rig, x).T
/// >>> judged = furuta.validate({"t": t, "u": u, "theta": theta, "alpha": alpha}, rig)
/// >>> print(judged.summary().splitlines()[1])  # doctest: +ELLIPSIS
///   recording-0          theta   99.9 % ...
#[pyfunction]
#[pyo3(
    signature = (recordings, rig, *, accept_suspicious=false),
    text_signature = "(recordings, rig, *, accept_suspicious=False)"
)]
pub(crate) fn validate(
    py: Python<'_>,
    recordings: &Bound<'_, PyAny>,
    rig: PyRef<'_, PyRig>,
    accept_suspicious: bool,
) -> PyResult<PyValidation> {
    let rig = rig.rig.clone();
    let given = checked(recordings, &rig, accept_suspicious)?;
    let mut validation = py
        .detach(|| furuta_ident::validate::validate(&given.recordings, &rig))
        .map_err(error::calibrate)?;
    validation.notices.splice(0..0, given.notices);
    let contract = parsed(py, &validation.to_json())?.unbind();
    Ok(PyValidation {
        validation,
        contract,
    })
}

/// Proposes recordings by what they would tell about the parameters of a rig: D-optimal over a family of test signals.
///
/// Parameters
/// ----------
/// rig : Rig
///     Its limits on voltage, arm angle and speeds are kept.
/// free, hold : list of str, optional
///     As for `calibrate`.
/// rate : float, optional
///     Samples per second.
/// experiments : int, optional
///     How many to propose, each chosen to add most to those before.
/// horizon : float, optional
///     As for `calibrate`, s.
///
/// Returns
/// -------
/// ExperimentPlan
///
/// Examples
/// --------
/// >>> import furuta
/// >>> plan = furuta.plan_experiment(furuta.Rig.load("qube-servo-2"), rate=200.0)
/// >>> len(plan.sequence), plan.experiments[0]["efficiency"]
/// (2, 1.0)
#[pyfunction]
#[pyo3(
    signature = (rig, *, free=None, hold=None, rate=500.0, experiments=2, horizon=2.0),
    text_signature = "(rig, *, free=None, hold=None, rate=500.0, experiments=2, horizon=2.0)"
)]
pub(crate) fn plan_experiment(
    py: Python<'_>,
    rig: PyRef<'_, PyRig>,
    free: Option<Vec<String>>,
    hold: Option<Vec<String>>,
    rate: f64,
    experiments: u8,
    horizon: f64,
) -> PyResult<PyPlan> {
    let rig = rig.rig.clone();
    let options = Options {
        free: free.unwrap_or_default(),
        hold: hold.unwrap_or_default(),
        horizon,
        ..Options::default()
    };
    let plan = py
        .detach(|| furuta_ident::calibrate::plan(&rig, &options, rate, experiments.into()))
        .map_err(error::calibrate)?;
    let contract = parsed(py, &plan.to_json())?.unbind();
    Ok(PyPlan { plan, contract })
}

/// The autocorrelation test of `validate` on any residuals.
///
/// Parameters
/// ----------
/// residual : list of float
/// lags : int, optional
///
/// Returns
/// -------
/// dict
///     values (lags 1, 2, ...), bound (99 %), outside, ljung_box, p_value.
///
/// Examples
/// --------
/// >>> import numpy as np, furuta
/// >>> test = furuta.whiteness(list(np.sin(0.1 * np.arange(1000.0))))
/// >>> test["outside"] > 20 and test["p_value"] < 1e-6
/// True
#[pyfunction]
#[pyo3(signature = (residual, lags=25))]
pub(crate) fn whiteness(
    py: Python<'_>,
    residual: Vec<f64>,
    lags: usize,
) -> PyResult<Bound<'_, PyDict>> {
    let test = furuta_ident::validate::residuals::autocorrelation(&residual, lags);
    let d = PyDict::new(py);
    d.set_item("values", test.values)?;
    d.set_item("bound", test.bound)?;
    d.set_item("outside", test.outside)?;
    d.set_item("ljung_box", test.ljung_box)?;
    d.set_item("p_value", test.p_value)?;
    Ok(d)
}
