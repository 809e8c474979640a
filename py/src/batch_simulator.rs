//! The class `BatchSimulator`: many rigs that are stepped together.

use crate::arguments::RigLike;
use crate::batch::STRIDE;
use crate::error;
use crate::forked::here;
use crate::kept::cloned;
use crate::matrix::{Matrix, Vector, state, states, vector};
use crate::rig::PyRig;
use furuta_model::simulate::{Rollout, Stepper};
use furuta_model::{Rig, State};
use numpy::{IntoPyArray, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use pyo3::types::{PyList, PyTuple};

/// Many rigs that are stepped together, each under its own command; they remember what their effects remember, as a
/// `Simulator` does.
///
/// The states are those of single `Simulator`s, bit for bit. Rigs without events within a step (no dry friction, delay,
/// backlash, ...: `furuta.catalogue()`, "follows_state") are the fastest: they stand side by side in the lanes of the
/// processor's vectors.
///
/// One thread at a time: what another asks while a step is on its way raises a RuntimeError.
///
/// Parameters
/// ----------
/// rig : Rig or sequence of Rig
///     One for all, or a list or tuple of one each; also names of built-in rigs and paths of rig files.
/// x0 : array_like, shape (M, 4)
///     Initial states [theta, alpha, theta_dot, alpha_dot] in rad and rad/s; alpha = 0 is upright, pi hanging. Each rig
///     begins as after a long rest there.
/// dt : float
///     Sample period, one step of the integrator, s, at most 1.
///
/// Raises
/// ------
/// SimulationError
///     Shapes that do not fit, numbers that are not finite, a rig that cannot be.
///
/// Examples
/// --------
/// >>> import numpy as np, furuta
/// >>> rigs = furuta.BatchSimulator("qube-servo-2", np.tile([0, np.pi, 0, 0], (3, 1)), dt=0.002)
/// >>> x = rigs.step([-1, 0, 1], 100)
/// >>> x.shape, bool(x[0, 0] < 0 < x[2, 0])
/// ((3, 4), True)
/// >>> rigs.reset(2, [0, 0.1, 0, 0], furuta.Rig.load("qube-servo-2").with_effect("motor.lag", time_constant=0.01))
/// >>> rigs.x[2].tolist()
/// [0.0, 0.1, 0.0, 0.0]
#[pyclass(name = "BatchSimulator", module = "furuta")]
#[derive(Clone)]
pub(crate) struct PyBatchSimulator {
    rigs: Vec<Rig>,
    stepper: Stepper,
    period: f64,
}

/// One rig for all, or one for each.
pub(crate) enum Rigs {
    One(Box<RigLike>),
    Each(Vec<RigLike>),
}

impl<'py> FromPyObject<'_, 'py> for Rigs {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let is_list = given.is_instance_of::<PyList>() || given.is_instance_of::<PyTuple>();
        if is_list {
            given.extract().map(Self::Each)
        } else {
            given.extract().map(|one| Self::One(Box::new(one)))
        }
    }
}

fn rollout(rig: &Rig, x: State<f64>) -> Rollout {
    Rollout {
        params: rig.params,
        effects: rig.effects.clone(),
        start: x,
    }
}

impl PyBatchSimulator {
    fn place(&self, which: usize) -> PyResult<usize> {
        let count = self.rigs.len();
        (which < count).then_some(which).ok_or_else(|| {
            PyIndexError::new_err(format!(
                "there is no rig {which}: there are {count}, from 0"
            ))
        })
    }
}

cloned!(PyBatchSimulator);

#[pymethods]
impl PyBatchSimulator {
    #[new]
    fn new(rig: Rigs, x0: Matrix<'_>, dt: f64) -> PyResult<Self> {
        let starts = states("x0", &x0)?;
        let rigs: Vec<Rig> = match rig {
            Rigs::One(one) => vec![one.rig; starts.len()],
            Rigs::Each(each) => each.into_iter().map(|one| one.rig).collect(),
        };
        if rigs.len() != starts.len() {
            let message = format!("{} rigs, and x0 of {}: one each", rigs.len(), starts.len());
            return Err(error::simulation(message));
        }
        let pairs = rigs.iter().zip(starts);
        let rollouts = pairs.map(|(rig, x)| rollout(rig, State::from(x))).collect();
        Ok(Self {
            stepper: Stepper::new(rollouts, dt).map_err(error::simulation)?,
            rigs,
            period: dt,
        })
    }

    /// The commands are held for `samples` sample periods.
    ///
    /// Parameters
    /// ----------
    /// u : array_like, shape (M,)
    ///     One command a rig, V, applied as given: command limits do not clip it.
    /// samples : int, optional
    ///     How long.
    ///
    /// Returns
    /// -------
    /// numpy.ndarray, shape (M, 4)
    ///     The true states after that. Those of a rig that leaves all numbers are not finite from then on.
    ///
    /// Notes
    /// -----
    /// Ctrl-C ends a long call on its way: the rigs stand where they were then.
    #[pyo3(signature = (u, samples=1))]
    fn step<'py>(
        &mut self,
        py: Python<'py>,
        u: Vector<'py>,
        samples: usize,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let u: Vec<f64> = vector("u", &u, error::said)?;
        let part = (STRIDE / u.len().max(1)).max(1);
        let mut left = samples;
        loop {
            let now = left.min(part);
            py.detach(|| here(|| self.stepper.step(&u, now)))
                .map_err(error::simulation)?;
            left -= now;
            if left == 0 {
                return self.x(py);
            }
            py.check_signals()?;
        }
    }

    /// The true states [theta, alpha, theta_dot, alpha_dot], rad and rad/s, shape (M, 4).
    #[getter]
    fn x<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let states: Vec<f64> = self.stepper.states().flat_map(State::to_array).collect();
        states.into_pyarray(py).reshape([self.rigs.len(), 4])
    }

    /// What the encoders read now, [theta, alpha] in rad, rounded to counts, effects of the sensors included, shape
    /// (M, 2).
    #[getter]
    fn reading<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let angles = self.rigs.iter().zip(self.stepper.angles());
        let readings = angles.flat_map(|(rig, angles)| rig.sensors.quantised(angles));
        let readings: Vec<f64> = readings.collect();
        readings.into_pyarray(py).reshape([self.rigs.len(), 2])
    }

    /// The rigs, in their order.
    #[getter]
    fn rigs(&self) -> Vec<PyRig> {
        let rigs = self.rigs.iter().cloned();
        rigs.map(|rig| PyRig { rig }).collect()
    }

    /// Sample period, s.
    #[getter]
    fn dt(&self) -> f64 {
        self.period
    }

    /// One rig begins anew, as after a long rest; the others go on as they were.
    ///
    /// Parameters
    /// ----------
    /// which : int
    ///     Its place, from 0.
    /// x0 : array_like, shape (4,)
    ///     Where.
    /// rig : Rig, optional
    ///     Another in its place.
    ///
    /// Raises
    /// ------
    /// IndexError
    ///     There is no such place.
    #[pyo3(signature = (which, x0, rig=None))]
    fn reset(&mut self, which: usize, x0: Vector<'_>, rig: Option<RigLike>) -> PyResult<()> {
        let place = self.place(which)?;
        let rig = rig.map_or_else(|| self.rigs[place].clone(), |given| given.rig);
        let x = state("x0", &x0)?;
        self.stepper
            .replace(place, rollout(&rig, x))
            .map_err(error::simulation)?;
        self.rigs[place] = rig;
        Ok(())
    }

    /// Another one in the same state: what is done to one does not show in the other.
    fn copy(&self) -> Self {
        self.clone()
    }

    fn __len__(&self) -> usize {
        self.rigs.len()
    }

    fn __repr__(&self) -> String {
        format!(
            "<furuta.BatchSimulator of {} rigs in steps of {} s>",
            self.rigs.len(),
            self.period
        )
    }
}
