//! Thousands of trajectories at once: in a thread of their own, so that Ctrl-C and progress work while Rust is at it.

use crate::arguments::RigLike;
use crate::catalogue::{Value, known, place};
use crate::error;
use crate::forked::here;
use crate::matrix::{Matrix, Vector, state, states, vector};
use crate::rig::parameter;
use furuta_model::simulate::{
    FEW, Feedback, Keep, OpenLoop, Policy, Rollout, Run, SimulationError,
};
use furuta_model::{Effect, Params, Spec, State};
use numpy::{IntoPyArray, PyArrayDyn, PyArrayMethods};
use pyo3::exceptions::{PyMemoryError, PyRuntimeError};
use pyo3::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// How often Ctrl-C is looked for.
const PATIENCE: Duration = Duration::from_millis(50);

/// Samples of all rollouts between two looks at whether to go on: a fraction of a second of work.
pub(crate) const STRIDE: usize = 4_000_000;

/// Rollouts side by side that keep one core busy.
const SIDE_BY_SIDE: usize = 16;

/// Simulates many rollouts of a rig at once, on all cores and in the lanes of their vectors.
///
/// Each rollout has the very bits that `simulate` gives it (one Runge-Kutta step per sample, run 0).
///
/// Parameters
/// ----------
/// rig : Rig
/// x0 : array_like, shape (M, 4)
///     Initial states, one a rollout.
/// u : array_like, shape (N,), or None
///     Motor command in V, the same for every rollout; None where there is `feedback`.
/// dt : float
///     Sample period in s, at most 1.
/// parameters : dict, optional
///     Parameters of the rig that differ between rollouts: a number or an array of shape (M,) by the key in the rig
///     file, for example {"pendulum.mass": masses}.
/// effects : dict, optional
///     Effects that differ between rollouts, or come on top of the rig's: by id a dict of numbers, words or arrays of
///     shape (M,) by parameter, for example {"arm.coulomb": {"torque": torques}}. Parameters not given have the rig's
///     value or their default; of an effect that the rig has not, all others are given.
/// feedback : (gain, reference, limit), optional
///     In place of u: u = -gain (x - reference) from the true state, within +-limit (V). gain and reference have shape
///     (4,); angles are not wrapped.
/// samples : int, optional
///     N, where there is `feedback`.
/// every : int, optional
///     Keep x0 and every n-th sample after it; the last state alone if not given.
/// progress : callable, optional
///     Called with how many rollouts are done and how many there are, in the calling thread.
///
/// Returns
/// -------
/// numpy.ndarray, shape (M, 4), or (M, N // every + 1, 4) with `every`
///     True states. Those of a rollout that leaves all numbers are not finite from then on.
///
/// Raises
/// ------
/// SimulationError
///     Shapes that do not fit, numbers that are not finite, a rollout whose parameters cannot be (it is named); before
///     anything is run.
/// RigError
///     A parameter or an effect that does not exist.
///
/// Notes
/// -----
/// Ctrl-C, and an exception from `progress`, end the call at once; the rollouts that are under way on other threads run
/// to their end unseen, no others begin.
///
/// Examples
/// --------
/// >>> import numpy as np, furuta
/// >>> rig = furuta.Rig.load("qube-servo-2")
/// >>> masses = np.linspace(0.02, 0.03, 100)
/// >>> x0 = np.tile([0, np.pi, 0, 0], (100, 1))
/// >>> x = furuta.simulate_batch(rig, x0, np.full(500, 0.5), 0.002, parameters={"pendulum.mass": masses})
/// >>> x.shape
/// (100, 4)
/// >>> bool(np.all(np.diff(x[:, 0]) < 0))  # the heavier the pendulum, the slower the arm
/// True
#[pyfunction]
#[pyo3(
    signature = (rig, x0, u, dt, *, parameters=None, effects=None, feedback=None, samples=None, every=None,
        progress=None),
    text_signature = "(rig, x0, u, dt, *, parameters=None, effects=None, feedback=None, samples=None, \
        every=None, progress=None)"
)]
#[allow(clippy::too_many_arguments)] // keywords in Python
pub(crate) fn simulate_batch<'py>(
    py: Python<'py>,
    rig: RigLike,
    x0: Matrix<'py>,
    u: Option<Vector<'py>>,
    dt: f64,
    parameters: Option<BTreeMap<String, Varied<'py>>>,
    effects: Option<BTreeMap<String, BTreeMap<String, Varied<'py>>>>,
    feedback: Option<(Vector<'py>, Vector<'py>, f64)>,
    samples: Option<usize>,
    every: Option<usize>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let source = Source::new(u, feedback, samples)?;
    let rollouts = rollouts(
        &rig,
        &x0,
        &parameters.unwrap_or_default(),
        &effects.unwrap_or_default(),
    )?;
    let run = Run {
        period: dt,
        samples: source.samples(),
        keep: every.map_or(Keep::Last, Keep::Every),
    };
    let count = rollouts.len();
    let rows = match every {
        Some(0) => return Err(error::simulation(SimulationError::KeepNothing)),
        Some(n) => run.samples / n + 1,
        None => 1,
    };
    let mut buffer: Vec<f64> = Vec::new();
    let fits = rows.checked_mul(4).and_then(|r| r.checked_mul(count));
    if fits.is_none_or(|n| buffer.try_reserve_exact(n).is_err()) {
        return Err(PyMemoryError::new_err(format!(
            "{count} rollouts with {rows} states each do not fit into memory: keep fewer (every)"
        )));
    }

    if run.samples.saturating_mul(count) < FEW {
        let never = AtomicBool::new(false);
        let states = py.detach(|| here(|| source.drive(&rollouts, run, buffer, &never, &|_| ())));
        if let Some(call) = progress {
            call.call1((count, count))?;
        }
        return shaped(
            py,
            states.map_err(error::simulation)?,
            count,
            every.map(|_| rows),
        );
    }
    let (send, receive) = channel::<usize>();
    let stop = Arc::new(AtomicBool::new(false));
    let stopped = Arc::clone(&stop);
    // Where the call ends early, the worker is left to stop by itself: it owns all it needs, and its answer is not
    // awaited.
    let worker = std::thread::spawn(move || {
        // There is no reader any more where the call has ended early.
        let tell = |done| {
            let _ = send.send(done);
        };
        here(|| source.drive(&rollouts, run, buffer, &stopped, &tell))
    });
    // The receiver sits in a Mutex only because a reference to it crosses `detach`.
    let receive = std::sync::Mutex::new(receive);
    let watch = || -> PyResult<()> {
        let mut done = 0;
        loop {
            // The threads that finish their rollouts are not heard in the order in which they counted them.
            let news = py.detach(|| match receive.lock() {
                Ok(receive) => receive
                    .recv_timeout(PATIENCE)
                    .map(|n| receive.try_iter().fold(n.max(done), usize::max)),
                Err(_) => Err(RecvTimeoutError::Disconnected),
            });
            py.check_signals()?;
            match news {
                Ok(n) => {
                    done = n;
                    if let Some(call) = progress {
                        call.call1((done, count))?;
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok(()),
            }
        }
    };
    watch().inspect_err(|_| stop.store(true, Ordering::Relaxed))?;
    let states = py
        .detach(|| worker.join())
        .map_err(|_| {
            PyRuntimeError::new_err(
                "the batch broke off: this is a mistake of the program, please report it",
            )
        })?
        .map_err(error::simulation)?;
    shaped(py, states, count, every.map(|_| rows))
}

/// The states as an array of `count` rollouts, of this number of rows each where these are asked for.
fn shaped(
    py: Python<'_>,
    states: Vec<f64>,
    count: usize,
    rows: Option<usize>,
) -> PyResult<Bound<'_, PyArrayDyn<f64>>> {
    let states = states.into_pyarray(py);
    Ok(match rows {
        Some(rows) => states.reshape([count, rows, 4])?.to_dyn().clone(),
        None => states.reshape([count, 4])?.to_dyn().clone(),
    })
}

/// Runs the rollouts part by part, so that it can stop in between: their kept states, one after the other. What `stop`
/// leaves out is missing.
fn in_parts(
    rollouts: &[Rollout],
    policy: &impl Policy,
    run: Run,
    mut states: Vec<f64>,
    stop: &AtomicBool,
    tell: &(impl Fn(usize) + Sync),
) -> Result<Vec<f64>, SimulationError> {
    use furuta_model::simulate::batch;
    // A run of no samples finds every rollout that cannot be, before time is spent on the others.
    let checked = Run {
        samples: 0,
        keep: Keep::Last,
        ..run
    };
    batch(rollouts, policy, checked, &|_| ())?;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let part = (STRIDE / run.samples.max(1)).max(SIDE_BY_SIDE * cores);
    let mut done = 0;
    for rollouts in rollouts.chunks(part) {
        if stop.load(Ordering::Relaxed) {
            break;
        }
        let some = batch(rollouts, policy, run, &|n| tell(done + n))?;
        states.extend(some.states().iter().flat_map(|x| x.to_array()));
        done += rollouts.len();
    }
    Ok(states)
}

/// Where the commands come from.
enum Source {
    /// The same for all.
    Commands(Vec<f64>),
    /// From each rollout's state.
    Feedback { law: Feedback, samples: usize },
}

impl Source {
    /// Runs the rollouts under it: [`in_parts`].
    fn drive(
        &self,
        rollouts: &[Rollout],
        run: Run,
        states: Vec<f64>,
        stop: &AtomicBool,
        tell: &(impl Fn(usize) + Sync),
    ) -> Result<Vec<f64>, SimulationError> {
        match self {
            Self::Commands(u) => in_parts(rollouts, &OpenLoop(u), run, states, stop, tell),
            Self::Feedback { law, .. } => in_parts(rollouts, law, run, states, stop, tell),
        }
    }

    fn new(
        u: Option<Vector<'_>>,
        feedback: Option<(Vector<'_>, Vector<'_>, f64)>,
        samples: Option<usize>,
    ) -> PyResult<Self> {
        match (u, feedback, samples) {
            (Some(u), None, None) => {
                let u: Vec<f64> = vector("u", &u, error::said)?;
                match u.iter().position(|v| !v.is_finite()) {
                    None => Ok(Self::Commands(u)),
                    Some(k) => Err(error::simulation(format!(
                        "u[{k}] = {} is not a finite number",
                        u[k]
                    ))),
                }
            }
            (None, Some((gain, reference, limit)), Some(samples)) => {
                if limit.is_nan() || limit < 0.0 {
                    return Err(error::simulation(format!(
                        "feedback: limit = {limit} V must be 0 or more"
                    )));
                }
                let law = Feedback {
                    gain: state("feedback: gain", &gain)?.to_array(),
                    reference: state("feedback: reference", &reference)?,
                    limit,
                };
                Ok(Self::Feedback { law, samples })
            }
            (None, Some(_), None) => Err(error::simulation(
                "feedback tells no number of samples: give samples=N",
            )),
            (None, None, _) => Err(error::simulation(
                "no commands: give u, or feedback=(gain, reference, limit) and samples=N",
            )),
            (Some(_), Some(_), _) => Err(error::simulation(
                "u and feedback exclude each other: give u=None with feedback",
            )),
            (Some(_), None, Some(_)) => Err(error::simulation(
                "samples belongs to feedback: u has its own length",
            )),
        }
    }

    fn samples(&self) -> usize {
        match self {
            Self::Commands(u) => u.len(),
            Self::Feedback { samples, .. } => *samples,
        }
    }
}

/// One value for all rollouts, or one for each.
#[derive(FromPyObject)]
pub(crate) enum Varied<'py> {
    Same(Value),
    Each(Vector<'py>),
}

impl Varied<'_> {
    /// The values of `count` rollouts; `same` turns the one for all into a number.
    fn values(
        &self,
        name: &str,
        count: usize,
        same: impl FnOnce(&Value) -> PyResult<f64>,
    ) -> PyResult<Vec<f64>> {
        match self {
            Self::Same(value) => Ok(vec![same(value)?; count]),
            Self::Each(values) => {
                let values: Vec<f64> = vector(name, values, error::said)?;
                if values.len() == count {
                    return Ok(values);
                }
                Err(error::simulation(format!(
                    "{name} has {} values for {count} rollouts: give one number, or one for each",
                    values.len()
                )))
            }
        }
    }
}

fn rollouts(
    rig: &RigLike,
    x0: &Matrix<'_>,
    parameters: &BTreeMap<String, Varied<'_>>,
    effects: &BTreeMap<String, BTreeMap<String, Varied<'_>>>,
) -> PyResult<Vec<Rollout>> {
    let rig = &rig.rig;
    let x0 = states("x0", x0)?;
    let count = x0.len();
    let mut params = vec![rig.params.to_array(); count];
    for (key, given) in parameters {
        let place = parameter(key)?;
        let number = |value: &Value| match value {
            Value::Number(value) => Ok(*value),
            Value::Word(word) => Err(error::rig(format!(
                "{key} = \"{word}\" must be a number, or one for each rollout"
            ))),
        };
        for (params, value) in params.iter_mut().zip(given.values(key, count, number)?) {
            params[place] = value;
        }
    }
    let mut all: Vec<(&Spec, Vec<Vec<f64>>)> = rig
        .effects
        .iter()
        .map(|e| (e.spec(), vec![e.values().to_vec(); count]))
        .collect();
    for (id, given) in effects {
        let spec = known(id)?;
        let at = match all.iter().position(|(s, _)| s.id == id) {
            Some(at) => at,
            None => {
                for name in given.keys() {
                    place(spec, name)?;
                }
                // What is given is filled in below.
                let values = spec.values(|name| given.contains_key(name).then_some(0.0));
                all.push((spec, vec![values.map_err(error::rig)?.to_vec(); count]));
                all.len() - 1
            }
        };
        for (name, given) in given {
            let i = place(spec, name)?;
            let values = given.values(&format!("{id}: {name}"), count, |v| v.number(spec, i))?;
            for (effect, value) in all[at].1.iter_mut().zip(values) {
                effect[i] = value;
            }
        }
    }
    let mut rollouts = Vec::with_capacity(count);
    for (i, (x, params)) in x0.into_iter().zip(params).enumerate() {
        let start = State::new(x[0], x[1], x[2], x[3]);
        if !start.is_finite() {
            return Err(error::simulation(format!(
                "x0[{i}] = {:?} holds a number that is not finite",
                start.to_array()
            )));
        }
        // The batch itself names what is wrong with a value, and with whose.
        let effects = all
            .iter()
            .filter_map(|(spec, values)| Effect::of(spec, &values[i]))
            .collect();
        rollouts.push(Rollout {
            params: Params::from_array(rig.params.motor.actuation, params),
            effects,
            start,
        });
    }
    Ok(rollouts)
}
