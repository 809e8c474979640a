//! The class `Rig`.

use crate::catalogue::{Value, place};
use crate::error;
use crate::hypothesis::EffectLike;
use crate::kept::immutable;
use furuta_model::params::{ParamRange, RANGES};
use furuta_model::{Effect, Params, Rig};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};
use std::collections::BTreeMap;

/// A rig: parameters, sensors, limits and effects. Immutable: the `with_...` methods return another one.
///
/// Get one with `Rig(name or path)`, which is `Rig.load`, or `Rig.from_toml(text)`.
///
/// Parameters
/// ----------
/// name_or_path : str or os.PathLike
///     A built-in rig (`Rig.BUILTIN` lists them), or else a rig file.
///
/// Examples
/// --------
/// >>> import furuta
/// >>> rig = furuta.Rig.load("qube-servo-2")
/// >>> rig.parameters["pendulum.mass"]  # kg
/// 0.024
/// >>> heavier = rig.with_parameters({"pendulum.mass": 0.03})
/// >>> furuta.Rig.from_toml(heavier.to_toml()) == heavier
/// True
#[pyclass(name = "Rig", module = "furuta", frozen, eq)]
#[derive(Clone, PartialEq)]
pub(crate) struct PyRig {
    pub(crate) rig: Rig,
}

immutable!(PyRig);

#[pymethods]
impl PyRig {
    #[new]
    fn new(name_or_path: std::path::PathBuf) -> PyResult<Self> {
        let rig = Rig::load(&name_or_path.to_string_lossy()).map_err(error::rig)?;
        Ok(Self { rig })
    }

    /// Names of the built-in rigs.
    #[classattr]
    #[pyo3(name = "BUILTIN")]
    fn builtin() -> Vec<&'static str> {
        Rig::BUILTIN.to_vec()
    }

    /// Names of those of them whose command is a voltage.
    #[classattr]
    #[pyo3(name = "VOLTAGE")]
    fn voltage() -> Vec<&'static str> {
        Rig::VOLTAGE.to_vec()
    }

    /// What the command is, `motor.kind` of the rig file: "voltage", "torque" or "acceleration".
    ///
    /// Examples
    /// --------
    /// >>> import furuta
    /// >>> stepper = furuta.Rig.load("stepper-kit")
    /// >>> stepper.motor_kind, stepper.command_unit
    /// ('acceleration', 'rad/s2')
    #[getter]
    fn motor_kind(&self) -> &'static str {
        self.rig.params.motor.actuation.kind()
    }

    /// Unit of the command: "V", "A", "N m" or "rad/s2".
    #[getter]
    fn command_unit(&self) -> &'static str {
        self.rig.params.motor.actuation.unit()
    }

    /// A built-in rig by its name, or else the rig file at this path.
    #[classmethod]
    #[pyo3(text_signature = "(name_or_path)")]
    fn load(_cls: &Bound<'_, PyType>, name_or_path: std::path::PathBuf) -> PyResult<Self> {
        Self::new(name_or_path)
    }

    /// A rig from the text of a rig file (TOML).
    #[classmethod]
    #[pyo3(text_signature = "(text)")]
    fn from_toml(_cls: &Bound<'_, PyType>, text: &str) -> PyResult<Self> {
        Ok(Self {
            rig: Rig::from_toml(text).map_err(error::rig)?,
        })
    }

    /// The rig as the text of a rig file.
    fn to_toml(&self) -> String {
        self.rig.to_toml()
    }

    /// Writes the rig file. A file that is there already is replaced only with `force`.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     `Rig.load(path)` reads it, and so does the command line.
    /// force : bool, optional
    ///
    /// Raises
    /// ------
    /// FileExistsError
    #[pyo3(signature = (path, *, force=false))]
    fn save(&self, py: Python<'_>, path: std::path::PathBuf, force: bool) -> PyResult<()> {
        crate::file::write_data(py, &path, force, &self.rig.to_toml())
    }

    /// The rig as a model of MuJoCo, with those of its effects that MJCF can say; the file's comment lists the others.
    ///
    /// The actuator `motor` takes volts, held from one sample to the next; joint `theta` is the arm, `alpha` the
    /// pendulum, 0 upright.
    ///
    /// Parameters
    /// ----------
    /// timestep : float, optional
    ///     Step of MuJoCo's integrator in s, 1e-6 to 0.01.
    ///
    /// Returns
    /// -------
    /// str
    ///     The text of an MJCF file.
    ///
    /// Raises
    /// ------
    /// RigError
    ///     A rig of which no rigid bodies have the moments of inertia; a step out of its range.
    ///
    /// Examples
    /// --------
    /// >>> import furuta
    /// >>> text = furuta.Rig.load("qube-servo-2").to_mjcf()
    /// >>> text.splitlines()[0]
    /// '<mujoco model="qube-servo-2">'
    #[pyo3(signature = (*, timestep=furuta_export::mjcf::STEP), text_signature = "($self, *, timestep=0.0005)")]
    fn to_mjcf(&self, timestep: f64) -> PyResult<String> {
        if !(1e-6..=0.01).contains(&timestep) {
            let problem =
                format!("timestep = {timestep} s is outside the allowed range [1e-06, 0.01] s");
            return Err(error::rig(problem));
        }
        let exported = furuta_export::mjcf(&self.rig, timestep).map_err(error::rig)?;
        Ok(exported.text)
    }

    /// The rig as a robot description (URDF): bodies, joints and their friction, and a transmission for the motor. The
    /// file's comment lists what it does not carry over.
    ///
    /// Returns
    /// -------
    /// str
    ///     The text of a URDF file.
    ///
    /// Raises
    /// ------
    /// RigError
    ///     A rig of which no rigid bodies have the moments of inertia.
    ///
    /// Examples
    /// --------
    /// >>> import furuta
    /// >>> "<robot" in furuta.Rig.load("qube-servo-2").to_urdf()
    /// True
    fn to_urdf(&self) -> PyResult<String> {
        Ok(furuta_export::urdf(&self.rig).map_err(error::rig)?.text)
    }

    /// The rig as a dict of plain Python values: name, source, motor (kind, unit), parameters, sensors, limits,
    /// effects.
    ///
    /// Examples
    /// --------
    /// >>> import furuta
    /// >>> furuta.Rig.load("qube-servo-2").to_dict()["sensors"]["pendulum_counts_per_rev"]
    /// 2048.0
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        all.set_item("name", self.name())?;
        all.set_item("source", self.source())?;
        let motor = PyDict::new(py);
        motor.set_item("kind", self.motor_kind())?;
        motor.set_item("unit", self.command_unit())?;
        all.set_item("motor", motor)?;
        all.set_item("parameters", self.parameters())?;
        all.set_item("sensors", self.sensors())?;
        all.set_item("limits", self.limits())?;
        all.set_item("effects", self.effects(py)?)?;
        Ok(all)
    }

    /// The linear model as a python-control system; python-control must be installed.
    ///
    /// It holds the effects that have a slope, as `linearize` does where nothing is said about them; a UserWarning
    /// names each of the others.
    ///
    /// Parameters
    /// ----------
    /// x : array_like, shape (4,), optional
    ///     Where it is linearised, rad and rad/s; where the rig rests upright with its arm at 0 if not given.
    /// dt : float, optional
    ///     Sample period in s of a sampled model, its command held; a continuous one if not given.
    ///
    /// Returns
    /// -------
    /// control.StateSpace
    ///     States theta, alpha, theta_dot, alpha_dot; input u (V); outputs theta, alpha (rad).
    ///
    /// Examples
    /// --------
    /// >>> import furuta
    /// >>> furuta.Rig.load("qube-servo-2").to_ss().state_labels  # doctest: +SKIP
    /// ['theta', 'alpha', 'theta_dot', 'alpha_dot']
    #[pyo3(signature = (x=None, *, dt=None))]
    fn to_ss<'py>(
        slf: &Bound<'py, Self>,
        x: Option<Bound<'py, PyAny>>,
        dt: Option<f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        slf.py()
            .import("furuta._control")?
            .call_method1("state_space", (slf, x, dt))
    }

    /// The transfer function from u (V) to one angle (rad) of the linear model; python-control must be installed.
    ///
    /// Parameters
    /// ----------
    /// output : {"alpha", "theta"}, optional
    /// x : array_like, shape (4,), optional
    ///     Where it is linearised; hanging at rest if not given, where recordings in open loop are made.
    ///
    /// Returns
    /// -------
    /// control.TransferFunction
    #[pyo3(signature = (output="alpha", x=None))]
    fn to_tf<'py>(
        slf: &Bound<'py, Self>,
        output: &str,
        x: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        slf.py()
            .import("furuta._control")?
            .call_method1("transfer_function", (slf, output, x))
    }

    /// A parameter by its key, rig["arm.length"]; an effect by its id; one of its parameters,
    /// rig["arm.coulomb.torque"].
    fn __getitem__<'py>(&self, py: Python<'py>, key: &str) -> PyResult<Bound<'py, PyAny>> {
        if let Some(value) = self.parameters().get(key) {
            return Ok(value.into_pyobject(py)?.into_any());
        }
        let effects = self.effects(py)?;
        if let Some(effect) = effects.get_item(key)? {
            return Ok(effect);
        }
        if let Some((id, name)) = key.rsplit_once('.')
            && let Some(effect) = effects.get_item(id)?
            && let Ok(value) = effect.get_item(name)
        {
            return Ok(value);
        }
        let known: Vec<_> = RANGES.iter().map(|r| r.key).collect();
        let mut text = format!("{key}: a rig has {}", known.join(", "));
        for effect in &self.rig.effects {
            text += ", ";
            text += effect.spec().id;
        }
        Err(PyKeyError::new_err(text))
    }

    fn __contains__(&self, py: Python<'_>, key: &str) -> bool {
        self.__getitem__(py, key).is_ok()
    }

    /// Equal rigs have equal hashes; 0 and -0 are equal, and written differently: no number is hashed.
    fn __hash__(&self) -> u64 {
        let mut hasher = std::hash::DefaultHasher::new();
        let effects: Vec<&str> = self.rig.effects.iter().map(|e| e.spec().id).collect();
        std::hash::Hash::hash(&(&self.rig.name, effects), &mut hasher);
        std::hash::Hasher::finish(&hasher)
    }

    /// The rig as a table, for notebooks.
    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        crate::card::card(slf.as_any(), "rig")
    }

    /// Short name.
    #[getter]
    fn name(&self) -> &str {
        &self.rig.name
    }

    /// Where the numbers come from.
    #[getter]
    fn source(&self) -> &str {
        &self.rig.source
    }

    /// Physical parameters in SI units by their keys in the rig file, for example `"arm.inertia"`. A copy: see
    /// `with_parameters`. Only those that enter the equations of its `motor_kind`.
    #[getter]
    fn parameters(&self) -> BTreeMap<&'static str, f64> {
        let actuation = self.rig.params.motor.actuation;
        RANGES
            .iter()
            .map(|r| r.key)
            .zip(self.rig.params.to_array())
            .filter(|(key, _)| actuation.uses(key))
            .collect()
    }

    /// Counts per revolution of the two encoders.
    #[getter]
    fn sensors(&self) -> BTreeMap<&'static str, f64> {
        let s = &self.rig.sensors;
        BTreeMap::from([
            ("arm_counts_per_rev", s.arm_counts_per_rev),
            ("pendulum_counts_per_rev", s.pendulum_counts_per_rev),
        ])
    }

    /// Where a run is stopped (rad, rad/s), or None.
    #[getter]
    fn limits(&self) -> BTreeMap<&'static str, Option<f64>> {
        let l = &self.rig.limits;
        BTreeMap::from([
            ("arm_angle", l.arm_angle),
            ("arm_speed", l.arm_speed),
            ("pendulum_speed", l.pendulum_speed),
        ])
    }

    /// How well each number of the sheet is known: one standard deviation as a share of its value, `None` where nothing
    /// is known. A copy: see `with_tolerance`.
    #[getter]
    fn tolerance(&self) -> BTreeMap<&'static str, Option<f64>> {
        let of = |r: &ParamRange| (r.key, self.rig.tolerance.share(r.key));
        RANGES.iter().map(of).collect()
    }

    /// The same rig with these tolerances, for example `{"arm.length": 0.005}`: one standard deviation as a share of
    /// the value. A diagnosis holds what recordings do not show near the sheet by it.
    ///
    /// Examples
    /// --------
    /// >>> import furuta
    /// >>> rig = furuta.Rig.load("qube-servo-2").with_tolerance({"arm.length": 0.005})
    /// >>> rig.tolerance["arm.length"], rig.tolerance["motor.resistance"]
    /// (0.005, 0.1)
    fn with_tolerance(&self, tolerance: BTreeMap<String, f64>) -> PyResult<Self> {
        let mut rig = self.rig.clone();
        for (key, share) in tolerance {
            rig.tolerance.set(&key, share).map_err(error::rig)?;
        }
        Ok(Self { rig })
    }

    /// Effects beyond the rigid-body model: parameters (SI; words where there is a choice) by the effect's id. A copy:
    /// see `with_effect`.
    #[getter]
    fn effects<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        for effect in &self.rig.effects {
            let spec = effect.spec();
            let values = PyDict::new(py);
            for (p, v) in spec.parameters.iter().zip(effect.values()) {
                values.set_item(p.name, Value::of(p, v))?;
            }
            all.set_item(spec.id, values)?;
        }
        Ok(all)
    }

    /// The same rig with these parameters changed, for example `{"pendulum.mass": 0.03}`.
    fn with_parameters(&self, parameters: BTreeMap<String, f64>) -> PyResult<Self> {
        let mut values = self.rig.params.to_array();
        let actuation = self.rig.params.motor.actuation;
        for (key, value) in parameters {
            if !actuation.uses(&key) && parameter(&key).is_ok() {
                return Err(error::rig(format!(
                    "{key} does not enter the equations of a rig whose motor.kind is \"{actuation}\""
                )));
            }
            values[parameter(&key)?] = value;
        }
        let params = Params::from_array(actuation, values);
        params.validate().map_err(error::rig)?;
        Ok(Self {
            rig: Rig {
                params,
                ..self.rig.clone()
            },
        })
    }

    /// The same rig with one more effect, or with its parameters replaced where the rig has it already.
    ///
    /// Parameters
    /// ----------
    /// id : str or Hypothesis
    ///     Its id in the catalogue, for example "arm.coulomb", or a law of your own.
    /// **parameters : float or str
    ///     Its parameters in SI units, a word where there is a choice; all that have no default. See `catalogue`.
    ///     Without any the effect has its typical size on this rig, as with `--hide ID` on the command line.
    ///
    /// Examples
    /// --------
    /// >>> import furuta
    /// >>> rig = furuta.Rig.load("qube-servo-2")
    /// >>> rig.with_effect("arm.spring", stiffness=8.6e-4, rest=-0.5).effects
    /// {'arm.spring': {'stiffness': 0.00086, 'rest': -0.5}}
    /// >>> rig.with_effect("drive.backlash", gap=0.05, motor_share=0.4, encoder="motor").effects
    /// {'drive.backlash': {'gap': 0.05, 'motor_share': 0.4, 'encoder': 'motor'}}
    /// >>> rig.with_effect("arm.coulomb").effects["arm.coulomb"]["torque"] > 0  # typical
    /// True
    #[pyo3(signature = (id, /, **parameters))]
    fn with_effect(
        &self,
        id: EffectLike<'_>,
        parameters: Option<BTreeMap<String, Value>>,
    ) -> PyResult<Self> {
        let spec = id.spec()?;
        let mut given = BTreeMap::new();
        for (name, value) in parameters.unwrap_or_default() {
            let number = value.number(spec, place(spec, &name)?)?;
            given.insert(name, number);
        }
        let typical = given.is_empty();
        let params = &self.rig.params;
        let values = spec.values(|name| {
            let p = spec.parameters.iter().find(|p| p.name == name);
            let size = || p.map(|p| p.default.unwrap_or(p.off + p.typical(params)));
            given
                .get(name)
                .copied()
                .or_else(|| size().filter(|_| typical))
        });
        let values = values.map_err(error::rig)?;
        let effect = Effect::checked(spec, &values).map_err(error::rig)?;
        let mut rig = self.rig.clone();
        rig.effects.retain(|e| e.spec().id != spec.id);
        rig.effects.push(effect);
        rig.try_plant::<f64>().map_err(error::rig)?;
        Ok(Self { rig })
    }

    /// The same rig as its data sheet has it: no effects.
    fn without_effects(&self) -> Self {
        Self {
            rig: Rig {
                effects: Vec::new(),
                ..self.rig.clone()
            },
        }
    }

    fn __repr__(&self) -> String {
        let effects: Vec<_> = self.rig.effects.iter().map(|e| e.spec().id).collect();
        let with = if effects.is_empty() {
            String::new()
        } else {
            format!(" with {}", effects.join(", "))
        };
        format!("<furuta.Rig {:?}{with}>", self.rig.name)
    }

    /// Pickles as the rig file's text.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (String,))> {
        Ok((slf.get_type().getattr("from_toml")?, (slf.get().to_toml(),)))
    }
}

/// Where the parameter with this key stands in [`Params::to_array`].
pub(crate) fn parameter(key: &str) -> PyResult<usize> {
    RANGES.iter().position(|r| r.key == key).ok_or_else(|| {
        let known: Vec<_> = RANGES.iter().map(|r| r.key).collect();
        error::rig(format!(
            "no parameter `{key}`; a rig has {}",
            known.join(", ")
        ))
    })
}
