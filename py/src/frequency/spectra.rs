//! Averaged spectra of arrays.

use crate::error;
use crate::forked::here;
use crate::matrix::{Vector, vector};
use furuta_ident::frequency::{Settings, Spectra, Stretch, Window};
use numpy::IntoPyArray;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Averaged spectral densities and the cross spectrum of two signals (Welch): the numbers of `scipy.signal.csd` with a
/// constant detrend.
///
/// Parameters
/// ----------
/// u, y : array_like, shape (N,)
///     Evenly sampled, taken together.
/// dt : float
///     Time between samples in s.
/// segment : int
///     Samples in a segment (SciPy: nperseg).
/// overlap : int, optional
///     Samples that a segment shares with the next (SciPy: noverlap); half a segment if not given.
/// window : str, optional
///     "rectangular" ("boxcar"), "hann", "hamming", "blackman", "blackmanharris", "flattop".
///
/// Returns
/// -------
/// dict
///     frequency (Hz), uu, yy (densities, one-sided), uy (mean(conj(U) Y), complex), averages (independent ones).
///
/// Raises
/// ------
/// IdentificationError
///     A constant or too short signal, numbers that are not finite, settings out of range.
///
/// Examples
/// --------
/// >>> import numpy as np, furuta
/// >>> u = np.random.default_rng(0).normal(size=4000)
/// >>> s = furuta.spectra(u, 2 * u, 0.01, 400)
/// >>> bool(np.allclose(s["uy"], 2 * s["uu"]))
/// True
#[pyfunction]
#[pyo3(signature = (u, y, dt, segment, *, overlap=None, window="hann"))]
pub(crate) fn spectra<'py>(
    py: Python<'py>,
    u: Vector<'py>,
    y: Vector<'py>,
    dt: f64,
    segment: usize,
    overlap: Option<usize>,
    window: &str,
) -> PyResult<Bound<'py, PyDict>> {
    let window: Window = window.parse().map_err(error::identification)?;
    let settings = Settings {
        segment,
        overlap: overlap.unwrap_or(segment / 2),
        window,
    };
    let read = |name, v: &Vector<'_>| vector::<f64>(name, v, error::identification);
    let (u, y) = (read("u", &u)?, read("y", &y)?);
    let found = py
        .detach(|| {
            let stretch = Stretch {
                u: &u,
                y: &y,
                r: None,
            };
            here(|| Spectra::of(&[stretch], dt, &settings))
        })
        .map_err(error::identification)?;
    let out = PyDict::new(py);
    out.set_item("frequency", found.frequency.into_pyarray(py))?;
    out.set_item("uu", found.uu.into_pyarray(py))?;
    out.set_item("yy", found.yy.into_pyarray(py))?;
    out.set_item("uy", found.uy.into_pyarray(py))?;
    out.set_item("averages", found.averages)?;
    Ok(out)
}
