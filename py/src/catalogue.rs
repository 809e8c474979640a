//! The catalogue of effects, and the values of their parameters.

use crate::error;
use furuta_model::effects::{Kind, ParameterSpec};
use furuta_model::{Spec, effects};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// An effect's value as Python gives and gets it: a number, or a word where there is a choice.
#[derive(FromPyObject, IntoPyObject)]
pub(crate) enum Value {
    Number(f64),
    Word(String),
}

impl Value {
    /// As shown: a word where there is one.
    pub(crate) fn of(p: &ParameterSpec, value: f64) -> Self {
        match p.word(value) {
            Some(word) => Self::Word(word.to_owned()),
            None => Self::Number(value),
        }
    }

    /// As the model counts it, for parameter `i` of the effect.
    pub(crate) fn number(&self, spec: &Spec, i: usize) -> PyResult<f64> {
        let p = &spec.parameters[i];
        match self {
            Self::Number(value) => Ok(*value),
            Self::Word(word) => p.choice(word).ok_or_else(|| {
                let wanted = match p.kind {
                    Kind::Choice(words) => format!("\"{}\"", words.join("\" or \"")),
                    _ => "a number".to_owned(),
                };
                error::rig(format!(
                    "effect `{}`: {} = \"{word}\" must be {wanted}",
                    spec.id, p.name
                ))
            }),
        }
    }
}

/// The catalogue's entry of this id, which is to be looked for beside those that always are.
pub(crate) fn entry(id: &str) -> PyResult<&'static Spec> {
    effects::all().find(|s| s.id == id).ok_or_else(|| {
        let on_request: Vec<_> = effects::on_request().map(|s| s.id).collect();
        error::rig(format!(
            "candidates: effect `{id}` is not in the catalogue; looked for on request are {}",
            on_request.join(", ")
        ))
    })
}

/// The catalogue's entry.
pub(crate) fn known(id: &str) -> PyResult<&'static Spec> {
    effects::spec(id).ok_or_else(|| {
        let known: Vec<_> = effects::all().map(|s| s.id).collect();
        error::rig(format!(
            "effect `{id}` is not in the catalogue; known are {}",
            known.join(", ")
        ))
    })
}

/// Where the effect's parameter of this name stands.
pub(crate) fn place(spec: &Spec, name: &str) -> PyResult<usize> {
    spec.parameters
        .iter()
        .position(|p| p.name == name)
        .ok_or_else(|| {
            let known: Vec<_> = spec.parameters.iter().map(|p| p.name).collect();
            error::rig(format!(
                "effect `{}` has no parameter `{name}`; it has {}",
                spec.id,
                known.join(", ")
            ))
        })
}

/// The effects that this version can simulate and name.
///
/// Returns
/// -------
/// dict
///     By id, in the catalogue's order: `name`, `law` (formula), `sentence` (what it is), `shows` (how it looks in
///     data), `experiment` (what shows it apart from its look-alikes), `look_alikes` (ids),
///     `follows_state` (whether it is a function of the present state and motor voltage alone), `offered` ("always"
///     if `diagnose` looks for it from the outset, "on request" with `candidates=[id]` or where the others leave
///     something, "never" where no fit can follow it), `kinds` (each `Rig.motor_kind` of rigs that can have it),
///     `parameters` (SI unit by name) and `details` (by name: `unit`, `kind`, which is "real", "whole" or "choice",
///     `choices`, `min`, `max`, `off`, the value at which it does nothing, and `default`; None where there is none).
///
/// Examples
/// --------
/// >>> import furuta
/// >>> furuta.catalogue()["arm.spring"]["parameters"]
/// {'stiffness': 'N m/rad', 'rest': 'rad'}
/// >>> encoder = furuta.catalogue()["drive.backlash"]["details"]["encoder"]
/// >>> encoder["choices"], encoder["default"]
/// (['arm', 'motor'], 'arm')
#[pyfunction]
#[pyo3(text_signature = "()")]
pub(crate) fn catalogue(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let all = PyDict::new(py);
    for spec in effects::all() {
        let entry = PyDict::new(py);
        entry.set_item("name", spec.name)?;
        entry.set_item("law", spec.law)?;
        entry.set_item("sentence", spec.sentence)?;
        entry.set_item("shows", spec.shows)?;
        entry.set_item("experiment", spec.experiment)?;
        entry.set_item("look_alikes", spec.look_alikes.to_vec())?;
        entry.set_item("follows_state", spec.follows_state())?;
        entry.set_item("offered", spec.offered.word())?;
        entry.set_item("kinds", spec.acts.kinds().collect::<Vec<_>>())?;
        let (parameters, details) = (PyDict::new(py), PyDict::new(py));
        for p in spec.parameters {
            parameters.set_item(p.name, p.unit)?;
            details.set_item(p.name, detail(py, p)?)?;
        }
        entry.set_item("parameters", parameters)?;
        entry.set_item("details", details)?;
        all.set_item(spec.id, entry)?;
    }
    Ok(all)
}

/// What one parameter of an effect may be.
fn detail<'py>(py: Python<'py>, p: &ParameterSpec) -> PyResult<Bound<'py, PyDict>> {
    let detail = PyDict::new(py);
    let choices = match p.kind {
        Kind::Choice(words) => Some(words.to_vec()),
        _ => None,
    };
    let kind = match p.kind {
        Kind::Choice(_) => "choice",
        kind if kind.is_whole() => "whole",
        _ => "real",
    };
    detail.set_item("unit", p.unit)?;
    detail.set_item("kind", kind)?;
    detail.set_item("choices", choices)?;
    detail.set_item("min", p.min)?;
    detail.set_item("max", p.max)?;
    detail.set_item("off", Value::of(p, p.off))?;
    detail.set_item("default", p.default.map(|v| Value::of(p, v)))?;
    Ok(detail)
}
