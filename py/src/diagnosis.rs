//! The diagnosis: run in a thread of its own, so that Ctrl-C and progress work while Rust is at it.

use crate::arguments::RigLike;
use crate::error;
use crate::file;
use crate::forked::here;
use crate::kept::{Kept, Reduced, kept, unreadable};
use crate::recording::{Chosen, choose, selection, state};
use crate::rig::PyRig;
use furuta_ident::Insufficient;
use furuta_ident::diagnose::{
    Curves, Diagnosis, Options, Outcome, Progress, Request, diagnose_with,
};
use pyo3::exceptions::{PyKeyError, PyKeyboardInterrupt, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// How often Ctrl-C is looked for.
const PATIENCE: Duration = Duration::from_millis(50);

/// What `diagnose` found. Attributes and JSON have the names of the JSON contract; numbers are SI, unknown ones None.
///
/// Attributes
/// ----------
/// verdict : str
///     "no_gap", "parameters_only", "missing_effects" or "unexplained".
/// effects : list of dict
///     The missing effects: id, name, parameters (value, std, unit by name), delta_bic, held_out_gain, confusable_with.
/// custom : dict or None
///     An empirical expression for what no effect explains (verdict "unexplained"): terms (id, expression, on,
///     parameters), held_out_gain, and the RMS errors on held-out data without and with it (rad). Fitted, no law of
///     physics; `repaired_rig` has it.
/// limits : list of dict
///     How large each effect that was not named could still be (95 %): id, parameter, at_most, std, typical, unit.
/// parameters : dict
///     Recalibrated parameters by key: nominal, fitted, std, unit, identifiable.
/// gap, held_out : dict
///     RMS prediction errors in rad by model and angle; held_out is None where there were too few data.
/// where : list of dict
///     Where the gap sits: run, channel, condition, share_of_gap.
/// next_experiment : str or None
/// plan : list of dict
///     Experiments that would tell confusable effects apart, where `plan=True` asked for them: excitation, arguments
///     (for `furuta run --task`), seconds, volts, separates, expected_evidence, if_true.
/// verification : list of dict
///     Errors on the recordings given as `verify`: run, channel, nominal, recalibrated, repaired (rad).
/// notices : list of str
///     What was noticed about the recordings.
/// interrupted : bool
///     Whether Ctrl-C ended the search; then what is said holds for what was looked at.
/// unfinished : list of str
///     What was left undone then, or when the time limit was reached: "parameters", "search", "rivals", "expression",
///     "long_horizons", "held_out", "limits".
/// seconds : float
/// repaired_rig : Rig
///     The rig with refitted parameters, the named effects and the expression.
#[pyclass(name = "Diagnosis", module = "furuta", frozen)]
pub(crate) struct PyDiagnosis {
    outcome: Outcome,
    contract: Py<PyDict>,
}

#[pymethods]
impl PyDiagnosis {
    /// The JSON contract as text.
    fn to_json(&self) -> String {
        self.outcome.diagnosis.to_json()
    }

    /// The JSON contract as a new dict.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        parsed(py, &self.to_json())
    }

    /// The diagnosis in plain text: what is missing, how large, how sure, where it shows, what to measure next.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, furuta
    /// >>> rig = furuta.Rig.load("qube-servo-2")
    /// >>> real = rig.with_effect("arm.spring", stiffness=2e-3, rest=0.2)
    /// >>> t = 0.002 * np.arange(2001)
    /// >>> u = 1.5 * np.sin(3 * t * (1 + t))
    /// >>> x = furuta.simulate(real, [0, np.pi, 0, 0], u[:-1], 0.002)
    /// >>> theta, alpha = furuta.measure(real, x).T
    /// >>> found = furuta.diagnose({"t": t, "u": u, "theta": theta, "alpha": alpha}, rig)
    /// >>> print(found.summary().splitlines()[0])  # doctest: +ELLIPSIS
    /// Missing from the model: spring (cable) on the arm; with it added, ... falls from ... rad.
    fn summary(&self) -> String {
        furuta_ident::report::text(&self.outcome.diagnosis, "RIG")
    }

    /// Draws the diagnosis with matplotlib: measured against predicted, before and after, where the gap sits, what was
    /// tried.
    ///
    /// Parameters
    /// ----------
    /// run : str, optional
    ///     Name of the recording to show; the one with the largest gap if not given.
    /// seconds : float, optional
    ///     Length of the stretch to show, around the largest error; 4 if not given.
    /// ax : matplotlib.axes.Axes or several, optional
    ///     One: measured against predicted of the angle that is wrong most. Two or three: arm, pendulum, error. A
    ///     figure of everything if not given. `furuta.plot` draws each part alone.
    ///
    /// Returns
    /// -------
    /// matplotlib.figure.Figure
    ///
    /// Raises
    /// ------
    /// ImportError
    ///     Without matplotlib: `pip install matplotlib`.
    #[pyo3(signature = (*, run=None, seconds=4.0, ax=None))]
    fn plot<'py>(
        slf: Bound<'py, Self>,
        run: Option<&str>,
        seconds: f64,
        ax: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = slf.py();
        py.import("furuta.plot._diagnosis")?
            .call_method1("plot", (slf, run, seconds, ax))
    }

    /// What `plot` and the report draw: runs (name, t, u, measured, nominal, recalibrated, augmented, restarts; angles
    /// as `[theta, alpha]`), bars (where the gap sits), evidence (of all candidates), verification.
    fn curves<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let json = py.detach(|| here(|| self.outcome.curves.to_json()));
        parsed(py, &json)
    }

    /// The diagnosis at a glance, for notebooks.
    fn _repr_html_(&self) -> String {
        furuta_ident::report::card(&self.outcome.diagnosis)
    }

    /// Writes the report, one self-contained HTML page, to this path. A file that is there and no
    /// such page is replaced only with `force`.
    #[pyo3(signature = (path, *, force=false))]
    fn report(&self, py: Python<'_>, path: PathBuf, force: bool) -> PyResult<()> {
        file::write_page(py, &path, force, || {
            furuta_ident::report::html(&self.outcome.diagnosis, &self.outcome.curves)
        })
    }

    /// The rig with refitted parameters and the named effects.
    #[getter]
    fn repaired_rig(&self) -> PyRig {
        PyRig {
            rig: self.outcome.repaired.clone(),
        }
    }

    #[getter]
    fn verdict(&self) -> &'static str {
        self.outcome.diagnosis.verdict.as_str()
    }

    /// An empirical expression for what no effect explains, or None.
    #[getter]
    fn custom<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        match self.outcome.diagnosis.custom {
            Some(_) => self.field(py, "custom"),
            None => Ok(py.None().into_bound(py)),
        }
    }

    #[getter]
    fn effects<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, "effects")
    }

    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, "parameters")
    }

    #[getter]
    fn limits<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, "limits")
    }

    #[getter]
    fn gap<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, "gap")
    }

    #[getter]
    fn held_out<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, "held_out")
    }

    #[getter(r#where)]
    fn location<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, "where")
    }

    #[getter]
    fn missing_torque<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, "missing_torque")
    }

    #[getter]
    fn next_experiment(&self) -> Option<&str> {
        self.outcome.diagnosis.next_experiment.as_deref()
    }

    #[getter]
    fn plan<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, "plan")
    }

    /// Effects that fit the recordings better and predict data kept apart worse.
    #[getter]
    fn suspected<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, "suspected")
    }

    /// The zeros of the recordings' encoders against those of the first.
    #[getter]
    fn zeros<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, "zeros")
    }

    /// The same effects in recordings of another state of the rig, where `compare` gave such: there, verdict, named,
    /// and differences (id, parameter, here, there, deviations, differs); else None.
    #[getter]
    fn comparison<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        match self.outcome.diagnosis.comparison {
            Some(_) => self.field(py, "comparison"),
            None => Ok(py.None().into_bound(py)),
        }
    }

    /// How far the samples scatter about their time stamps, where it shows: spread and std (s), deviations; else None.
    #[getter]
    fn jitter<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        match self.outcome.diagnosis.jitter {
            Some(_) => self.field(py, "jitter"),
            None => Ok(py.None().into_bound(py)),
        }
    }

    /// Which of the three models predicts data kept apart best, and is `repaired_rig`: given, refitted, repaired.
    #[getter]
    fn best<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, "best")
    }

    #[getter]
    fn verification<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, "verification")
    }

    #[getter]
    fn notices(&self) -> Vec<String> {
        self.outcome.diagnosis.notices.clone()
    }

    /// Whether Ctrl-C ended the search before it was done.
    #[getter]
    fn interrupted(&self) -> bool {
        self.outcome.diagnosis.interrupted
    }

    /// What was left undone then.
    #[getter]
    fn unfinished<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, "unfinished")
    }

    #[getter]
    fn seconds(&self) -> f64 {
        self.outcome.diagnosis.seconds
    }

    fn __repr__(&self) -> String {
        let d = &self.outcome.diagnosis;
        let ids: Vec<_> = d.effects.iter().map(|e| e.id.as_str()).collect();
        let named = if ids.is_empty() {
            String::new()
        } else {
            format!(": {}", ids.join(", "))
        };
        format!("<furuta.Diagnosis {}{named}>", d.verdict)
    }

    fn __str__(&self) -> String {
        self.summary()
    }

    /// Pickles as its JSON, its curves and the repaired rig.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Reduced<'py, (String, String, PyRig)>> {
        let outcome = &slf.get().outcome;
        let rig = slf.get().repaired_rig();
        let parts = (outcome.diagnosis.to_json(), outcome.curves.to_json(), rig);
        Ok((slf.get_type().getattr("_from_parts")?, parts))
    }

    /// The inverse of pickling.
    #[classmethod]
    fn _from_parts(
        _class: &Bound<'_, PyType>,
        py: Python<'_>,
        json: &str,
        curves: &str,
        rig: PyRef<'_, PyRig>,
    ) -> PyResult<Self> {
        let unreadable = |e| unreadable("Diagnosis", e);
        let diagnosis = Diagnosis::from_json(json).map_err(unreadable)?;
        let curves = Curves::from_json(curves).map_err(unreadable)?;
        Ok(Self {
            outcome: Outcome::kept(diagnosis, curves, rig.rig.clone()),
            contract: parsed(py, json)?.unbind(),
        })
    }
}

kept!(PyDiagnosis);

impl Kept for PyDiagnosis {
    fn content(&self) -> String {
        let mut diagnosis = self.outcome.diagnosis.clone();
        diagnosis.seconds = 0.0;
        let curves = self.outcome.curves.to_json();
        diagnosis.to_json() + &curves + &self.outcome.repaired.to_toml()
    }
}

impl PyDiagnosis {
    /// A field of the contract; those the JSON leaves out because there is nothing in them are empty lists.
    fn field<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        match self.contract.bind(py).get_item(name)? {
            Some(value) => Ok(value),
            None if [
                "verification",
                "unfinished",
                "plan",
                "missing_torque",
                "suspected",
                "zeros",
            ]
            .contains(&name) =>
            {
                Ok(pyo3::types::PyList::empty(py).into_any())
            }
            None => Err(PyKeyError::new_err(name.to_owned())),
        }
    }
}

/// A time limit from Python, s.
fn seconds(limit: f64) -> PyResult<Duration> {
    Duration::try_from_secs_f64(limit)
        .ok()
        .filter(|t| !t.is_zero())
        .ok_or_else(|| {
            PyValueError::new_err(format!(
                "time_limit is {limit}: give seconds above 0, or None for no limit"
            ))
        })
}

fn parsed<'py>(py: Python<'py>, json: &str) -> PyResult<Bound<'py, PyDict>> {
    Ok(py
        .import("json")?
        .call_method1("loads", (json,))?
        .cast_into::<PyDict>()?)
}

/// Names what the model of a rig is missing, from recordings of it.
///
/// Parameters
/// ----------
/// recordings : path, dict, list of these, or dict of these by name
///     CSV files or MCAP logs by their paths, or dicts of arrays of equal length: t (s), u (V, held until the next
///     row), theta and alpha (rad, alpha from upright). An array that is not evenly sampled or holds NaN is refused or
///     mended as a file is.
/// rig : Rig
///     As its data sheet describes it.
/// verify : path, dict, or list of these, optional
///     Recordings that the search does not see; the finished models predict them whole.
/// compare : path, dict, or list of these, optional
///     Recordings of the same rig in another state (the cable taken off, say): they are diagnosed as well, and
///     `comparison` says for each effect named in either state whether it differs.
/// plan : bool, optional
///     Where the data cannot tell effects apart, look for the experiment that would: takes some seconds more.
/// same_zero : bool, optional
///     All recordings count their angles from the same zeros: no encoder was switched off between them.
/// time_limit : float or None, optional
///     After this many seconds the search ends with what was found by then; `unfinished` says what was left undone, and
///     what was not judged on data kept apart and does not explain the data is then suspected, not named. None: no
///     limit.
/// thorough : bool, optional
///     Follow every candidate from every start to the end, however little it promises: several times as slow, and to
///     the same names where what saves time is sound.
/// candidates : list of str, Hypothesis or path, optional
///     Effects to be looked for from the outset beside those that always are: ids of the catalogue
///     (`catalogue()[id]["offered"]`), laws of your own, or files with some (`.toml`).
/// pendulum : {"swings", "removed", "locked", "alone"}, optional
///     What the pendulum did in the recordings: it swings as it is built, was taken off, was locked hanging, or swings
///     alone, the arm held. Off or locked, the arm alone is diagnosed, whatever alpha says; with the arm held the
///     pendulum alone, whatever theta and u say. No experiment is planned then.
/// every : int, optional
///     Use every `every`-th sample of each recording. The command of a sample becomes the mean of those until the
///     next one used: right where `every` sample periods are short against the motion.
/// span : tuple of two floats, optional
///     Use this span of each recording, s from its first sample.
/// accept_suspicious : bool, optional
///     Diagnose recordings even if they look as if a convention were broken (degrees, alpha from hanging, a flipped
///     sign, another rig).
/// progress : callable, optional
///     Called with the stage, the candidate just tried (str or None) and how much is done (per cent, an estimate), in
///     the calling thread.
///
/// Returns
/// -------
/// Diagnosis
///
/// Raises
/// ------
/// RecordingError
///     A recording that cannot be used, or looks as if a convention were broken: which, where, why, what to do.
/// DiagnoseError
///     Recordings too short, or in which nothing moves.
/// Interrupted
///     On Ctrl-C (it is a KeyboardInterrupt), a second or two later: the exception's attribute `diagnosis` holds what
///     was found by then, its `interrupted` True. A second Ctrl-C is raised at once. In a notebook,
///     `sys.last_value.diagnosis` after the cell.
///
/// Examples
/// --------
/// >>> import numpy as np, furuta
/// >>> rig = furuta.Rig.load("qube-servo-2")
/// >>> real = rig.with_effect("arm.spring", stiffness=2e-3, rest=0.2)  # unknown to the diagnosis
/// >>> t = 0.002 * np.arange(2001)
/// >>> u = 1.5 * np.sin(3 * t * (1 + t))
/// >>> x = furuta.simulate(real, [0, np.pi, 0, 0], u[:-1], 0.002)
/// >>> theta, alpha = furuta.measure(real, x).T
/// >>> found = furuta.diagnose({"t": t, "u": u, "theta": theta, "alpha": alpha}, rig)
/// >>> found.verdict, [e["id"] for e in found.effects]
/// ('missing_effects', ['arm.spring'])
#[pyfunction]
#[pyo3(
    signature = (
        recordings, rig, *, verify=None, compare=None, plan=false, same_zero=false, time_limit=60.0, thorough=false,
        candidates=None, pendulum="swings", every=1, span=None, accept_suspicious=false, progress=None
    ),
    text_signature = "(recordings, rig, *, verify=None, compare=None, plan=False, same_zero=False, \
        time_limit=60.0, thorough=False, candidates=None, pendulum='swings', every=1, span=None, \
        accept_suspicious=False, progress=None)"
)]
#[allow(clippy::too_many_arguments)] // keywords in Python
pub(crate) fn diagnose(
    py: Python<'_>,
    recordings: &Bound<'_, PyAny>,
    rig: RigLike,
    verify: Option<&Bound<'_, PyAny>>,
    compare: Option<&Bound<'_, PyAny>>,
    plan: bool,
    same_zero: bool,
    time_limit: Option<f64>,
    thorough: bool,
    candidates: Option<Vec<Bound<'_, PyAny>>>,
    pendulum: &str,
    every: usize,
    span: Option<(f64, f64)>,
    accept_suspicious: bool,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<PyDiagnosis> {
    let selection = selection(every, span);
    let time_limit = time_limit.map(seconds).transpose()?;
    let pendulum = state(pendulum)?;
    if plan && !pendulum.is_whole() {
        return Err(PyValueError::new_err(
            "plan: an experiment is planned for a rig whose pendulum swings",
        ));
    }
    let candidates = crate::hypothesis::candidates(&candidates.unwrap_or_default())?;
    let rig = rig.rig.clone();
    let Chosen {
        recordings,
        verify,
        notices,
    } = choose(
        (recordings, verify),
        (&rig, pendulum),
        &selection,
        accept_suspicious,
    )?;
    let there = compare
        .map(|given| {
            choose(
                (given, None),
                (&rig, pendulum),
                &selection,
                accept_suspicious,
            )
        })
        .transpose()?;
    let (there, said) = there.map(|c| (c.recordings, c.notices)).unzip();
    let (send, receive) = channel::<Progress>();
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    // Where its answer is not awaited any more, the worker ends by itself: it owns all it needs.
    let worker = std::thread::spawn(move || -> Result<Outcome, Insufficient> {
        let request = Request {
            recordings: &recordings,
            rig: &rig,
            verify: &verify,
        };
        let options = Options {
            stop: Some(&flag),
            plan,
            same_zero,
            time_limit,
            thorough,
            candidates: &candidates,
            pendulum,
            compare: there.as_deref().unwrap_or_default(),
        };
        let report = |p| drop(send.send(p));
        here(|| diagnose_with(&request, options, &report))
    });
    // The receiver sits in a Mutex only because a reference to it crosses `detach`.
    let receive = std::sync::Mutex::new(receive);
    let mut interrupt: Option<PyErr> = None;
    loop {
        let news = py.detach(|| match receive.lock() {
            Ok(receive) => receive.recv_timeout(PATIENCE),
            Err(_) => Err(RecvTimeoutError::Disconnected),
        });
        if let Err(raised) = py.check_signals() {
            stop.store(true, Ordering::Relaxed);
            // The first Ctrl-C waits for what is known so far, a second one for nothing; nor does an error of a signal
            // handler.
            if interrupt.is_some() || !raised.is_instance_of::<PyKeyboardInterrupt>(py) {
                return Err(raised);
            }
            interrupt = Some(raised);
        }
        match news {
            Ok(p) => {
                if let Some(call) = progress.filter(|_| interrupt.is_none()) {
                    call.call1((p.stage, p.candidate, p.percent))
                        .inspect_err(|_| stop.store(true, Ordering::Relaxed))?;
                }
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
    }
    let outcome = py.detach(|| worker.join()).map_err(|_| {
        PyRuntimeError::new_err(
            "the diagnosis broke off: this is a mistake of the program, please report it",
        )
    })?;
    let mut outcome = match (outcome, &interrupt) {
        (Ok(outcome), _) => outcome,
        (Err(_), Some(raised)) => return Err(raised.clone_ref(py)),
        (Err(e), None) => return Err(error::diagnose(e)),
    };
    let notices = notices.into_iter().chain(said.unwrap_or_default());
    outcome.diagnosis.notices.splice(0..0, notices);
    let contract = parsed(py, &outcome.diagnosis.to_json())?.unbind();
    let diagnosis = PyDiagnosis { outcome, contract };
    match interrupt {
        None => Ok(diagnosis),
        Some(_) => {
            let raised = error::Interrupted::new_err(diagnosis.outcome.diagnosis.sentence());
            raised
                .value(py)
                .setattr("diagnosis", Py::new(py, diagnosis)?)?;
            Err(raised)
        }
    }
}
