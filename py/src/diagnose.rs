//! The diagnosis: run in a thread of its own, so that Ctrl-C and progress work while Rust is at it.

use crate::arguments::RigLike;
use crate::diagnosis::PyDiagnosis;
use crate::error;
use crate::forked::here;
use crate::recording::{Chosen, choose, selection, state};
use furuta_ident::Insufficient;
use furuta_ident::diagnose::{Options, Outcome, Progress, Request, diagnose_with};
use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// How often Ctrl-C is looked for.
const PATIENCE: Duration = Duration::from_millis(50);

/// A time limit from Python, s.
fn seconds(limit: f64) -> PyResult<Duration> {
    Duration::try_from_secs_f64(limit)
        .ok()
        .filter(|t| !t.is_zero())
        .ok_or_else(|| {
            PyValueError::new_err(format!(
                "time_limit is {limit}: give a finite number of seconds above 0, or None for no limit"
            ))
        })
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
///     what was not judged on data kept apart and does not explain the data is then suspected, not named. Of more than
///     1,000 samples for each second of it (60,000 for less than a minute) only stretches are looked at, and `notices`
///     says so. None: no limit.
/// thorough : bool, optional
///     Follow every candidate from every start to the end, however little it promises: several times as slow, and to
///     the same names where what saves time is sound.
/// candidates : str, Hypothesis or path, or a list of them, optional
///     Effects to be looked for from the outset beside those that always are: ids of the catalogue
///     (`catalogue()[id]["offered"]`), laws of your own, or files with some (`.toml`).
/// pendulum : {"swings", "removed", "locked", "alone", "driven"}, optional
///     What the pendulum did in the recordings: it swings as it is built, was taken off, was locked hanging, swings
///     alone, the arm held, or is driven by an arm that moves as theta says. Off or locked, the arm alone is
///     diagnosed, whatever alpha says; with the arm held the pendulum alone, whatever theta and u say; driven the
///     pendulum alone, whatever u says. No experiment is planned then.
/// every : int, optional
///     Use every `every`-th sample of each recording. The command of a sample becomes the mean of those until the
///     next one used: right where `every` sample periods are short against the motion.
/// span : tuple of two floats, optional
///     Use this span of each recording, s from its first sample.
/// command : {"held", "smooth"}, optional
///     What the command does between two rows: smooth where the recording keeps every N-th row of a faster controller.
///     Where it jumps then, predictions stop and start anew.
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
        candidates=None, pendulum="swings", every=1, span=None, command="held", accept_suspicious=false, progress=None
    ),
    text_signature = "(recordings, rig, *, verify=None, compare=None, plan=False, same_zero=False, \
        time_limit=60.0, thorough=False, candidates=None, pendulum='swings', every=1, span=None, command='held', \
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
    candidates: Option<Bound<'_, PyAny>>,
    pendulum: &str,
    every: usize,
    span: Option<(f64, f64)>,
    command: &str,
    accept_suspicious: bool,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<PyDiagnosis> {
    let selection = selection(every, span, command)?;
    let time_limit = time_limit.map(seconds).transpose()?;
    let pendulum = state(pendulum)?;
    if plan && !pendulum.is_whole() {
        return Err(PyValueError::new_err(
            "plan: an experiment is planned for a rig whose pendulum swings",
        ));
    }
    let candidates = crate::hypothesis::candidates(candidates.as_ref())?;
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
    let diagnosis = PyDiagnosis::of(py, outcome)?;
    match interrupt {
        None => Ok(diagnosis),
        Some(_) => {
            let raised = error::Interrupted::new_err(diagnosis.sentence());
            raised
                .value(py)
                .setattr("diagnosis", Py::new(py, diagnosis)?)?;
            Err(raised)
        }
    }
}
