//! Rig files judged by recordings.

use super::{field, parsed};
use crate::arguments::RigLike;
use crate::background::awaited;
use crate::error;
use crate::kept::{Kept, Reduced, kept, unreadable};
use crate::matrix::{Vector, vector};
use crate::recording::{choose, selection, state};
use furuta_ident::validate::{Options, Validated, Validation, validate_with};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};

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
    ///
    /// Parameters
    /// ----------
    /// ax : matplotlib.axes.Axes, optional
    ///     One: the errors after fixed times alone; a figure of everything if not given.
    ///
    /// Returns
    /// -------
    /// matplotlib.figure.Figure
    #[pyo3(signature = (*, ax=None))]
    fn plot<'py>(
        slf: Bound<'py, Self>,
        ax: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        slf.py()
            .import("furuta.plot._validation")?
            .call_method1("plot", (&slf, ax))
    }

    #[getter]
    fn channels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        field(self.contract.bind(py), "channels")
    }

    #[getter]
    fn notices(&self) -> Vec<String> {
        self.validation.notices.clone()
    }

    fn __repr__(&self) -> String {
        let v = &self.validation;
        let short = |c: &Validated| format!("{} of {} {:.2} %", c.channel, c.run, c.fit_percent);
        let channels: Vec<String> = v.channels.iter().map(short).collect();
        format!("<furuta.Validation of {}: {}>", v.rig, channels.join(", "))
    }

    fn __str__(&self) -> String {
        self.summary()
    }

    /// Pickles as its JSON.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Reduced<'py, (String,)>> {
        Ok((
            slf.get_type().getattr("_from_parts")?,
            (slf.get().to_json(),),
        ))
    }

    /// The inverse of pickling.
    #[classmethod]
    fn _from_parts(_class: &Bound<'_, PyType>, py: Python<'_>, json: &str) -> PyResult<Self> {
        Ok(Self {
            validation: serde_json::from_str(json).map_err(|e| unreadable("Validation", e))?,
            contract: parsed(py, json)?.unbind(),
        })
    }

    /// The result as a table, for notebooks.
    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        crate::card::card(slf.as_any(), "validation")
    }
}

kept!(PyValidation);

impl Kept for PyValidation {
    fn content(&self) -> String {
        self.to_json()
    }
}

/// Judges a rig file by recordings that it was not fitted to: fit in per cent, residual tests with their 99 % bounds,
/// errors after fixed times.
///
/// Parameters
/// ----------
/// recordings : path, dict, list of these, or dict of these by name
///     As for `diagnose`.
/// rig : Rig
/// pendulum : {"swings", "removed", "locked", "alone", "driven"}, optional
///     What the pendulum did in the recordings, as for `calibrate`.
/// same_zero : bool, optional
///     All recordings count their angles from the rig's zeros. Otherwise each has zeros of its own.
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
    signature = (recordings, rig, *, pendulum="swings", same_zero=false, every=1, span=None, command="held",
        accept_suspicious=false),
    text_signature = "(recordings, rig, *, pendulum='swings', same_zero=False, every=1, span=None, command='held', \
        accept_suspicious=False)"
)]
#[allow(clippy::too_many_arguments)] // keywords, for Python
pub(crate) fn validate(
    py: Python<'_>,
    recordings: &Bound<'_, PyAny>,
    rig: RigLike,
    pendulum: &str,
    same_zero: bool,
    every: usize,
    span: Option<(f64, f64)>,
    command: &str,
    accept_suspicious: bool,
) -> PyResult<PyValidation> {
    let rig = rig.rig.clone();
    let selection = selection(every, span, command)?;
    let pendulum = state(pendulum)?;
    let given = choose(
        (recordings, None),
        (&rig, pendulum),
        &selection,
        accept_suspicious,
    )?;
    let recordings = given.recordings;
    let mut validation = awaited(py, move || {
        let options = Options {
            pendulum,
            same_zero,
        };
        validate_with(&recordings, &rig, options)
    })?
    .map_err(error::calibrate)?;
    validation.notices.splice(0..0, given.notices);
    let contract = parsed(py, &validation.to_json())?.unbind();
    Ok(PyValidation {
        validation,
        contract,
    })
}

/// The autocorrelation test of `validate` on any residuals.
///
/// Parameters
/// ----------
/// residual : array_like, shape (N,)
/// lags : int, optional
///     At least 1 and below N.
///
/// Returns
/// -------
/// dict
///     values (lags 1, 2, ...), bound (99 %), outside, ljung_box, p_value.
///
/// Raises
/// ------
/// CalibrateError
///     A residual that is not finite, or that has no more samples than `lags`.
///
/// Examples
/// --------
/// >>> import numpy as np, furuta
/// >>> test = furuta.whiteness(np.sin(0.1 * np.arange(1000.0)))
/// >>> test["outside"] > 20 and test["p_value"] < 1e-6
/// True
#[pyfunction]
#[pyo3(signature = (residual, lags=25))]
pub(crate) fn whiteness<'py>(
    py: Python<'py>,
    residual: Vector<'py>,
    lags: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let residual: Vec<f64> = vector("residual", &residual, error::calibrate)?;
    if let Some(k) = residual.iter().position(|e| !e.is_finite()) {
        return Err(error::calibrate(format!(
            "residual[{k}] = {} is not a finite number",
            residual[k]
        )));
    }
    let n = residual.len();
    if lags == 0 || lags >= n {
        return Err(error::calibrate(format!(
            "lags = {lags} for a residual of {n} samples; lags must be at least 1 and below the number of samples"
        )));
    }
    let test = furuta_ident::validate::residuals::autocorrelation(&residual, lags);
    let d = PyDict::new(py);
    d.set_item("values", test.values)?;
    d.set_item("bound", test.bound)?;
    d.set_item("outside", test.outside)?;
    d.set_item("ljung_box", test.ljung_box)?;
    d.set_item("p_value", test.p_value)?;
    Ok(d)
}
