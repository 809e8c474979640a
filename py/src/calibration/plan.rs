//! What to record.

use super::{field, free_and_held, parsed};
use crate::arguments::{Names, RigLike};
use crate::background::awaited;
use crate::error;
use crate::kept::{Kept, Reduced, kept, unreadable};
use furuta_ident::calibrate::{Options, Plan};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};

/// What to record so that the parameters of a rig become known.
///
/// Attributes
/// ----------
/// parameters : list of str
///     Keys of the parameters that are to become known.
/// experiments : list of dict
///     All that the rig bears, the most telling first: excitation, arguments, seconds, volts, arm, log_det, efficiency,
///     std (relative, by parameter).
/// sequence : list of int
///     Which to make one after the other.
/// after : list of list of float
///     Relative standard deviations after each of these.
#[pyclass(name = "ExperimentPlan", module = "furuta", frozen)]
pub(crate) struct PyPlan {
    plan: Plan,
    contract: Py<PyDict>,
}

#[pymethods]
impl PyPlan {
    /// The JSON contract as text.
    fn to_json(&self) -> String {
        self.plan.to_json()
    }

    /// The JSON contract as a new dict.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        parsed(py, &self.to_json())
    }

    /// The plan as a table, with the commands that make the recordings.
    #[pyo3(signature = (rig="RIG"))]
    fn summary(&self, rig: &str) -> String {
        self.plan.summary(rig)
    }

    #[getter]
    fn parameters(&self) -> Vec<String> {
        self.plan.parameters.clone()
    }

    #[getter]
    fn experiments<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        field(self.contract.bind(py), "experiments")
    }

    #[getter]
    fn sequence(&self) -> Vec<usize> {
        self.plan.sequence.clone()
    }

    #[getter]
    fn after(&self) -> Vec<Vec<f64>> {
        self.plan.after.clone()
    }

    fn __repr__(&self) -> String {
        let p = &self.plan;
        format!(
            "<furuta.ExperimentPlan for {}: {} of {} experiments, for {}>",
            p.rig,
            p.sequence.len(),
            p.experiments.len(),
            p.parameters.join(", ")
        )
    }

    fn __str__(&self) -> String {
        self.summary("RIG")
    }

    /// Pickles as its JSON.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Reduced<'py, (String,)>> {
        Ok((
            slf.get_type().getattr("_from_parts")?,
            (slf.get().to_json(),),
        ))
    }

    /// The inverse of pickling.
    #[classmethod]
    fn _from_parts(_class: &Bound<'_, PyType>, py: Python<'_>, json: &str) -> PyResult<Self> {
        Ok(Self {
            plan: serde_json::from_str(json).map_err(|e| unreadable("ExperimentPlan", e))?,
            contract: parsed(py, json)?.unbind(),
        })
    }

    /// The result as a table, for notebooks.
    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        crate::card::card(slf.as_any(), "plan")
    }
}

kept!(PyPlan);

impl Kept for PyPlan {
    fn content(&self) -> String {
        self.to_json()
    }
}

/// Proposes recordings by what they would tell about the parameters of a rig: D-optimal over a family of test signals.
///
/// Parameters
/// ----------
/// rig : Rig
///     Its limits on voltage, arm angle and speeds are kept.
/// free, fix : list of str or str, optional
///     As for `calibrate`.
/// rate : float, optional
///     Samples per second.
/// experiments : int, optional
///     How many to propose, each chosen to add most to those before.
/// horizon : float, optional
///     As for `calibrate`, s.
/// hold : list of str or str, optional
///     Another name for `fix`.
///
/// Returns
/// -------
/// ExperimentPlan
///
/// Examples
/// --------
/// >>> import furuta
/// >>> plan = furuta.plan_experiment(furuta.Rig.load("qube-servo-2"), rate=200.0)
/// >>> len(plan.sequence), plan.experiments[0]["efficiency"]
/// (2, 1.0)
#[pyfunction]
#[pyo3(
    signature = (rig, *, free=None, fix=None, rate=500.0, experiments=2, horizon=2.0, hold=None),
    text_signature = "(rig, *, free=None, fix=None, rate=500.0, experiments=2, horizon=2.0, hold=None)"
)]
#[allow(clippy::too_many_arguments)] // keywords, for Python
pub(crate) fn plan_experiment(
    py: Python<'_>,
    rig: RigLike,
    free: Option<Names>,
    fix: Option<Names>,
    rate: f64,
    experiments: u8,
    horizon: f64,
    hold: Option<Names>,
) -> PyResult<PyPlan> {
    if experiments == 0 {
        return Err(error::calibrate(
            "experiments = 0 is outside the allowed range [1, 255]: ask for one recording or more",
        ));
    }
    let rig = rig.rig.clone();
    let (free, hold) = free_and_held(free, [fix, hold])?;
    let options = Options {
        free,
        hold,
        horizon,
        ..Options::default()
    };
    let plan = awaited(py, move || {
        furuta_ident::calibrate::plan(&rig, &options, rate, experiments.into())
    })?
    .map_err(error::calibrate)?;
    let contract = parsed(py, &plan.to_json())?.unbind();
    Ok(PyPlan { plan, contract })
}
