//! The class `Simulator`: a rig that is stepped.

use crate::arguments::RigLike;
use crate::error;
use crate::kept::cloned;
use crate::matrix::{Vector, state, vector};
use furuta_model::simulate::follow;
use furuta_model::{Plant, PlantState, Rig, State};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;

/// A rig that is simulated sample by sample and remembers what its effects remember (late commands, lagging voltage,
/// bristles, backlash) and the time, from one step to the next.
///
/// The states are those of `furuta.simulate` with the same commands, bit for bit.
///
/// Parameters
/// ----------
/// rig : Rig
///     Or the name of a built-in rig, or the path of a rig file.
/// x0 : array_like, shape (4,)
///     Initial state [theta, alpha, theta_dot, alpha_dot] in rad and rad/s; alpha = 0 is upright, pi hanging. The rig
///     begins as after a long rest there.
/// dt : float
///     Sample period in s, at most 1.
/// substeps : int, optional
///     Runge-Kutta steps (4th order) per sample.
/// run : int, optional
///     Which run this is, from 0: a kick belongs to one run.
///
/// Raises
/// ------
/// SimulationError
///     As for `furuta.simulate`.
///
/// Examples
/// --------
/// >>> import numpy as np, furuta
/// >>> lagging = furuta.Rig.load("qube-servo-2").with_effect("motor.lag", time_constant=0.02)
/// >>> simulator = furuta.Simulator(lagging, [0, np.pi, 0, 0], dt=0.002)
/// >>> x = [simulator.step(0.5) for _ in range(100)]
/// >>> bool((x[-1] == furuta.simulate(lagging, [0, np.pi, 0, 0], np.full(100, 0.5), 0.002)[-1]).all())
/// True
/// >>> round(simulator.t, 3)
/// 0.2
#[pyclass(name = "Simulator", module = "furuta")]
#[derive(Clone)]
pub(crate) struct PySimulator {
    rig: Rig,
    plant: Plant<f64>,
    state: PlantState<f64>,
    period: f64,
    substeps: usize,
    samples: u64,
}

impl PySimulator {
    /// Moves on under these commands, and shows the plant after each.
    fn advance(&mut self, u: &[f64], mut see: impl FnMut(&PlantState<f64>)) -> PyResult<()> {
        if let Some(k) = u.iter().position(|u| !u.is_finite()) {
            return Err(error::simulation(format!(
                "u[{k}] = {} is not a finite number",
                u[k]
            )));
        }
        #[allow(clippy::cast_precision_loss)] // below 2^53
        let h = self.period / self.substeps as f64;
        let mut state = self.state.clone();
        for u in u {
            for _ in 0..self.substeps {
                self.plant.step(&mut state, *u, h);
            }
            if !state.x.is_finite() {
                return Err(error::simulation(format!(
                    "the state is no longer finite: use a shorter dt or more substeps (dt = {} s, substeps = {})",
                    self.period, self.substeps
                )));
            }
            see(&state);
        }
        self.state = state;
        self.samples += u.len() as u64;
        Ok(())
    }
}

cloned!(PySimulator);

#[pymethods]
impl PySimulator {
    #[new]
    #[pyo3(signature = (rig, x0, dt, *, substeps=1, run=0))]
    fn new(rig: RigLike, x0: Vector<'_>, dt: f64, substeps: usize, run: usize) -> PyResult<Self> {
        let rig = rig.rig;
        let plant = rig.try_plant::<f64>().map_err(error::rig)?;
        let mut start = plant.rest(state("x0", &x0)?);
        start.run = run;
        // Without a command it checks the rest.
        follow(&plant, start.clone(), &[], dt, substeps, |_| true, |_| ())
            .map_err(error::simulation)?;
        Ok(Self {
            rig,
            plant,
            state: start,
            period: dt,
            substeps,
            samples: 0,
        })
    }

    /// One sample: the command u (V) is held for dt.
    ///
    /// Parameters
    /// ----------
    /// u : float
    ///     It is applied as given: the rig's command limit does not clip it.
    ///
    /// Returns
    /// -------
    /// numpy.ndarray, shape (4,)
    ///     The true state after it.
    fn step<'py>(&mut self, py: Python<'py>, u: f64) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.advance(&[u], |_| ())?;
        Ok(self.x(py))
    }

    /// Many samples: one command each.
    ///
    /// Parameters
    /// ----------
    /// u : array_like, shape (N,)
    ///     V.
    ///
    /// Returns
    /// -------
    /// numpy.ndarray, shape (N, 4)
    ///     The true state after each.
    fn steps<'py>(
        &mut self,
        py: Python<'py>,
        u: Vector<'py>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let u: Vec<f64> = vector("u", &u, error::said)?;
        let mut states = Vec::with_capacity(4 * u.len());
        self.advance(&u, |s| states.extend(s.x.to_array()))?;
        states.into_pyarray(py).reshape([u.len(), 4])
    }

    /// The true state [theta, alpha, theta_dot, alpha_dot], rad and rad/s.
    #[getter]
    fn x<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.state.x.to_array())
    }

    /// What the encoders read now, [theta, alpha] in rad, rounded to counts, effects of the sensors included.
    #[getter]
    fn reading<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let angles = self.plant.measure(&self.state);
        PyArray1::from_slice(py, &self.rig.sensors.quantised(angles))
    }

    /// Time since the start, s.
    #[getter]
    #[allow(clippy::cast_precision_loss)] // below 2^53
    fn t(&self) -> f64 {
        self.samples as f64 * self.period
    }

    /// Sample period, s.
    #[getter]
    fn dt(&self) -> f64 {
        self.period
    }

    /// Begins anew, as after a long rest at x0 (where it stands now if not given), at t = 0.
    #[pyo3(signature = (x0=None))]
    fn reset(&mut self, x0: Option<Vector<'_>>) -> PyResult<()> {
        let x: State<f64> = match x0 {
            Some(x0) => state("x0", &x0)?,
            None => self.state.x,
        };
        let run = self.state.run;
        self.state = self.plant.rest(x);
        self.state.run = run;
        self.samples = 0;
        Ok(())
    }

    /// Another one in the same state: what is done to one does not show in the other.
    fn copy(&self) -> Self {
        self.clone()
    }

    fn __repr__(&self) -> String {
        let [theta, alpha, _, _] = self.state.x.to_array();
        format!(
            "<furuta.Simulator of {:?} at t = {:.6} s: theta = {theta:.4} rad, alpha = {alpha:.4} rad>",
            self.rig.name,
            self.t()
        )
    }

    /// The state as a table, for notebooks.
    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        crate::card::card(slf.as_any(), "simulator")
    }
}
