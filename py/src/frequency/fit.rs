//! Transfer functions fitted to responses.

use super::frf::PyFrf;
use super::transfer_fit::PyTransferFit;
use crate::background::awaited;
use crate::error;
use furuta_ident::frequency::orders::sweep;
use furuta_ident::frequency::{Delay, Hold, Request, fit};
use pyo3::prelude::*;

/// Fits a continuous transfer function to a frequency response: nonlinear least squares over the complex plane, each
/// line weighted by its deviation. Of a response whose band was not chosen (`frf(..., band=...)`, `Frf.band`) the lines
/// beyond the end of the coherence are left out, and `notices` says so.
///
/// Parameters
/// ----------
/// frf : Frf
/// zeros, poles : int, optional
///     Orders of numerator and denominator; all orders up to 5 are tried and the best by BIC given if neither is.
/// delay : float or "fit", optional
///     Delay beyond the hold's own, s.
/// hold : bool, optional
///     Whether the response is that of a sampled plant behind a zero-order hold, which is then taken out; by default,
///     where the response has a sample period.
///
/// Returns
/// -------
/// TransferFit
///
/// Raises
/// ------
/// IdentificationError
///     Orders that cannot be, too few lines, no convergence.
///
/// Examples
/// --------
/// >>> import numpy as np, furuta
/// >>> f = np.linspace(0.1, 5, 50)
/// >>> s = 2j * np.pi * f
/// >>> fit = furuta.fit_transfer_function(furuta.Frf(f, (s + 4) / (s**2 + 2 * s + 30)), 1, 2)
/// >>> num, den = fit
/// >>> bool(np.allclose(num, [1, 4]) and np.allclose(den, [1, 2, 30]))
/// True
#[pyfunction]
#[pyo3(signature = (frf, zeros=None, poles=None, *, delay=None, hold=None), text_signature = "(frf, \
    zeros=None, poles=None, *, delay=None, hold=None)")]
pub(crate) fn fit_transfer_function(
    py: Python<'_>,
    frf: PyRef<'_, PyFrf>,
    zeros: Option<usize>,
    poles: Option<usize>,
    delay: Option<&Bound<'_, PyAny>>,
    hold: Option<bool>,
) -> PyResult<PyTransferFit> {
    let delay = match delay {
        None => Delay::Known(0.0),
        Some(given) => match given.extract::<f64>() {
            Ok(seconds) => Delay::Known(seconds),
            Err(_) if given.extract::<String>().is_ok_and(|s| s == "fit") => Delay::Fitted,
            Err(_) => {
                return Err(error::identification(
                    "delay must be a number of seconds or \"fit\"",
                ));
            }
        },
    };
    let (frf, ends) = if frf.chosen {
        (frf.frf.clone(), None)
    } else {
        frf.frf.coherent()
    };
    let hold = if hold.unwrap_or(frf.sample_period > 0.0) {
        if frf.sample_period <= 0.0 {
            return Err(error::identification(
                "hold=True needs a response with a sample period: Frf(..., sample_period=...)",
            ));
        }
        Hold::ZeroOrder(frf.sample_period)
    } else {
        Hold::None
    };
    let fit = match (zeros, poles) {
        (Some(zeros), Some(poles)) => {
            let request = Request {
                zeros,
                poles,
                hold,
                delay,
            };
            awaited(py, move || fit(&frf, &request))?.map_err(error::identification)?
        }
        (None, None) => awaited(py, move || sweep(&frf, 5, hold, delay))?
            .into_iter()
            .next()
            .ok_or_else(|| {
                error::identification(
                    "no transfer function could be fitted: widen the band or ask for a finer resolution",
                )
            })?,
        _ => {
            return Err(error::identification(
                "give both orders, zeros and poles, or neither",
            ));
        }
    };
    Ok(PyTransferFit {
        fit,
        ends: ends.map(|notice| notice.to_string()),
    })
}
