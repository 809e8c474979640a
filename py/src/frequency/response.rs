//! Frequency responses of recordings.

use super::frf::PyFrf;
use crate::background::awaited;
use crate::error;
use crate::recording::read;
use furuta_ident::frequency::record::{Columns, Taken};
use furuta_ident::frequency::{Estimator, Measurement, Method, Window};
use pyo3::prelude::*;

/// Frequency response from recordings: together with its transient, by averaging windowed segments (Welch), or from
/// whole periods of a periodic signal.
///
/// It is the response of the sampled plant: the hold of the command, half a sample of delay, is in it;
/// `fit_transfer_function` takes it out.
///
/// Parameters
/// ----------
/// recordings : path, dict, or list of these
///     As for `diagnose`; all of one sampling rate.
/// output, input : str, optional
///     Columns: "alpha" or "theta" over "u".
/// reference : str, optional
///     Column that no controller chose: joint input-output estimate, for recordings in closed loop.
/// estimator : {"local", "H1", "H2"}, optional
///     "local": response and transient together, by the local rational method, without leakage. "H1", "H2": quotients of
///     averaged spectra; with `reference`, both mean the joint one.
/// resolution : float, optional
///     Distance of lines in Hz; a tenth of the longest stretch gives it if not given.
/// window : str, optional
///     As for `spectra`; for averaged spectra alone.
/// overlap : float, optional
///     Part of a segment shared with the next; 0.5 if not given.
/// period : float, optional
///     The signal repeats after this time, s: lines without leakage; with a multisine of harmonics="detecting",
///     nonlinear distortion is told from noise (`Frf.distortion`).
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
#[pyo3(signature = (recordings, *, output="alpha", input="u", reference=None, estimator="local", resolution=None,
    window=None, overlap=None, period=None, discard=1, band=None, accept_suspicious=false))]
#[allow(clippy::too_many_arguments)] // keywords of a Python function
pub(crate) fn frf(
    py: Python<'_>,
    recordings: &Bound<'_, PyAny>,
    output: &str,
    input: &str,
    reference: Option<&str>,
    estimator: &str,
    resolution: Option<f64>,
    window: Option<&str>,
    overlap: Option<f64>,
    period: Option<f64>,
    discard: usize,
    band: Option<(f64, f64)>,
    accept_suspicious: bool,
) -> PyResult<PyFrf> {
    let (recordings, mut notices) = read(recordings, accept_suspicious)?;
    let estimator = match (reference, estimator) {
        (_, "local") => None,
        (Some(_), "H1" | "h1" | "H2" | "h2") => Some(Estimator::Joint),
        (None, "H1" | "h1") => Some(Estimator::H1),
        (None, "H2" | "h2") => Some(Estimator::H2),
        (_, other) => {
            return Err(error::identification(format!(
                "estimator = {other:?} is none of \"local\", \"H1\", \"H2\""
            )));
        }
    };
    let window = window
        .map(str::parse::<Window>)
        .transpose()
        .map_err(error::identification)?;
    let method = match (period, estimator) {
        (Some(period), _) => Method::Periodic { period, discard },
        (None, None) if window.is_some() || overlap.is_some() => {
            return Err(error::identification(
                "window and overlap belong to averaged segments: give estimator=\"H1\" or \"H2\" with them",
            ));
        }
        (None, None) => Method::Local,
        (None, Some(estimator)) => Method::Averaged {
            estimator,
            window: window.unwrap_or_default(),
            overlap: overlap.unwrap_or(0.5),
        },
    };
    let measurement = Measurement {
        method,
        resolution,
        band: band.map(|(low, high)| [low, high]),
    };
    let [output, input] = [output, input].map(str::to_owned);
    let reference = reference.map(str::to_owned);
    let what = format!("{output} / {input}");
    let measured = awaited(py, move || {
        let columns = Columns {
            input: &input,
            output: &output,
            external: reference.as_deref(),
        };
        let taken = Taken::from_recordings(&recordings, columns)?;
        measurement.response(&taken)
    })?;
    let (frf, said) =
        measured.map_err(|e: furuta_ident::frequency::FrequencyError| error::identification(e))?;
    notices.extend(said.iter().map(ToString::to_string));
    Ok(PyFrf {
        frf,
        notices,
        what,
        chosen: band.is_some(),
    })
}
