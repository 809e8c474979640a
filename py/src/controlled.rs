//! Trajectories under a controller.

use crate::controller::PyController;
use crate::error;
use crate::matrix::numbers;
use furuta_ctrl::controllers::Controller;
use furuta_ctrl::reference::ArmTable;
use furuta_design::supervised::Supervised;
use furuta_model::{Rig, State};
use numpy::{IntoPyArray, PyArrayMethods};
use pyo3::prelude::*;

/// Samples between two looks at whether to go on: some milliseconds of work.
const STRIDE: usize = 256;

/// What is simulated.
pub(crate) struct SimulationRequest {
    pub(crate) x0: State<f64>,
    /// Added to the command, V.
    pub(crate) added: Vec<f64>,
    /// Where the arm is to be at each sample, rad.
    pub(crate) reference: Vec<f64>,
    /// s.
    pub(crate) period: f64,
    pub(crate) substeps: usize,
    pub(crate) run: usize,
    pub(crate) encoders: bool,
    pub(crate) ideal: bool,
}

/// The arm's reference at each of `n` samples, from one number or as many.
pub(crate) fn targets(reference: Option<&Bound<'_, PyAny>>, n: usize) -> PyResult<Vec<f64>> {
    let given: Vec<f64> = match reference {
        None => return Ok(vec![0.0; n]),
        Some(reference) => numbers::<f64>("reference", reference, error::said)?
            .as_array()
            .iter()
            .copied()
            .collect(),
    };
    if let Some(k) = given.iter().position(|r| !r.is_finite()) {
        return Err(error::simulation(format!(
            "reference[{k}] = {} is not a finite number",
            given[k]
        )));
    }
    match given[..] {
        [one] => Ok(vec![one; n]),
        _ if given.len() == n => Ok(given),
        _ => Err(error::simulation(format!(
            "reference has {} numbers; it must have 1, or {n} as u has",
            given.len()
        ))),
    }
}

/// What a run leaves.
#[derive(Default)]
struct Course {
    states: Vec<f64>,
    readings: Vec<f64>,
    commands: Vec<f64>,
    modes: Vec<&'static str>,
}

/// The rig under a controller: states, commands, modes, and what the encoders read.
pub(crate) fn controlled<'py>(
    py: Python<'py>,
    rig: &Rig,
    controller: &PyController,
    request: &SimulationRequest,
) -> PyResult<Bound<'py, PyAny>> {
    controller.check_period(request.period)?;
    if let Some(k) = request.added.iter().position(|u| !u.is_finite()) {
        let value = request.added[k];
        return Err(error::simulation(format!(
            "u[{k}] = {value} is not a finite number"
        )));
    }
    let substeps = u32::try_from(request.substeps)
        .ok()
        .filter(|n| *n > 0)
        .ok_or_else(|| {
            error::simulation(format!(
                "substeps = {}; at least 1 step of the integrator per sample is needed",
                request.substeps
            ))
        })?;
    let supervisor = &*controller.supervisor;
    let bench = Supervised::new(supervisor, rig, request.period)
        .and_then(|bench| bench.with_substeps(substeps))
        .map_err(error::simulation)?;
    let mut interrupt = None;
    let course = py.detach(|| {
        let mut proceed = |k: usize| {
            if !k.is_multiple_of(STRIDE) {
                return true;
            }
            match Python::attach(|py| py.check_signals()) {
                Ok(()) => true,
                Err(signal) => {
                    interrupt = Some(signal);
                    false
                }
            }
        };
        let mut course = Course::default();
        let mut run = bench.start(request.x0);
        run.plant.run = request.run;
        let mut memory = supervisor.balance.start();
        for (k, (added, target)) in request.added.iter().zip(&request.reference).enumerate() {
            if !proceed(k) {
                break;
            }
            course.see(rig, run.plant.x, bench.angles(&run));
            let (held, mode) = if request.ideal {
                // The whole course is known: a controller may act before the reference moves.
                let reference = ArmTable {
                    now: State::new(*target, 0.0, 0.0, 0.0),
                    next: request.reference.get(k + 1..).unwrap_or_default(),
                };
                let x = run.plant.x;
                let balance = &supervisor.balance;
                let u = balance.update_ahead(&mut memory, &x, &reference, request.period);
                (bench.advance(&mut run, u + added), "balance")
            } else {
                let sample = bench.disturbed(&mut run, *target, *added);
                (sample.held, sample.output.mode.name())
            };
            course.commands.push(held);
            course.modes.push(mode);
        }
        course.see(rig, run.plant.x, bench.angles(&run));
        course
    });
    if let Some(signal) = interrupt {
        return Err(signal);
    }
    course.hand_out(py, request.encoders)
}

impl Course {
    fn see(&mut self, rig: &Rig, x: State<f64>, angles: [f64; 2]) {
        self.states.extend(x.to_array());
        self.readings.extend(rig.sensors.quantised(angles));
    }

    fn hand_out(self, py: Python<'_>, encoders: bool) -> PyResult<Bound<'_, PyAny>> {
        let rows = self.commands.len() + 1;
        let states = self.states.into_pyarray(py).reshape([rows, 4])?;
        let commands = self.commands.into_pyarray(py);
        if !encoders {
            return Ok((states, commands, self.modes).into_pyobject(py)?.into_any());
        }
        let readings = self.readings.into_pyarray(py).reshape([rows, 2])?;
        Ok((states, commands, self.modes, readings)
            .into_pyobject(py)?
            .into_any())
    }
}
