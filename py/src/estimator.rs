//! The class `Estimator`: states from encoder angles.

use crate::arguments::RigLike;
use crate::error;
use crate::matrix::{Vector, vector};
use crate::rig::PyRig;
use furuta_ctrl::Site;
use furuta_ctrl::estimators::{self, AnyEstimator, AnyEstimatorState, Estimator, Measurement};
use furuta_ctrl::settings::Settings;
use furuta_model::Rig;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

/// What an estimate is to Python: states now and when a command given now begins to act, and the voltage beside the
/// command.
type Said<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>, f64);

/// An estimator of the control core: angles in, states out. It has a memory, which `start` clears.
///
/// Parameters
/// ----------
/// kind : str
///     One of `Estimator.KINDS`; `furuta controllers KIND` on the command line tells of each.
/// rig : Rig
///     The model that it predicts with, effects included.
/// dt : float
///     Sample period in s.
/// **settings : float, bool or sequence of float
///     As in the section [estimator] of a controller file.
///
/// Raises
/// ------
/// DesignError
///     No such estimator or setting, a value out of its range, or a rig that has no such estimator.
///
/// Examples
/// --------
/// >>> import numpy as np, furuta
/// >>> rig = furuta.Rig.load("qube-servo-2")
/// >>> u = np.sin(np.arange(1000) * 0.02)
/// >>> x, y = furuta.simulate(rig, [0, np.pi, 0, 0], u, dt=0.002, encoders=True)
/// >>> kalman = furuta.Estimator("kalman", rig, dt=0.002)
/// >>> seen = kalman.filter(y[:-1, 0], y[:-1, 1], u)
/// >>> bool(np.sqrt(np.mean((seen[200:, 2] - x[200:-1, 2]) ** 2)) < 0.05)  # rad/s, from counts of 3 mrad
/// True
#[pyclass(name = "Estimator", module = "furuta")]
pub(crate) struct PyEstimator {
    rig: Rig,
    period: f64,
    /// As they were given.
    settings: Py<PyDict>,
    estimator: AnyEstimator<f64>,
    memory: AnyEstimatorState<f64>,
}

#[pymethods]
impl PyEstimator {
    /// Every kind there is.
    #[classattr]
    #[pyo3(name = "KINDS")]
    fn kinds() -> Vec<&'static str> {
        estimators::CATALOGUE.iter().map(|spec| spec.id).collect()
    }

    #[new]
    #[pyo3(signature = (kind, rig, dt, **settings))]
    fn new(
        py: Python<'_>,
        kind: &str,
        rig: RigLike,
        dt: f64,
        settings: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let given = estimators::settings(kind).ok_or_else(|| {
            let kinds = Self::kinds().join(", ");
            error::design(format!(
                "no estimator is called {kind:?}; there are {kinds}"
            ))
        })?;
        let given = with_settings(given, settings, error::design)?;
        // Written so that a NaN fails.
        if !(dt > 0.0 && dt <= 0.1) {
            return Err(error::design(format!(
                "dt = {dt} s; a sample period must be above 0 and at most 0.1 s"
            )));
        }
        let estimator =
            AnyEstimator::design(&given, &Site::of(&rig.rig, dt)).map_err(error::design)?;
        Ok(Self {
            rig: rig.rig,
            period: dt,
            settings: match settings {
                Some(settings) => settings.copy()?.unbind(),
                None => PyDict::new(py).unbind(),
            },
            memory: estimator.start(),
            estimator,
        })
    }

    /// Its name in a controller file.
    #[getter]
    fn kind(&self) -> &'static str {
        self.estimator.spec().id
    }

    /// Forgets what it has seen.
    fn start(&mut self) {
        self.memory = self.estimator.start();
    }

    /// One sample.
    ///
    /// Parameters
    /// ----------
    /// theta, alpha : float
    ///     Measured angles in rad; alpha = 0 is upright.
    /// held : float
    ///     Command in V that the motor holds from this sample to the next.
    /// periods : int, optional
    ///     Sample periods since the sample before; more than 1 where samples were lost.
    ///
    /// Returns
    /// -------
    /// now : numpy.ndarray, shape (4,)
    ///     The state at the sample.
    /// ahead : numpy.ndarray, shape (4,)
    ///     The state when a command given now begins to act: a period later, and the delay that the rig file names.
    /// disturbance : float
    ///     Voltage in V beside the command, of an estimator that looks for one.
    ///
    /// Raises
    /// ------
    /// DesignError
    ///     An angle or a command that is not finite, or `periods` below 1; the estimator is as before.
    #[pyo3(signature = (theta, alpha, held, periods=1))]
    fn update<'py>(
        &mut self,
        py: Python<'py>,
        theta: f64,
        alpha: f64,
        held: f64,
        periods: u32,
    ) -> PyResult<Said<'py>> {
        for (name, value) in [("theta", theta), ("alpha", alpha), ("held", held)] {
            if !value.is_finite() {
                return Err(error::design(format!(
                    "{name} = {value} is not a finite number: leave the sample out, and give the next one periods=2"
                )));
            }
        }
        if periods == 0 {
            return Err(error::design(
                "periods = 0 is below 1: a sample comes at least one sample period after the one before",
            ));
        }
        let said = self.estimator.update(
            &mut self.memory,
            &Measurement {
                theta,
                alpha,
                held,
                periods,
            },
        );
        let [now, ahead] = [said.now, said.ahead].map(|x| x.to_array().to_vec().into_pyarray(py));
        Ok((now, ahead, said.disturbance))
    }

    /// A whole recording, from a fresh start.
    ///
    /// Parameters
    /// ----------
    /// theta, alpha, u : array_like, shape (N,)
    ///     Measured angles in rad and the command in V held from each sample to the next. A sample that is no number
    ///     has no state, and is forgotten.
    ///
    /// Returns
    /// -------
    /// numpy.ndarray, shape (N, 4)
    ///     The state at each sample, from that and the samples before it.
    #[allow(clippy::needless_pass_by_value)] // as PyO3 extracts them
    fn filter<'py>(
        &self,
        py: Python<'py>,
        theta: Vector<'py>,
        alpha: Vector<'py>,
        u: Vector<'py>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let read = |name, v: &Vector<'_>| vector::<f64>(name, v, error::design);
        let theta = read("theta", &theta)?;
        let (alpha, u) = (read("alpha", &alpha)?, read("u", &u)?);
        let n = theta.len();
        if alpha.len() != n || u.len() != n {
            return Err(error::design(format!(
                "theta has {n} samples, alpha {}, u {}; they must be alike",
                alpha.len(),
                u.len()
            )));
        }
        let rows = py.detach(|| {
            let mut memory = self.estimator.start();
            let mut rows = Vec::with_capacity(4 * n);
            for ((theta, alpha), held) in theta.into_iter().zip(alpha).zip(u) {
                let m = Measurement::new(theta, alpha, held);
                rows.extend(self.estimator.update(&mut memory, &m).now.to_array());
            }
            rows
        });
        rows.into_pyarray(py).reshape([n, 4])
    }

    fn __repr__(&self) -> String {
        format!(
            "<furuta.Estimator {} for {:?} at {} s>",
            self.kind(),
            self.rig.name,
            self.period
        )
    }

    /// Sample period, s.
    #[getter]
    fn dt(&self) -> f64 {
        self.period
    }

    /// Estimators are equal that are of one kind, with equal settings, for equal rigs at one sample period; what they
    /// remember does not count.
    fn __eq__(&self, py: Python<'_>, other: &Bound<'_, PyAny>) -> PyResult<bool> {
        let Ok(other) = other.cast::<Self>() else {
            return Ok(false);
        };
        let other = other.borrow();
        Ok(self.kind() == other.kind()
            && self.rig == other.rig
            && self.period == other.period
            && self.settings.bind(py).eq(&other.settings)?)
    }

    /// A copy remembers what the estimator remembers.
    fn __copy__(&self, py: Python<'_>) -> Self {
        Self {
            settings: self.settings.clone_ref(py),
            rig: self.rig.clone(),
            period: self.period,
            estimator: self.estimator.clone(),
            memory: self.memory.clone(),
        }
    }

    fn __deepcopy__(&self, py: Python<'_>, _memo: &Bound<'_, PyAny>) -> Self {
        self.__copy__(py)
    }

    /// Pickles as what it was made of; what it remembers stays behind.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let py = slf.py();
        let this = slf.borrow();
        let rig = PyRig {
            rig: this.rig.clone(),
        };
        let made_of = (this.kind(), rig, this.period, this.settings.clone_ref(py));
        let restore = py.import("furuta._restore")?.getattr("estimator")?;
        (restore, made_of).into_pyobject(py)
    }

    /// The estimator as a table, for notebooks.
    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        crate::card::card(slf.as_any(), "estimator")
    }
}

/// Settings of a section with keyword arguments: a number, a flag, or as many numbers as the parameter has.
pub(crate) fn with_settings(
    mut settings: Settings,
    given: Option<&Bound<'_, PyDict>>,
    refuse: fn(String) -> PyErr,
) -> PyResult<Settings> {
    for (name, value) in given.into_iter().flatten() {
        let name = name.extract::<String>()?;
        let values = match value.extract::<f64>() {
            Ok(number) => vec![number],
            Err(_) => vector(&name, &value, refuse)?,
        };
        settings = settings
            .with(&name, &values)
            .map_err(|e| refuse(e.to_string()))?;
    }
    Ok(settings)
}
