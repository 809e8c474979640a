//! The class `Diagnosis`.

use crate::file;
use crate::forked::here;
use crate::kept::{Kept, Reduced, kept, unreadable};
use crate::rig::PyRig;
use furuta_ident::diagnose::{Curves, Diagnosis, Outcome};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};
use std::path::PathBuf;

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
///     Empty where the model that they would stand beside is wrong.
/// parameters : dict
///     Recalibrated parameters by key: nominal, fitted, std, unit, identifiable, at_bound.
/// at_bound : list of dict
///     Numbers of the refitted and the repaired model that no rig has: model ("refitted" or "repaired"), parameter,
///     value, unit, reason. Such a model is not `repaired_rig`.
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
///     The rig with refitted parameters, the named effects and the expression; what `best` says where that is not the
///     model to be used.
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

    /// The zeros of the recordings' encoders: `run`, `theta` and `alpha` (rad), counted from those `against` which they
    /// are told, of the `first_recording` or the `rig_file`.
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

    /// A stretch of one recording in which something else happened (a motor cut off, a hand), where what explains all
    /// else shows one: run, from and to (s of its time stamps), rest (the verdict without it); else None. The verdict
    /// is `unexplained` then, and all else is said of the rest.
    #[getter]
    fn left_out<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        match self.outcome.diagnosis.left_out {
            Some(_) => self.field(py, "left_out"),
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

    /// Numbers of the refitted and the repaired model that no rig has: model, parameter, value, unit, reason.
    #[getter]
    fn at_bound<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, "at_bound")
    }

    /// Which of the three models is `repaired_rig`: the one that predicts data kept apart best, of those whose numbers
    /// can be ("refitted", "repaired"), or "given", also where nothing was judged.
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
    pub(crate) fn of(py: Python<'_>, outcome: Outcome) -> PyResult<Self> {
        let contract = parsed(py, &outcome.diagnosis.to_json())?.unbind();
        Ok(Self { outcome, contract })
    }

    /// What was found, in one sentence.
    pub(crate) fn sentence(&self) -> String {
        self.outcome.diagnosis.sentence()
    }

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
                "at_bound",
            ]
            .contains(&name) =>
            {
                Ok(pyo3::types::PyList::empty(py).into_any())
            }
            None => Err(PyKeyError::new_err(name.to_owned())),
        }
    }
}

fn parsed<'py>(py: Python<'py>, json: &str) -> PyResult<Bound<'py, PyDict>> {
    Ok(py
        .import("json")?
        .call_method1("loads", (json,))?
        .cast_into::<PyDict>()?)
}
