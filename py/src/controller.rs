//! The class `Controller`: a controller file at work.

use crate::arguments::RigLike;
use crate::error;
use crate::kept::cloned;
use crate::matrix::{Vector, numbers, state, vector};
use crate::rig::PyRig;
use furuta_ctrl::controllers::{AnyControllerState, Controller};
use furuta_ctrl::reference::ArmTable;
use furuta_ctrl::supervisor::Supervisor;
use furuta_ctrl::{ControllerFile, Site, config};
use furuta_model::State;
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;
use pyo3::types::PyType;
use std::path::PathBuf;

/// A controller file, made for a rig and a sample period: what `furuta run`, `furuta simulate` and a microcontroller
/// read alike.
///
/// `update` is the file's controller alone, from a state to a command, with a memory of its own that `start` clears.
/// The whole control system, estimator, swing-up, limits and all, is at work in `furuta.simulate(..., controller=...)`.
///
/// Examples
/// --------
/// >>> import furuta
/// >>> rig = furuta.Rig.load("shahzad2022-srv02")
/// >>> balance = furuta.Controller.from_toml('''
/// ... [controller]
/// ... kind = "lqr"
/// ... gain = [-1.0, 27.7, -2.0, 3.6]
/// ... ''', rig, dt=0.002)
/// >>> round(balance.update([0, 0.1, 0, 0]), 3)
/// -2.77
/// >>> furuta.Controller.from_toml("", rig, dt=0.002).kind  # everything standard
/// 'lqr'
#[pyclass(name = "Controller", module = "furuta")]
#[derive(Clone)]
pub(crate) struct PyController {
    file: ControllerFile,
    rig: furuta_model::Rig,
    period: f64,
    pub(crate) supervisor: Box<Supervisor<f64>>,
    memory: AnyControllerState<f64>,
}

impl PyController {
    pub(crate) fn new(file: ControllerFile, rig: &RigLike, period: f64) -> PyResult<Self> {
        let rig = rig.rig.clone();
        let supervisor =
            Supervisor::design(&file.config, &Site::of(&rig, period)).map_err(error::controller)?;
        Ok(Self {
            memory: supervisor.balance.start(),
            supervisor: Box::new(supervisor),
            file,
            rig,
            period,
        })
    }

    /// Sample period, s.
    pub(crate) fn period(&self) -> f64 {
        self.period
    }

    /// What its file says.
    pub(crate) fn config(&self) -> &furuta_ctrl::Config {
        &self.file.config
    }

    /// Whether it can be used at this sample period (s).
    pub(crate) fn check_period(&self, period: f64) -> PyResult<()> {
        // Written so that a NaN fails.
        if (period / self.period - 1.0).abs() < 1e-9 {
            return Ok(());
        }
        Err(error::controller(format!(
            "the controller is made for dt = {} s, not for {period} s",
            self.period
        )))
    }
}

cloned!(PyController);

#[pymethods]
impl PyController {
    /// From a controller file (TOML).
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    /// rig : Rig
    ///     What is designed, and what the estimator believes.
    /// dt : float
    ///     Sample period in s.
    ///
    /// Raises
    /// ------
    /// ControllerError
    ///     A file that cannot be read, an unknown key, a value out of range, or a controller that the rig cannot have.
    #[classmethod]
    #[pyo3(text_signature = "(path, rig, dt)")]
    fn from_file(_cls: &Bound<'_, PyType>, path: PathBuf, rig: RigLike, dt: f64) -> PyResult<Self> {
        let file = ControllerFile::load(path).map_err(error::controller)?;
        Self::new(file, &rig, dt)
    }

    /// The same from a file's text.
    #[classmethod]
    #[pyo3(text_signature = "(text, rig, dt)")]
    fn from_toml(_cls: &Bound<'_, PyType>, text: &str, rig: RigLike, dt: f64) -> PyResult<Self> {
        let file = ControllerFile::from_toml(text).map_err(error::controller)?;
        Self::new(file, &rig, dt)
    }

    /// State feedback with a gain of one's own: u = -K x, within the command limit; everything else standard.
    ///
    /// Parameters
    /// ----------
    /// K : array_like, shape (4,) or (1, 4)
    ///     On [theta, alpha, theta_dot, alpha_dot], V/rad and V s/rad, as `furuta.lqr` gives it.
    /// rig : Rig
    ///     What it is for: its limits, and what the estimator believes.
    /// dt : float, optional
    ///     Sample period in s.
    ///
    /// Raises
    /// ------
    /// ControllerError
    ///     A gain that is not possible.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, furuta
    /// >>> rig = furuta.Rig.load("shahzad2022-srv02")
    /// >>> K, S, poles = furuta.lqr(rig, np.eye(4), 1)
    /// >>> balance = furuta.Controller.lqr(K, rig)
    /// >>> balance.gain.round(1).tolist()
    /// [-1.0, 27.7, -2.0, 3.6]
    #[classmethod]
    #[pyo3(signature = (K, rig, dt=0.002), text_signature = "(K, rig, dt=0.002)")]
    #[allow(non_snake_case)] // a keyword in Python
    fn lqr(_cls: &Bound<'_, PyType>, K: Vector<'_>, rig: RigLike, dt: f64) -> PyResult<Self> {
        let gain: Vec<f64> = vector("K", &K, error::controller)?;
        if gain.len() != 4 {
            return Err(error::controller(format!(
                "K has {} numbers; it must have shape (4,) or (1, 4)",
                gain.len()
            )));
        }
        let settings = furuta_ctrl::controllers::StateFeedback::<f64>::settings()
            .with("gain", &gain)
            .map_err(error::controller)?;
        let file = ControllerFile {
            config: furuta_ctrl::Config::with_controller(settings),
            ..ControllerFile::default()
        };
        Self::new(file, &rig, dt)
    }

    /// The kinds that a file's section `[controller]` can have.
    #[classattr]
    #[pyo3(name = "KINDS")]
    fn kinds() -> Vec<&'static str> {
        furuta_ctrl::controllers::CATALOGUE
            .iter()
            .map(|spec| spec.id)
            .collect()
    }

    /// The text of the controller file.
    fn to_toml(&self) -> String {
        self.file.to_toml()
    }

    /// The whole control system, estimator, swing-up and limits included, as one C99 file without allocation, whose
    /// commands are the same bits.
    ///
    /// Parameters
    /// ----------
    /// single : bool, optional
    ///     Compute in float, in place of double.
    ///
    /// Returns
    /// -------
    /// str
    ///     The text of a C file.
    ///
    /// Raises
    /// ------
    /// ControllerError
    ///     A controller, an estimator or an effect of the rig that cannot be exported; the message names what can.
    ///
    /// Examples
    /// --------
    /// >>> import furuta
    /// >>> control = furuta.Controller.from_toml("", furuta.Rig.load("qube-servo-2"), dt=0.002)
    /// >>> "furuta_real furuta_step(" in control.to_c()
    /// True
    #[pyo3(signature = (*, single=false))]
    fn to_c(&self, single: bool) -> PyResult<String> {
        let precision = if single {
            furuta_export::c::Precision::Single
        } else {
            furuta_export::c::Precision::Double
        };
        let (config, rig) = (&self.file.config, &self.rig);
        furuta_export::c::controller(config, rig, self.period, precision).map_err(error::controller)
    }

    /// Writes the controller file, which `furuta run`, `furuta simulate` and a microcontroller read. A file that is
    /// there already is replaced only with `force`.
    #[pyo3(signature = (path, *, force=false))]
    fn save(&self, py: Python<'_>, path: PathBuf, force: bool) -> PyResult<()> {
        crate::file::write_data(py, &path, force, &self.file.to_toml())
    }

    /// The gain K on [theta, alpha, theta_dot, alpha_dot] (V/rad, V s/rad) of a controller that is a state feedback, or
    /// that acts as one near upright; None for others.
    #[getter]
    fn gain<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        let feedback = self.supervisor.balance.surrogate()?;
        Some(feedback.gain.to_vec().into_pyarray(py))
    }

    /// The rig that it was made for.
    #[getter]
    fn rig(&self) -> PyRig {
        PyRig {
            rig: self.rig.clone(),
        }
    }

    /// Kind of the controller, for example "lqr".
    #[getter]
    fn kind(&self) -> &'static str {
        self.supervisor.balance.spec().id
    }

    /// Sample period, s.
    #[getter]
    fn dt(&self) -> f64 {
        self.period
    }

    /// Largest command, V.
    #[getter]
    fn command_limit(&self) -> f64 {
        self.supervisor.thresholds.command_limit
    }

    /// Forgets everything: as before the first sample.
    fn start(&mut self) {
        self.memory = self.supervisor.balance.start();
    }

    /// The command in V for the state x, to be held for one sample period.
    ///
    /// Parameters
    /// ----------
    /// x : array_like, shape (4,)
    ///     State [theta, alpha, theta_dot, alpha_dot] in rad and rad/s.
    /// reference : array_like, shape (4,), optional
    ///     Where to go; upright with the arm at 0 if not given.
    /// h : float, optional
    ///     Sample period in s; the controller's own if not given.
    /// ahead : array_like, shape (N,), optional
    ///     The arm's reference at the samples to come in rad; it stays at the last one. Only `kind = "mpc"` with
    ///     `preview = true` acts before the reference moves.
    ///
    /// Returns
    /// -------
    /// float
    ///     Always finite and within the command limit.
    #[pyo3(signature = (x, reference=None, h=None, *, ahead=None))]
    fn update(
        &mut self,
        x: Vector<'_>,
        reference: Option<Vector<'_>>,
        h: Option<f64>,
        ahead: Option<Bound<'_, PyAny>>,
    ) -> PyResult<f64> {
        let reference = match reference {
            Some(reference) => state("reference", &reference)?,
            None => State::upright(),
        };
        let h = h.unwrap_or(self.period);
        if !(h > 0.0 && h <= 1.0) {
            return Err(error::controller(format!(
                "h = {h} s is outside the allowed range (0, 1] s"
            )));
        }
        let x = state("x", &x)?;
        let next: Vec<f64> = match &ahead {
            None => Vec::new(),
            Some(ahead) => numbers::<f64>("ahead", ahead, error::said)?
                .as_array()
                .iter()
                .copied()
                .collect(),
        };
        if let Some(k) = next.iter().position(|r| !r.is_finite()) {
            return Err(error::controller(format!(
                "ahead[{k}] = {} is not a finite number",
                next[k]
            )));
        }
        let balance = &self.supervisor.balance;
        let reference = ArmTable {
            now: reference,
            next: &next,
        };
        Ok(balance.update_ahead(&mut self.memory, &x, &reference, h))
    }

    fn __repr__(&self) -> String {
        format!(
            "<furuta.Controller {:?} for {:?} at {} s>",
            self.kind(),
            self.rig.name,
            self.period
        )
    }

    /// Controllers are equal that are made of equal files for equal rigs at one sample period; what they remember does
    /// not count.
    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| {
            let other = other.borrow();
            self.file == other.file && self.rig == other.rig && self.period == other.period
        })
    }

    /// The controller as a table, for notebooks.
    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        crate::card::card(slf.as_any(), "controller")
    }

    /// Pickles as the file's text; what the controller remembers stays behind.
    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, (String, PyRig, f64))> {
        let this = slf.borrow();
        let rig = PyRig {
            rig: this.rig.clone(),
        };
        Ok((
            slf.get_type().getattr("from_toml")?,
            (this.file.to_toml(), rig, this.period),
        ))
    }
}

/// What a controller file may say: `furuta controllers` as a dict.
///
/// Returns
/// -------
/// dict
///     By section, by kind: `sentence` and `parameters`, which by name hold `unit`, `sentence`, `numbers` (how many),
///     `words`, `min`, `max` and `default`; None where there is none.
///
/// Examples
/// --------
/// >>> import furuta
/// >>> furuta.controllers()["limits"]["limits"]["parameters"]["command"]["unit"]
/// 'V'
#[pyfunction]
#[pyo3(text_signature = "()")]
pub(crate) fn controllers(py: Python<'_>) -> PyResult<Bound<'_, pyo3::types::PyDict>> {
    use furuta_ctrl::settings::Shape;
    use pyo3::types::PyDict;
    let all = PyDict::new(py);
    for (section, kinds) in &config::SECTIONS {
        let of_section = PyDict::new(py);
        for spec in *kinds {
            let parameters = PyDict::new(py);
            for p in spec.parameters {
                let entry = PyDict::new(py);
                entry.set_item("unit", p.unit)?;
                entry.set_item("sentence", p.sentence)?;
                entry.set_item("numbers", p.shape.len())?;
                let words = match p.shape {
                    Shape::Word(words) => Some(words.to_vec()),
                    _ => None,
                };
                entry.set_item("words", words)?;
                entry.set_item("min", p.min)?;
                entry.set_item("max", p.max)?;
                entry.set_item("default", p.default)?;
                parameters.set_item(p.name, entry)?;
            }
            let kind = PyDict::new(py);
            kind.set_item("sentence", spec.sentence)?;
            kind.set_item("parameters", parameters)?;
            of_section.set_item(spec.id, kind)?;
        }
        all.set_item(*section, of_section)?;
    }
    Ok(all)
}
