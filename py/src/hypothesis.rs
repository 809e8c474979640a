//! The class `Hypothesis`: a law of the user's own.

use crate::error;
use furuta_model::Spec;
use furuta_model::effects::own::{self, Constant, Definition, InternalState, Parameter, Side};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};
use std::collections::BTreeMap;
use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher};

/// A law of your own: an effect that the catalogue does not have.
///
/// It is compiled once, its units checked; from then on it is an effect as any other: `rig.with_effect(hypothesis,
/// ...)` has it, rig files carry it, and `diagnose(..., candidates=[hypothesis])` looks for it. Immutable.
///
/// Parameters
/// ----------
/// id : str
///     "user." and then small letters, digits, "-" or "_".
/// arm, pendulum : str, optional
///     Torque on the axis, N m, in `theta`, `alpha`, `theta_dot`, `alpha_dot`, `u`, `t`, the parameters, the constants
///     and the state, with + - * / ^ and sin, cos, tanh, exp, sqrt, abs, min, max, sign(x, width).
/// voltage : str, optional
///     What is added to the voltage, V, in `u` and `t`.
/// parameters : dict
///     By name, 1 to 4 of them: a dict with `unit`, `min`, `max`, `typical` (a size that would be noticed) and, if
///     wanted, `strength` (whether the law is 0 where it is off; a single parameter is), `off` (0) and `starts`.
/// constants : dict, optional
///     By name: a dict with `value` and `unit`.
/// state : dict, optional
///     A state of its own: `name`, `unit`, `rate` (how fast it changes, a law as the others) and `start` (0).
/// side : {"arm", "motor"}, optional
///     On which side of a drive with backlash or compliance the law for the arm acts.
/// name, experiment : str, optional
///     For reports: the name in words, what would tell the law from its rivals.
///
/// Raises
/// ------
/// RigError
///     What is wrong, with the character of the law and a mark below it.
///
/// Examples
/// --------
/// >>> import furuta
/// >>> brake = furuta.Hypothesis("user.eddy-brake", arm="-k*theta_dot/(1 + (theta_dot/v)^2)", parameters={
/// ...     "k": {"unit": "N m s/rad", "min": 0, "max": 1, "typical": 1e-4, "strength": True},
/// ...     "v": {"unit": "rad/s", "min": 0.5, "max": 100, "typical": 5},
/// ... })
/// >>> rig = furuta.Rig.load("qube-servo-2").with_effect(brake, k=3e-4, v=4)
/// >>> rig.effects
/// {'user.eddy-brake': {'k': 0.0003, 'v': 4.0}}
/// >>> furuta.Rig.from_toml(rig.to_toml()) == rig
/// True
/// >>> furuta.Hypothesis("user.drag", arm="-k*theta_dott", parameters=brake.parameters)  # doctest: +ELLIPSIS
/// Traceback (most recent call last):
/// furuta.RigError: hypothesis user.drag, arm, character 4: ...
#[pyclass(name = "Hypothesis", module = "furuta", frozen)]
pub(crate) struct PyHypothesis {
    pub(crate) spec: &'static Spec,
}

/// A dict whose keys are all among these.
fn keys(what: &str, given: &Bound<'_, PyDict>, known: &[&str]) -> PyResult<()> {
    for key in given.keys() {
        let key: String = key.extract()?;
        if !known.contains(&key.as_str()) {
            return Err(error::rig(format!(
                "{what} has no key `{key}`; it has {}",
                known.join(", ")
            )));
        }
    }
    Ok(())
}

/// The value of a key that may be left out.
fn optional<'py, T>(given: &Bound<'py, PyDict>, key: &str) -> PyResult<Option<T>>
where
    T: FromPyObjectOwned<'py>,
{
    match given.get_item(key)? {
        Some(value) if !value.is_none() => value.extract::<T>().map(Some).map_err(Into::into),
        _ => Ok(None),
    }
}

/// The value of a key that must be there.
fn required<'py, T>(what: &str, given: &Bound<'py, PyDict>, key: &str) -> PyResult<T>
where
    T: FromPyObjectOwned<'py>,
{
    optional(given, key)?.ok_or_else(|| error::rig(format!("{what} lacks `{key}`")))
}

fn parameter(name: String, given: &Bound<'_, PyDict>) -> PyResult<Parameter> {
    let what = format!("parameter {name}");
    let known = ["unit", "min", "max", "typical", "off", "strength", "starts"];
    keys(&what, given, &known)?;
    Ok(Parameter {
        unit: required(&what, given, "unit")?,
        min: required(&what, given, "min")?,
        max: required(&what, given, "max")?,
        typical: required(&what, given, "typical")?,
        off: optional(given, "off")?.unwrap_or(0.0),
        strength: optional(given, "strength")?,
        starts: optional(given, "starts")?.unwrap_or_default(),
        name,
    })
}

fn constant(name: String, given: &Bound<'_, PyDict>) -> PyResult<Constant> {
    let what = format!("constant {name}");
    keys(&what, given, &["value", "unit"])?;
    Ok(Constant {
        value: required(&what, given, "value")?,
        unit: required(&what, given, "unit")?,
        name,
    })
}

fn state(given: &Bound<'_, PyDict>) -> PyResult<InternalState> {
    keys("the state", given, &["name", "unit", "rate", "start"])?;
    Ok(InternalState {
        name: required("the state", given, "name")?,
        unit: required("the state", given, "unit")?,
        rate: required("the state", given, "rate")?,
        start: optional(given, "start")?.unwrap_or(0.0),
    })
}

/// The one hypothesis of a text or file; of several the one with this id.
fn one(all: &[&'static Spec], id: Option<&str>) -> PyResult<PyHypothesis> {
    let chosen = match id {
        Some(id) => all.iter().find(|spec| spec.id == id),
        None => all.first().filter(|_| all.len() == 1),
    };
    let chosen = chosen.copied().map(|spec| PyHypothesis { spec });
    chosen.ok_or_else(|| {
        let ids: Vec<_> = all.iter().map(|s| s.id).collect();
        error::rig(format!("it has {}: give id= one of them", ids.join(", ")))
    })
}

#[pymethods]
impl PyHypothesis {
    #[new]
    #[pyo3(
        signature = (
            id, *, arm=None, pendulum=None, voltage=None, parameters, constants=None, state=None, side="arm", name="",
            experiment=""
        ),
        text_signature = "(id, *, arm=None, pendulum=None, voltage=None, parameters, constants=None, state=None, \
            side='arm', name='', experiment='')"
    )]
    #[allow(clippy::too_many_arguments)] // keywords in Python
    fn new(
        id: String,
        arm: Option<String>,
        pendulum: Option<String>,
        voltage: Option<String>,
        parameters: BTreeMap<String, Bound<'_, PyDict>>,
        constants: Option<BTreeMap<String, Bound<'_, PyDict>>>,
        state: Option<Bound<'_, PyDict>>,
        side: &str,
        name: &str,
        experiment: &str,
    ) -> PyResult<Self> {
        let side = match side {
            "arm" => Side::Arm,
            "motor" => Side::Motor,
            _ => {
                return Err(PyValueError::new_err(format!(
                    "side = {side:?} must be \"arm\" or \"motor\""
                )));
            }
        };
        let parameters = parameters.into_iter().map(|(name, p)| parameter(name, &p));
        let constants = constants.unwrap_or_default().into_iter();
        let definition = Definition {
            id,
            name: name.to_owned(),
            experiment: experiment.to_owned(),
            arm,
            pendulum,
            voltage,
            side,
            state: state.as_ref().map(self::state).transpose()?,
            parameters: parameters.collect::<PyResult<_>>()?,
            constants: constants
                .map(|(name, c)| constant(name, &c))
                .collect::<PyResult<_>>()?,
        };
        let spec = definition.compile().map_err(error::rig)?;
        Ok(Self { spec })
    }

    /// The hypothesis of a TOML text: a table `[hypothesis."user.my-law"]`, as rig files have it. Of a text with several
    /// `id` says which.
    ///
    /// Examples
    /// --------
    /// >>> import furuta
    /// >>> drag = furuta.Hypothesis.from_toml('''
    /// ... [hypothesis."user.drag"]
    /// ... arm = "-c*theta_dot*abs(theta_dot)"
    /// ... parameters.c = { unit = "N m s2/rad2", min = 0.0, max = 1.0, typical = 1e-4 }
    /// ... ''')
    /// >>> furuta.Hypothesis.from_toml(drag.to_toml()) == drag
    /// True
    #[classmethod]
    #[pyo3(signature = (text, *, id=None), text_signature = "(text, *, id=None)")]
    fn from_toml(_cls: &Bound<'_, PyType>, text: &str, id: Option<&str>) -> PyResult<Self> {
        one(&own::read(text).map_err(error::rig)?, id)
    }

    /// The hypothesis of a file; of a file with several `id` says which.
    #[classmethod]
    #[pyo3(signature = (path, *, id=None), text_signature = "(path, *, id=None)")]
    fn load(
        _cls: &Bound<'_, PyType>,
        path: std::path::PathBuf,
        id: Option<&str>,
    ) -> PyResult<Self> {
        one(&own::load(path).map_err(error::rig)?, id)
    }

    /// The hypothesis as the text of a file.
    fn to_toml(&self) -> String {
        let text = self.text();
        format!("[hypothesis.\"{}\"]\n{text}", self.spec.id)
    }

    /// Writes the file. A file that is there already is replaced only with `force`.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     `Hypothesis.load(path)` reads it, and so does `furuta diagnose --candidate`.
    /// force : bool, optional
    ///
    /// Raises
    /// ------
    /// FileExistsError
    #[pyo3(signature = (path, *, force=false))]
    fn save(&self, py: Python<'_>, path: std::path::PathBuf, force: bool) -> PyResult<()> {
        crate::file::write_data(py, &path, force, &self.to_toml())
    }

    /// As in rig files: "user.my-law".
    #[getter]
    fn id(&self) -> &'static str {
        self.spec.id
    }

    /// Its name in words; the id where none was given.
    #[getter]
    fn name(&self) -> &'static str {
        self.spec.name
    }

    /// Its laws in a line.
    #[getter]
    fn law(&self) -> &'static str {
        self.spec.law
    }

    /// By name: `unit`, `min`, `max`, `typical`, `off` and `strength` of each parameter.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        for (i, p) in self.spec.parameters.iter().enumerate() {
            let one = PyDict::new(py);
            one.set_item("unit", p.unit)?;
            one.set_item("min", p.min)?;
            one.set_item("max", p.max)?;
            if let furuta_model::effects::Typical::Is(size) = p.typical {
                one.set_item("typical", size)?;
            }
            one.set_item("off", p.off)?;
            one.set_item("strength", i < self.spec.strengths)?;
            all.set_item(p.name, one)?;
        }
        Ok(all)
    }

    /// The same law with the same ranges.
    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        let other = other.cast::<Self>();
        other.is_ok_and(|other| self.spec.is_same(other.get().spec))
    }

    fn __hash__(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        (self.spec.id, self.text()).hash(&mut hasher);
        hasher.finish()
    }

    fn __repr__(&self) -> String {
        format!("<furuta.Hypothesis {:?}: {}>", self.spec.id, self.spec.law)
    }

    /// Pickles as its text.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (String,))> {
        Ok((slf.get_type().getattr("from_toml")?, (slf.get().to_toml(),)))
    }
}

impl PyHypothesis {
    fn text(&self) -> &'static str {
        self.spec.own.map_or("", |laws| laws.text())
    }
}

/// An effect as Python names it: an id, or a law of the user's own.
#[derive(FromPyObject)]
pub(crate) enum EffectLike<'py> {
    Own(Bound<'py, PyHypothesis>),
    Id(String),
}

impl EffectLike<'_> {
    pub(crate) fn spec(&self) -> PyResult<&'static Spec> {
        match self {
            Self::Own(own) => Ok(own.get().spec),
            Self::Id(id) => crate::catalogue::known(id),
        }
    }
}

/// One thing that is to be looked for, which may be a file with several; `None` if it is none.
fn candidate(given: &Bound<'_, PyAny>) -> PyResult<Option<Vec<&'static Spec>>> {
    let found = if let Ok(own) = given.cast::<PyHypothesis>() {
        vec![own.get().spec]
    } else if let Ok(id) = given.extract::<String>() {
        if id.ends_with(".toml") {
            own::load(id).map_err(error::rig)?
        } else {
            vec![crate::catalogue::entry(&id)?]
        }
    } else if let Ok(path) = given.extract::<std::path::PathBuf>() {
        own::load(path).map_err(error::rig)?
    } else {
        return Ok(None);
    };
    Ok(Some(found))
}

/// What is to be looked for beside what always is: ids of the catalogue, laws of the user's own, files with some; a
/// list or one alone.
pub(crate) fn candidates(given: Option<&Bound<'_, PyAny>>) -> PyResult<Vec<&'static Spec>> {
    let Some(given) = given else {
        return Ok(Vec::new());
    };
    if let Some(alone) = candidate(given)? {
        return Ok(alone);
    }
    let wrong = || {
        PyTypeError::new_err("candidates: give ids, furuta.Hypothesis, or paths of files with laws")
    };
    let mut all: Vec<&'static Spec> = Vec::new();
    for one in given.try_iter().map_err(|_| wrong())? {
        for spec in candidate(&one?)?.ok_or_else(wrong)? {
            if all
                .iter()
                .any(|other| other.id == spec.id && !other.is_same(spec))
            {
                return Err(error::rig(format!(
                    "candidates: two different laws are called {}: give one of them another id",
                    spec.id
                )));
            }
            all.push(spec);
        }
    }
    Ok(all)
}
