//! How punctual the loop of a run was, from its log.

use std::path::PathBuf;

use furuta_log::{Histogram, LogError, Quantiles, Timing};
use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error;

/// How punctual the loop of a run was: what `furuta run` printed at its end, read from its log.
///
/// Parameters
/// ----------
/// path : path of the MCAP log that `furuta run --log` wrote.
///
/// Returns
/// -------
/// dict
///     ``wake_up``, ``round_trip``, ``compute``, ``total``: each a dict of ``count`` and of times in s, ``min``,
///     ``mean``, ``p50``, ``p99``, ``p99.9``, ``max`` (None where nothing was counted), and ``buckets``, an (n, 3)
///     array: a bucket's shortest and longest time in s and how many it holds. ``overruns``: samples answered later
///     than ``period`` (s) after the promptest would have arrived. ``real_time``: what the system granted the loop or
///     refused, by name.
///
/// Raises
/// ------
/// RecordingError
///     The file is no log of a run, or of one that was killed: the times are written at its end.
///
/// Examples
/// --------
/// >>> import furuta, subprocess
/// >>> timing = furuta.timing("run.mcap")                              # doctest: +SKIP
/// >>> timing["compute"]["p99"] < timing["period"], timing["overruns"]  # doctest: +SKIP
/// (True, 0)
#[pyfunction]
#[pyo3(text_signature = "(path)")]
pub(crate) fn timing(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyDict>> {
    let log = py.detach(|| furuta_log::read(&path)).map_err(|e| match e {
        // It names the file itself.
        LogError::Open { .. } => error::recording(e),
        e => error::recording(format!("{}: {e}", path.display())),
    })?;
    let Some(timing) = &log.timing else {
        return Err(error::recording(format!(
            "{}: the log does not say how punctual its run was: the run was killed, or an older program wrote it",
            path.display()
        )));
    };
    let Timing {
        overruns, period, ..
    } = **timing;
    let told = PyDict::new(py);
    for (name, histogram) in timing.parts() {
        told.set_item(name, part(py, histogram)?)?;
    }
    told.set_item("overruns", overruns)?;
    told.set_item("period", period as f64 * 1e-9)?;
    told.set_item("real_time", &log.real_time)?;
    Ok(told)
}

fn part<'py>(py: Python<'py>, histogram: &Histogram) -> PyResult<Bound<'py, PyDict>> {
    let q = Quantiles::of(histogram);
    let told = PyDict::new(py);
    told.set_item("count", q.count)?;
    for (name, seconds) in [
        ("min", q.min),
        ("mean", q.mean),
        ("p50", q.p50),
        ("p99", q.p99),
        ("p99.9", q.p99_9),
        ("max", q.max),
    ] {
        told.set_item(name, seconds)?;
    }
    let rows: Vec<Vec<f64>> = histogram
        .buckets()
        .map(|b| {
            vec![
                b.lowest as f64 * 1e-9,
                b.highest as f64 * 1e-9,
                b.count as f64,
            ]
        })
        .collect();
    let buckets = if rows.is_empty() {
        PyArray2::zeros(py, [0, 3], false)
    } else {
        PyArray2::from_vec2(py, &rows)?
    };
    told.set_item("buckets", buckets)?;
    Ok(told)
}
