//! A measured frequency response.

use super::transfer_fit::PyTransferFit;
use crate::error;
use crate::file;
use crate::kept::{Kept, Reduced, kept};
use crate::matrix::{Vector, vector};
use furuta_ident::diagnose::result::significant;
use furuta_ident::frequency::Frf;
use furuta_ident::frequency::bode::Bode;
use furuta_ident::frequency::words::{fit_text, response_text};
use nalgebra::Complex;
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;
use pyo3::types::PyType;
use std::path::PathBuf;

type Array<'py, T> = Bound<'py, PyArray1<T>>;

/// A measured frequency response. `furuta.frf` makes it from recordings; one from elsewhere is given as arrays.
///
/// Parameters
/// ----------
/// frequency : array_like, shape (N,)
///     Lines in Hz, ascending, above 0.
/// response : array_like, shape (N,), complex
/// std : array_like, shape (N,), optional
///     Standard deviation of each line (distance in the complex plane); without it, all lines count equally relative to
///     their size.
/// sample_period : float, optional
///     In s, where the response is that of a sampled plant behind a hold; 0 for a continuous one.
///
/// Attributes
/// ----------
/// frequency, response, coherence, std : numpy.ndarray, shape (N,)
/// distortion : numpy.ndarray, shape (N,) or (0,)
///     The part of `std` that is odd nonlinear distortion; empty where nothing told it from noise.
/// averages : float
///     Independent averages, or one more than the degrees of freedom behind `std`.
/// sample_period : float
/// method : str
/// notices : list of str
///
/// Examples
/// --------
/// >>> import numpy as np, furuta
/// >>> f = np.linspace(0.1, 5, 50)
/// >>> response = furuta.Frf(f, 1 / (2j * np.pi * f + 3))
/// >>> response.band(1, 2).frequency.size
/// 11
#[pyclass(name = "Frf", module = "furuta", frozen)]
pub(crate) struct PyFrf {
    pub(crate) frf: Frf,
    pub(super) notices: Vec<String>,
    /// What it is of: `alpha / u`.
    pub(super) what: String,
    /// Whether its band was chosen: then a fit takes all of it.
    pub(super) chosen: bool,
}

#[pymethods]
impl PyFrf {
    #[new]
    #[pyo3(signature = (frequency, response, std=None, *, sample_period=0.0))]
    fn new(
        frequency: Vector<'_>,
        response: Vector<'_>,
        std: Option<Vector<'_>>,
        sample_period: f64,
    ) -> PyResult<Self> {
        let refuse = |text: String| error::identification(text);
        let frequency: Vec<f64> = vector("frequency", &frequency, refuse)?;
        let response: Vec<Complex<f64>> = vector("response", &response, refuse)?;
        let n = frequency.len();
        let std: Vec<f64> = match std {
            Some(std) => vector("std", &std, refuse)?,
            None => vec![0.0; n],
        };
        if response.len() != n || std.len() != n {
            return Err(error::identification(format!(
                "frequency, response and std have {n}, {} and {} values: they must be of one length",
                response.len(),
                std.len()
            )));
        }
        for (name, bad) in [
            ("frequency", frequency.iter().position(|f| !f.is_finite())),
            ("response", response.iter().position(|r| !r.is_finite())),
        ] {
            if let Some(k) = bad {
                return Err(error::identification(format!(
                    "{name}[{k}] is not a finite number; leave such lines out"
                )));
            }
        }
        if let Some((k, bad)) =
            (std.iter().enumerate()).find(|(_, std)| std.is_nan() || **std < 0.0)
        {
            return Err(error::identification(format!(
                "std[{k}] = {bad} must be 0 or positive; leave such lines out"
            )));
        }
        let ascends = frequency.windows(2).all(|f| f[0] < f[1]);
        if !ascends || frequency.first().is_none_or(|f| *f <= 0.0 || f.is_nan()) {
            return Err(error::identification(
                "frequency must ascend, from above 0 Hz",
            ));
        }
        if !(sample_period >= 0.0 && sample_period.is_finite()) {
            return Err(error::identification(format!(
                "sample_period = {sample_period} s must be 0 or positive"
            )));
        }
        let nyquist = 0.5 / sample_period;
        if let Some(highest) = frequency.last().filter(|f| **f > nyquist * (1.0 + 1e-9)) {
            return Err(error::identification(format!(
                "frequency goes to {highest} Hz; samples {sample_period} s apart show nothing above {nyquist} Hz"
            )));
        }
        let frf = Frf {
            response,
            std,
            sample_period,
            method: "given".to_owned(),
            ..Frf::exact(&frequency, |_| Complex::new(0.0, 0.0))
        };
        Ok(Self {
            frf,
            notices: Vec::new(),
            what: "response".to_owned(),
            chosen: false,
        })
    }

    #[getter]
    fn frequency<'py>(&self, py: Python<'py>) -> Array<'py, f64> {
        self.frf.frequency.clone().into_pyarray(py)
    }

    #[getter]
    fn response<'py>(&self, py: Python<'py>) -> Array<'py, Complex<f64>> {
        self.frf.response.clone().into_pyarray(py)
    }

    #[getter]
    fn coherence<'py>(&self, py: Python<'py>) -> Array<'py, f64> {
        self.frf.coherence.clone().into_pyarray(py)
    }

    #[getter]
    fn std<'py>(&self, py: Python<'py>) -> Array<'py, f64> {
        self.frf.std.clone().into_pyarray(py)
    }

    #[getter]
    fn distortion<'py>(&self, py: Python<'py>) -> Array<'py, f64> {
        self.frf.distortion.clone().into_pyarray(py)
    }

    #[getter]
    fn averages(&self) -> f64 {
        self.frf.averages
    }

    #[getter]
    fn sample_period(&self) -> f64 {
        self.frf.sample_period
    }

    #[getter]
    fn method(&self) -> &str {
        &self.frf.method
    }

    #[getter]
    fn notices(&self) -> Vec<String> {
        self.notices.clone()
    }

    /// Radius of the circle about each line in which the true response lies with this probability.
    #[pyo3(signature = (probability=0.95))]
    fn confidence<'py>(&self, py: Python<'py>, probability: f64) -> PyResult<Array<'py, f64>> {
        // Written so that a NaN fails.
        if !(probability > 0.0 && probability < 1.0) {
            return Err(error::identification(format!(
                "probability = {probability} must be above 0 and below 1"
            )));
        }
        let radius = self.frf.confidence(probability);
        Ok(radius.map_err(error::identification)?.into_pyarray(py))
    }

    /// The part between two frequencies (Hz).
    fn band(&self, low: f64, high: f64) -> PyResult<Self> {
        Ok(Self {
            frf: self.frf.band(low, high).map_err(error::identification)?,
            notices: self.notices.clone(),
            what: self.what.clone(),
            chosen: true,
        })
    }

    /// Magnitude in dB.
    fn magnitude_db<'py>(&self, py: Python<'py>) -> Array<'py, f64> {
        self.frf.magnitude_db().into_pyarray(py)
    }

    /// Phase in degrees, continuous.
    fn phase_degrees<'py>(&self, py: Python<'py>) -> Array<'py, f64> {
        self.frf.phase_degrees().into_pyarray(py)
    }

    /// In words: how it was measured, and what should be known.
    fn summary(&self) -> String {
        let f = &self.frf;
        let ends = [f.frequency.first(), f.frequency.last()];
        let [low, high] = ends.map(|f| significant(f.copied().unwrap_or(0.0), 3));
        let mut text = format!(
            "{} lines from {low} to {high} Hz, {}, {} independent averages",
            f.frequency.len(),
            f.method,
            significant(f.averages, 3)
        );
        for notice in &self.notices {
            text += &format!("\nnote: {notice}");
        }
        text
    }

    /// Writes a report, one HTML page that needs no network: the Bode plot, what should be known, the numbers.
    ///
    /// Parameters
    /// ----------
    /// path : str or path
    /// fit : TransferFit, optional
    ///     Laid over the response.
    /// force : bool
    ///     Replace a file that is there already and is no such page.
    #[pyo3(signature = (path, fit=None, *, force=false))]
    fn report(
        &self,
        py: Python<'_>,
        path: PathBuf,
        fit: Option<PyRef<'_, PyTransferFit>>,
        force: bool,
    ) -> PyResult<()> {
        let mut bode = Bode::new(&self.what)
            .measured(&self.frf)
            .map_err(error::identification)?;
        let mut text = response_text(&self.what, &self.frf).map_err(error::identification)?;
        let mut notices = self.notices.clone();
        if let Some(fit) = fit {
            let fit = &fit.fit;
            let curve = self.frf.frequency.iter().map(|f| (*f, fit.response(*f)));
            bode = bode.model("fit", &curve.collect::<Vec<_>>(), false);
            text = fit_text(fit) + &text;
            notices.extend(fit.notices().iter().map(ToString::to_string));
        }
        let title = format!("Frequency response {}", self.what);
        file::write_page(py, &path, force, || {
            furuta_ident::report::frequency(&title, bode, &text, &notices)
        })
    }

    /// Draws magnitude, phase and coherence with matplotlib.
    ///
    /// Parameters
    /// ----------
    /// ax : matplotlib.axes.Axes or up to three of them, optional
    ///     Magnitude, phase, coherence; a figure of their own if not given.
    /// **models : TransferFit, or array_like of shape (N,), complex
    ///     Curves to lay over, by name.
    ///
    /// Returns
    /// -------
    /// matplotlib.figure.Figure
    #[pyo3(signature = (*, ax=None, **models))]
    fn plot<'py>(
        slf: Bound<'py, Self>,
        ax: Option<Bound<'py, PyAny>>,
        models: Option<Bound<'py, pyo3::types::PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = slf.py();
        let models = models.unwrap_or_else(|| pyo3::types::PyDict::new(py));
        py.import("furuta.plot._frf")?
            .call_method1("plot", (slf, models, ax))
    }

    fn __repr__(&self) -> String {
        format!("<furuta.Frf {} lines>", self.frf.frequency.len())
    }

    fn __str__(&self) -> String {
        self.summary()
    }

    /// Pickles as its arrays and what is said of them.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Reduced<'py, Parts<'py>>> {
        let (py, this) = (slf.py(), slf.get());
        let f = &this.frf;
        let arrays = (
            this.frequency(py),
            this.response(py),
            this.coherence(py),
            this.std(py),
            this.distortion(py),
        );
        let numbers = (f.averages, f.lines_for_one, f.sample_period);
        let said = (
            f.method.clone(),
            this.notices.clone(),
            this.what.clone(),
            this.chosen,
        );
        Ok((
            slf.get_type().getattr("_from_parts")?,
            (arrays, numbers, said),
        ))
    }

    /// The inverse of pickling.
    #[classmethod]
    fn _from_parts(
        _class: &Bound<'_, PyType>,
        arrays: (Vector<'_>, Vector<'_>, Vector<'_>, Vector<'_>, Vector<'_>),
        numbers: (f64, f64, f64),
        said: (String, Vec<String>, String, bool),
    ) -> PyResult<Self> {
        let refuse = |text: String| error::identification(text);
        let frf = Frf {
            frequency: vector("frequency", &arrays.0, refuse)?,
            response: vector("response", &arrays.1, refuse)?,
            coherence: vector("coherence", &arrays.2, refuse)?,
            std: vector("std", &arrays.3, refuse)?,
            distortion: vector("distortion", &arrays.4, refuse)?,
            averages: numbers.0,
            lines_for_one: numbers.1,
            sample_period: numbers.2,
            method: said.0,
        };
        Ok(Self {
            frf,
            notices: said.1,
            what: said.2,
            chosen: said.3,
        })
    }

    /// The result as a table, for notebooks.
    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        crate::card::card(slf.as_any(), "frf")
    }

    /// The response as python-control's frequency response data; python-control must be installed.
    ///
    /// Returns
    /// -------
    /// control.FrequencyResponseData
    ///     Frequencies in rad/s.
    fn to_control<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py()
            .import("furuta._control")?
            .call_method1("response_data", (slf,))
    }

    /// The response of a python-control system at these frequencies (Hz).
    ///
    /// Parameters
    /// ----------
    /// system : control.StateSpace, control.TransferFunction or control.FrequencyResponseData
    ///     One input, one output. A sampled one gives its sample period.
    /// frequency : array_like, shape (N,), optional
    ///     Hz; of response data, its own if not given.
    ///
    /// Returns
    /// -------
    /// Frf
    #[classmethod]
    #[pyo3(signature = (system, frequency=None), text_signature = "(system, frequency=None)")]
    fn from_control<'py>(
        cls: &Bound<'py, PyType>,
        system: Bound<'py, PyAny>,
        frequency: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        cls.py()
            .import("furuta._control")?
            .call_method1("response", (system, frequency))
    }
}

/// What a response is pickled as.
type Parts<'py> = (
    (
        Array<'py, f64>,
        Array<'py, Complex<f64>>,
        Array<'py, f64>,
        Array<'py, f64>,
        Array<'py, f64>,
    ),
    (f64, f64, f64),
    (String, Vec<String>, String, bool),
);

kept!(PyFrf);

impl Kept for PyFrf {
    fn content(&self) -> String {
        format!(
            "{:?} {:?} {} {}",
            self.frf, self.notices, self.what, self.chosen
        )
    }
}
