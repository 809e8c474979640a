//! A log through the estimator and controller that made it.

use std::path::PathBuf;

use furuta_ctrl::ControllerFile;
use furuta_hw::replay::{Finding, Hole};
use furuta_hw::{Replay, ReplayOptions};
use furuta_log::{Log, Mode, Record};
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arguments::RigLike;
use crate::error;
use crate::kept::immutable;

/// What `replay` found.
///
/// Attributes
/// ----------
/// identical : bool
///     Whether the log's own pilot gives every command, mode, estimate and reference of the log, bit for bit.
/// same_pilot : bool
///     Whether it was replayed with what made it; False with another controller or rig file.
/// pilot : str
///     The pilot in words.
/// samples : int
///     Samples replayed.
/// equal : int
///     Commands that are equal, bit for bit.
/// first : dict or None
///     The first thing that is not as it should be: index, seq, says, and quantities (column, logged, replayed, ulps)
///     where the pilot answers otherwise; column and value where no run of this rig can have given the record.
/// largest : dict or None
///     The largest difference between two commands: index, volts.
/// missing : dict or None
///     Records that the log does not have: index, records, t. An exact replay ends there.
/// fault : dict or None
///     What ended the run by the replay: index, says.
/// notice : str or None
///     Where the log ends early.
#[pyclass(name = "Replay", module = "furuta", frozen)]
pub(crate) struct PyReplay {
    log: Log,
    replay: Replay,
}

immutable!(PyReplay);

#[pymethods]
impl PyReplay {
    /// How many commands are equal, and the first thing that is not as it should be, in words.
    fn summary(&self) -> String {
        self.replay.to_string()
    }

    /// Both sides, sample by sample.
    ///
    /// Returns
    /// -------
    /// dict of str to ndarray or list of str
    ///     `t` (s); `command` (V), `theta_dot`, `alpha_dot` (rad/s), `reference` (rad) and `mode` as logged; the same
    ///     with `replayed_` before the name as replayed.
    fn columns<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let logged: &[Record] = &self.log.records;
        let logged = logged.get(..self.replay.samples.len()).unwrap_or(logged);
        let replayed = &self.replay.samples;
        let of = |value: fn(&Record) -> f64| -> Bound<'py, PyArray1<f64>> {
            logged
                .iter()
                .map(value)
                .collect::<Vec<_>>()
                .into_pyarray(py)
        };
        let again = |value: fn(&furuta_hw::replay::Replayed) -> f64| -> Bound<'py, PyArray1<f64>> {
            replayed
                .iter()
                .map(value)
                .collect::<Vec<_>>()
                .into_pyarray(py)
        };
        let columns = PyDict::new(py);
        columns.set_item("t", of(|r| r.t))?;
        columns.set_item("command", of(|r| r.command))?;
        columns.set_item("theta_dot", of(|r| r.theta_dot))?;
        columns.set_item("alpha_dot", of(|r| r.alpha_dot))?;
        columns.set_item("reference", of(|r| r.reference))?;
        let modes: Vec<_> = logged.iter().map(|r| r.mode.name()).collect();
        columns.set_item("mode", modes)?;
        columns.set_item("replayed_command", again(|r| r.command))?;
        columns.set_item("replayed_theta_dot", again(|r| r.theta_dot))?;
        columns.set_item("replayed_alpha_dot", again(|r| r.alpha_dot))?;
        columns.set_item("replayed_reference", again(|r| r.reference))?;
        let modes: Vec<_> = replayed.iter().map(|r| r.mode.name()).collect();
        columns.set_item("replayed_mode", modes)?;
        Ok(columns)
    }

    #[getter]
    fn identical(&self) -> bool {
        self.replay.is_identical()
    }

    #[getter]
    fn same_pilot(&self) -> bool {
        self.replay.same_pilot
    }

    #[getter]
    fn pilot(&self) -> &str {
        &self.replay.pilot
    }

    #[getter]
    fn samples(&self) -> usize {
        self.replay.samples.len()
    }

    #[getter]
    fn equal(&self) -> usize {
        self.replay.equal
    }

    #[getter]
    fn first<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        self.replay
            .first
            .as_ref()
            .map(|found| first(py, found))
            .transpose()
    }

    #[getter]
    fn largest<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some((index, volts)) = self.replay.largest else {
            return Ok(None);
        };
        let dict = PyDict::new(py);
        dict.set_item("index", index)?;
        dict.set_item("volts", volts)?;
        Ok(Some(dict))
    }

    #[getter]
    fn missing<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(Hole { index, records, t }) = self.replay.hole else {
            return Ok(None);
        };
        let dict = PyDict::new(py);
        dict.set_item("index", index)?;
        dict.set_item("records", records)?;
        dict.set_item("t", t)?;
        Ok(Some(dict))
    }

    #[getter]
    fn fault<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some((index, fault)) = &self.replay.fault else {
            return Ok(None);
        };
        let dict = PyDict::new(py);
        dict.set_item("index", index)?;
        dict.set_item("says", fault.to_string())?;
        Ok(Some(dict))
    }

    #[getter]
    fn notice(&self) -> Option<String> {
        self.log.notice.as_ref().map(ToString::to_string)
    }

    fn __repr__(&self) -> String {
        format!("<furuta.Replay: {}>", self.replay)
    }

    /// The result as a table, for notebooks.
    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        crate::card::card(slf.as_any(), "replay")
    }
}

fn first<'py>(py: Python<'py>, finding: &Finding) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    match finding {
        Finding::Impossible(found) => {
            dict.set_item("index", found.index)?;
            dict.set_item("seq", found.seq)?;
            dict.set_item("column", found.name)?;
            dict.set_item("value", found.value)?;
            dict.set_item("says", found.to_string())?;
        }
        Finding::Differs(found) => {
            dict.set_item("index", found.index)?;
            dict.set_item("seq", found.seq)?;
            dict.set_item("t", found.t)?;
            dict.set_item("modes", found.modes.map(Mode::name))?;
            dict.set_item("says", found.to_string())?;
            let mut quantities = Vec::new();
            for q in &found.quantities {
                let entry = PyDict::new(py);
                entry.set_item("column", q.name)?;
                entry.set_item("unit", q.unit)?;
                entry.set_item("logged", q.logged)?;
                entry.set_item("replayed", q.replayed)?;
                entry.set_item("ulps", q.ulps)?;
                quantities.push(entry);
            }
            dict.set_item("quantities", quantities)?;
        }
    }
    Ok(dict)
}

/// Runs a log of `furuta run` through the estimator and controller that made it and compares what they command with
/// what is logged, bit for bit.
///
/// The pilot is rebuilt from what the log says of its run. With another controller or rig file: what they would have
/// commanded at the same measurements, which is no simulation, since the logged motion does not follow the other
/// commands.
///
/// Parameters
/// ----------
/// path : str or path-like
///     The log.
/// controller : str or path-like, optional
///     Another controller file.
/// rig : Rig, optional
///     Another rig to design the controller for.
/// any_rig : bool
///     Take that rig even where its name, encoders or command limit are not those of the log.
/// any_version : bool
///     Compare all the same where another version of furuta wrote the log.
///
/// Returns
/// -------
/// Replay
///
/// Raises
/// ------
/// RecordingError
///     A log that cannot be read, is older than replay, or of another version or rig.
/// ControllerError
///     A controller file that cannot be.
///
/// Examples
/// --------
/// >>> import furuta
/// >>> def check(path):
/// ...     found = furuta.replay(path)
/// ...     return found.identical, found.samples
/// >>> try:
/// ...     check("no/such/run.mcap")
/// ... except furuta.RecordingError as error:
/// ...     print(str(error).split(":")[0])
/// no/such/run.mcap
#[pyfunction]
#[pyo3(signature = (path, *, controller=None, rig=None, any_rig=false, any_version=false))]
pub(crate) fn replay(
    py: Python<'_>,
    path: PathBuf,
    controller: Option<PathBuf>,
    rig: Option<RigLike>,
    any_rig: bool,
    any_version: bool,
) -> PyResult<PyReplay> {
    let options = ReplayOptions {
        controller: controller
            .map(ControllerFile::load)
            .transpose()
            .map_err(error::controller)?,
        rig: rig.map(|rig| rig.rig),
        any_rig,
        any_version,
    };
    py.detach(|| {
        let named =
            |e: &dyn std::fmt::Display| error::recording(format!("{}: {e}", path.display()));
        // An error of opening names the file itself.
        let log = furuta_log::read(&path).map_err(|e| match e {
            furuta_log::LogError::Open { .. } => error::recording(e),
            other => named(&other),
        })?;
        let replay = furuta_hw::replay::replay(&log, &options).map_err(|e| named(&e))?;
        Ok(PyReplay { log, replay })
    })
}
