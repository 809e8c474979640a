//! Rig files fitted to recordings.

use super::{field, free_and_held, parsed};
use crate::arguments::{Names, RigLike};
use crate::background::told;
use crate::error;
use crate::file;
use crate::kept::{Kept, Reduced, json, kept, unreadable};
use crate::recording::{choose, selection, state};
use crate::rig::PyRig;
use furuta_ident::calibrate::{
    CalibrateError, Calibration, Curve, Options, Outcome, calibrate_with,
};
use furuta_ident::{Pendulum, validate};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};
use std::path::PathBuf;
use std::sync::mpsc::Sender;

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
///     Ratios of what the equations of motion are made of, right whatever the held parameters are: name, formula,
///     nominal, fitted, std, unit.
/// identifiability : dict
///     What the recordings can tell: rank, parameters, condition, directions, held.
/// fit : list of dict
///     By recording and angle: run, channel, nominal, calibrated, noise_floor (RMS errors, rad), fit_percent.
/// chi : float
///     RMS of the residuals over the noise: 1 is the floor.
/// profiles : list of dict
///     Profile likelihoods asked for: key, unit, values, rise, interval.
/// verification : dict or None
///     How well rig file and calibrated rig follow the recordings of `verify`: as_given, calibrated (as
///     `Validation.to_dict`).
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

    /// The calibration in plain text: what the recordings can tell, the parameters with their 95 % intervals, how well
    /// the model follows.
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
    /// ax : matplotlib.axes.Axes, optional
    ///     The intervals alone, in these axes; a figure of everything if not given.
    ///
    /// Returns
    /// -------
    /// matplotlib.figure.Figure
    #[pyo3(signature = (*, run=None, ax=None))]
    fn plot<'py>(
        slf: Bound<'py, Self>,
        run: Option<&str>,
        ax: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        slf.py()
            .import("furuta.plot._calibration")?
            .call_method1("plot", (&slf, run, ax))
    }

    /// What `plot` draws: for each stretch of a recording run, t, u, and measured, nominal, calibrated as
    /// `[theta, alpha]` (None where nothing was predicted).
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

    /// Writes the report, one self-contained HTML page, to this path. A file that is there and no
    /// such page is replaced only with `force`.
    #[pyo3(signature = (path, *, force=false))]
    fn report(&self, py: Python<'_>, path: PathBuf, force: bool) -> PyResult<()> {
        file::write_page(py, &path, force, || {
            furuta_ident::report::calibration(&self.outcome)
        })
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

    /// How well rig file and calibrated rig follow the recordings of `verify`: as_given, calibrated (as
    /// `Validation.to_dict`); None without.
    #[getter]
    fn verification<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.contract.bind(py).get_item("verification")
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

    /// Pickles as its JSON, its rig and its curves.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Reduced<'py, (String, PyRig, String)>> {
        let this = slf.get();
        let parts = (this.to_json(), this.rig(), json(&this.outcome.curves));
        Ok((slf.get_type().getattr("_from_parts")?, parts))
    }

    /// The inverse of pickling.
    #[classmethod]
    fn _from_parts(
        _class: &Bound<'_, PyType>,
        py: Python<'_>,
        json: &str,
        rig: PyRef<'_, PyRig>,
        curves: &str,
    ) -> PyResult<Self> {
        let unreadable = |e| unreadable("Calibration", e);
        let calibration = Calibration::from_json(json).map_err(unreadable)?;
        let curves: Vec<Curve> = serde_json::from_str(curves).map_err(unreadable)?;
        Ok(Self {
            outcome: Outcome::kept(calibration, rig.rig.clone(), curves),
            contract: parsed(py, json)?.unbind(),
        })
    }
}

kept!(PyCalibration);

impl Kept for PyCalibration {
    fn content(&self) -> String {
        let mut calibration = self.outcome.calibration.clone();
        calibration.seconds = 0.0;
        calibration.to_json() + &json(&self.outcome.curves) + &self.outcome.rig.to_toml()
    }
}

/// Fits the parameters of a rig file to recordings: what they can tell, and values with 95 % intervals.
///
/// Parameters
/// ----------
/// recordings : path, dict, list of these, or dict of these by name
///     As for `diagnose`; rates may differ, hanging and upright may be mixed.
/// rig : Rig
///     As its data sheet describes it, effects included.
/// free : list of str or str, optional
///     Keys of the parameters to fit ("arm.inertia", "arm.coulomb.torque"); all that the recordings determine if not
///     given.
/// fix : list of str or str, optional
///     Keys of parameters to hold although they show.
/// profile : list of str or str, optional
///     Keys of parameters whose profile likelihood is wanted.
/// horizon : float, optional
///     Length of the predictions that are fitted where the pendulum hangs, s.
/// body_length : float, optional
///     Length of the pendulum from hinge to tip, m: neither centre of mass nor inertia lies beyond it.
/// verify : path, dict, or list of these, optional
///     Recordings that the fit must not see: rig file and calibrated rig are judged by them (`verification`).
/// pendulum : {"swings", "removed", "locked", "alone", "driven"}, optional
///     What the pendulum did in `recordings`: it swings as it is built; it was taken off or locked hanging, and the arm
///     alone is looked at; or the arm was held, or moves as theta says, and the pendulum alone is.
/// same_zero : bool, optional
///     All recordings count their angles from the rig's zeros. Otherwise each has zeros of its own.
/// removed, locked, alone, driven : as `recordings`, optional
///     Recordings of the same rig in these states, fitted together with `recordings`.
/// every : int, optional
///     Use every `every`-th sample of each recording. The command of a sample becomes the mean of those until the
///     next one used: right where `every` sample periods are short against the motion.
/// span : tuple of two floats, optional
///     Use this span of each recording, s from its first sample.
/// command : {"held", "smooth"}, optional
///     What the command does between two rows: smooth where the recording keeps every N-th row of a faster controller.
///     Where it jumps then, predictions stop and start anew.
/// accept_suspicious : bool, optional
///     Use recordings even if they look as if a convention were broken.
/// progress : callable, optional
///     Called with what begins ("fitting") and the per cent done by then, in the calling thread. An exception it raises
///     ends the calibration.
/// hold : list of str or str, optional
///     Another name for `fix`; both may be given.
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
    signature = (recordings, rig, *, free=None, fix=None, profile=None, horizon=2.0, body_length=None, verify=None,
        pendulum="swings", same_zero=false, removed=None, locked=None, alone=None, driven=None, every=1, span=None,
        command="held", accept_suspicious=false, progress=None, hold=None),
    text_signature = "(recordings, rig, *, free=None, fix=None, profile=None, horizon=2.0, \
        body_length=None, verify=None, pendulum='swings', same_zero=False, removed=None, locked=None, alone=None, \
        driven=None, every=1, span=None, command='held', accept_suspicious=False, progress=None, hold=None)"
)]
#[allow(clippy::too_many_arguments)] // keywords, for Python
pub(crate) fn calibrate(
    py: Python<'_>,
    recordings: &Bound<'_, PyAny>,
    rig: RigLike,
    free: Option<Names>,
    fix: Option<Names>,
    profile: Option<Names>,
    horizon: f64,
    body_length: Option<f64>,
    verify: Option<Bound<'_, PyAny>>,
    pendulum: &str,
    same_zero: bool,
    removed: Option<Bound<'_, PyAny>>,
    locked: Option<Bound<'_, PyAny>>,
    alone: Option<Bound<'_, PyAny>>,
    driven: Option<Bound<'_, PyAny>>,
    every: usize,
    span: Option<(f64, f64)>,
    command: &str,
    accept_suspicious: bool,
    progress: Option<&Bound<'_, PyAny>>,
    hold: Option<Names>,
) -> PyResult<PyCalibration> {
    let rig = rig.rig.clone();
    let selection = selection(every, span, command)?;
    let pendulum = state(pendulum)?;
    let mut given = choose(
        (recordings, verify.as_ref()),
        (&rig, pendulum),
        &selection,
        accept_suspicious,
    )?;
    let mut beside = Vec::new();
    for (others, state) in [
        (removed, Pendulum::Removed),
        (locked, Pendulum::Locked),
        (alone, Pendulum::Alone),
        (driven, Pendulum::Driven),
    ] {
        let Some(others) = others else { continue };
        let chosen = choose(
            (&others, None),
            (&rig, state),
            &selection,
            accept_suspicious,
        )?;
        given.notices.extend(chosen.notices);
        beside.extend(
            chosen
                .recordings
                .into_iter()
                .map(|recording| (state, recording)),
        );
    }
    let (free, hold) = free_and_held(free, [fix, hold])?;
    let options = Options {
        free,
        hold,
        profile: profile.unwrap_or_default().0,
        horizon,
        body_length,
        pendulum,
        same_zero,
        beside,
    };
    let work = move |send: &Sender<(&'static str, f64)>| {
        // Where the call has ended, nothing hears this any more, and the work ends too.
        let heard = |stage, percent| send.send((stage, percent)).is_ok();
        let mut outcome = calibrate_with(&given.recordings, &rig, &options, &heard)?;
        outcome.calibration.notices.splice(0..0, given.notices);
        if !given.verify.is_empty() {
            heard("verifying", 95.0);
            let options = validate::Options {
                pendulum,
                same_zero,
            };
            outcome.verify(&given.verify, &rig, options)?;
        }
        Ok(outcome)
    };
    let outcome = told(py, work, |news| {
        progress.map_or(Ok(()), |call| call.call1(news).map(drop))
    })?;
    let outcome = outcome.map_err(|e: CalibrateError| error::calibrate(e))?;
    let contract = parsed(py, &outcome.calibration.to_json())?.unbind();
    Ok(PyCalibration { outcome, contract })
}
