//! Frequency responses of recordings.

use super::fit::PyTransferFit;
use crate::error;
use crate::file;
use crate::matrix::Vector;
use crate::recording::read;
use furuta_ident::diagnose::result::significant;
use furuta_ident::frequency::bode::Bode;
use furuta_ident::frequency::record::{Columns, Taken};
use furuta_ident::frequency::words::{fit_text, response_text};
use furuta_ident::frequency::{Estimator, Frf, Settings, periodic};
use nalgebra::Complex;
use numpy::{AllowTypeChange, IntoPyArray, PyArray1, PyArrayLike1};
use pyo3::prelude::*;
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
///     Standard deviation of each line (distance in the complex plane); without it, all lines count equally relative to their size.
/// sample_period : float, optional
///     In s, where the response is that of a sampled plant behind a hold; 0 for a continuous one.
///
/// Attributes
/// ----------
/// frequency, response, coherence, std : numpy.ndarray, shape (N,)
/// averages : float
///     Independent averages.
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
    notices: Vec<String>,
    /// What it is of: `alpha / u`.
    what: String,
}

#[pymethods]
impl PyFrf {
    #[new]
    #[pyo3(signature = (frequency, response, std=None, *, sample_period=0.0))]
    fn new(
        frequency: Vector<'_>,
        response: PyArrayLike1<'_, Complex<f64>, AllowTypeChange>,
        std: Option<Vector<'_>>,
        sample_period: f64,
    ) -> PyResult<Self> {
        let frequency = frequency.as_array().to_vec();
        let response = response.as_array().to_vec();
        let n = frequency.len();
        let std = std.map_or_else(|| vec![0.0; n], |s| s.as_array().to_vec());
        if response.len() != n || std.len() != n {
            return Err(error::identification(format!(
                "frequency, response and std have {n}, {} and {} values: they must be of one length",
                response.len(),
                std.len()
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
        let radius = self.frf.confidence(probability);
        Ok(radius.map_err(error::identification)?.into_pyarray(py))
    }

    /// The part between two frequencies (Hz).
    fn band(&self, low: f64, high: f64) -> PyResult<Self> {
        Ok(Self {
            frf: self.frf.band(low, high).map_err(error::identification)?,
            notices: self.notices.clone(),
            what: self.what.clone(),
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
    /// **models : TransferFit, or array_like of shape (N,), complex
    ///     Curves to lay over, by name.
    ///
    /// Returns
    /// -------
    /// matplotlib.figure.Figure
    #[pyo3(signature = (**models))]
    fn plot<'py>(
        slf: Bound<'py, Self>,
        models: Option<Bound<'py, pyo3::types::PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = slf.py();
        let models = models.unwrap_or_else(|| pyo3::types::PyDict::new(py));
        py.import("furuta._bode")?
            .call_method1("plot", (slf, models))
    }

    fn __repr__(&self) -> String {
        format!("<furuta.Frf {} lines>", self.frf.frequency.len())
    }

    fn __str__(&self) -> String {
        self.summary()
    }
}

/// Frequency response from recordings: by averaging windowed segments (Welch), or from whole periods of a periodic signal.
///
/// It is the response of the sampled plant: the hold of the command, half a sample of delay, is in it; `fit_transfer_function` takes it out.
///
/// Parameters
/// ----------
/// recordings : path, dict, or list of these
///     As for `diagnose`; all of one sampling rate.
/// output, input : str, optional
///     Columns: "alpha" or "theta" over "u".
/// reference : str, optional
///     Column that no controller chose: joint input-output estimate, for recordings in closed loop.
/// estimator : {"H1", "H2"}, optional
/// resolution : float, optional
///     Distance of lines in Hz; a tenth of the longest stretch gives it if not given.
/// window : str, optional
///     As for `spectra`.
/// overlap : float, optional
///     Part of a segment shared with the next.
/// period : float, optional
///     The signal repeats after so many seconds: lines without leakage.
/// discard : int, optional
///     Periods left out at the start.
/// band : (float, float), optional
///     Frequencies to give, Hz.
/// accept_suspicious : bool, optional
///     As for `diagnose`.
///
/// Returns
/// -------
/// Frf
///
/// Raises
/// ------
/// RecordingError
///     A recording that cannot be used.
/// IdentificationError
///     Too short for the resolution, constant, not periodic, a column that is not there.
///
/// Examples
/// --------
/// >>> import numpy as np, furuta
/// >>> rig = furuta.Rig.load("qube-servo-2")
/// >>> u = furuta.signal("noise", 60, 0.002, rms=1.0, low=0.0, high=15.0)
/// >>> x = furuta.simulate(rig, [0, np.pi, 0, 0], u[:-1], 0.002)
/// >>> data = {"t": 0.002 * np.arange(len(u)), "u": u, "theta": x[:, 0], "alpha": x[:, 1]}
/// >>> response = furuta.frf(data, band=(0.5, 10))
/// >>> bool(np.median(response.coherence) > 0.9)
/// True
#[pyfunction]
#[pyo3(signature = (recordings, *, output="alpha", input="u", reference=None, estimator="H1", resolution=None, window="hann", overlap=0.5, period=None, discard=1, band=None, accept_suspicious=false))]
#[allow(clippy::too_many_arguments)] // keywords of a Python function
pub(crate) fn frf(
    py: Python<'_>,
    recordings: &Bound<'_, PyAny>,
    output: &str,
    input: &str,
    reference: Option<&str>,
    estimator: &str,
    resolution: Option<f64>,
    window: &str,
    overlap: f64,
    period: Option<f64>,
    discard: usize,
    band: Option<(f64, f64)>,
    accept_suspicious: bool,
) -> PyResult<PyFrf> {
    let (recordings, mut notices) = read(recordings, accept_suspicious)?;
    let estimator = match (reference, estimator) {
        (Some(_), _) => Estimator::Joint,
        (None, "H1") => Estimator::H1,
        (None, "H2") => Estimator::H2,
        (None, other) => {
            return Err(error::identification(format!(
                "estimator = {other:?} is none of \"H1\", \"H2\""
            )));
        }
    };
    let window = window.parse().map_err(error::identification)?;
    if !(0.0..=0.95).contains(&overlap) {
        return Err(error::identification(format!(
            "overlap = {overlap} is outside the allowed range [0, 0.95]"
        )));
    }
    let columns = Columns {
        input,
        output,
        external: reference,
    };
    let measured = py.detach(|| {
        let taken = Taken::from_recordings(&recordings, columns)?;
        let mut said = taken.notices.clone();
        let mut frf = match period {
            Some(period) => {
                periodic::response(&taken.stretches, taken.sample_period, period, discard)?
            }
            None => {
                let mut settings = taken.usual_settings();
                if let Some(resolution) = resolution {
                    settings.segment = (1.0 / (resolution * taken.sample_period)).round() as usize;
                }
                settings = Settings {
                    overlap: (overlap * settings.segment as f64) as usize,
                    window,
                    ..settings
                };
                let (frf, more) =
                    Frf::measure(&taken.stretches, taken.sample_period, &settings, estimator)?;
                said.extend(more);
                frf
            }
        };
        if let Some((low, high)) = band {
            frf = frf.band(low, high)?;
        }
        said.extend(frf.low_coherence());
        Ok((frf, said))
    });
    let (frf, said) =
        measured.map_err(|e: furuta_ident::frequency::FrequencyError| error::identification(e))?;
    notices.extend(said.iter().map(ToString::to_string));
    Ok(PyFrf {
        frf,
        notices,
        what: format!("{output} / {input}"),
    })
}
