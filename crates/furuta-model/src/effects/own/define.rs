//! What a user writes, compiled into an effect.

use super::error::{HypothesisError, Marked};
use super::parse::{self, Names};
use super::registry::keep;
use super::tape::Tape;
use super::units::Unit;
use super::{OwnLaws, OwnState, Problem};
use crate::effects::Spec;
use serde::Deserialize;

/// The most constants of one hypothesis.
pub const MAX_CONSTANTS: usize = 8;

/// A hypothesis as its user writes it.
///
/// ```
/// use furuta_model::effects::own::{Definition, Parameter};
/// use furuta_model::{Effect, Plant, Rig};
/// let drag = Definition {
///     id: "user.drag".into(),
///     arm: Some("-c*theta_dot*abs(theta_dot)".into()),
///     parameters: vec![Parameter::new("c", "N m s2/rad2", 0.0..=1.0, 1e-4)],
///     ..Definition::default()
/// };
/// let spec = drag.compile()?;
/// let effect = Effect::of(spec, &[2e-5]).expect("one value");
/// let rig = Rig::builtin("qube-servo-2").expect("built in");
/// let plant: Plant<f64> = Plant::new(&rig.params, &[effect]).expect("one effect");
/// assert_eq!(plant.effects().len(), 1);
/// // A mistake is shown where it is.
/// let wrong = Definition { arm: Some("-c*theta_dot".into()), ..drag };
/// assert_eq!(
///     wrong.compile().expect_err("a unit").to_string(),
///     "hypothesis user.drag, arm, character 1: the law is in N m s/rad, it must be in N m: a factor in rad/s is \
///      missing\n  -c*theta_dot\n  ^^^^^^^^^^^^",
/// );
/// # Ok::<(), furuta_model::effects::own::HypothesisError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Definition {
    /// `user.` and then letters, digits, `-` or `_`.
    pub id: String,
    /// Name in words; the id where it is empty.
    pub name: String,
    /// What would tell it from its rivals; empty: said in general.
    pub experiment: String,
    /// Law of the torque on the arm, N m.
    pub arm: Option<String>,
    /// Law of the torque on the pendulum, N m.
    pub pendulum: Option<String>,
    /// Law of what is added to the voltage, V; in `u` and `t`.
    pub voltage: Option<String>,
    /// Where the torque on the arm acts.
    pub side: Side,
    /// A state of its own that the torques depend on.
    pub state: Option<InternalState>,
    /// What a fit varies.
    pub parameters: Vec<Parameter>,
    /// What a fit does not vary.
    pub constants: Vec<Constant>,
}

/// A parameter of a hypothesis.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// As in the law: small letters, digits and `_`.
    pub name: String,
    /// As in the catalogue: `N m s2/rad2`; `-` for a pure number.
    pub unit: String,
    /// Lower end of its range.
    pub min: f64,
    /// Upper end of its range.
    pub max: f64,
    /// A size that would be noticed, counted from `off`.
    pub typical: f64,
    /// The value at which the law does nothing.
    pub off: f64,
    /// Whether the law does nothing where this (and every other strength) is off; said of none: the only parameter is.
    pub strength: Option<bool>,
    /// Where a search starts; empty: near off for what can have both signs, else at the typical size or a third of it.
    pub starts: Vec<f64>,
}

impl Parameter {
    /// A parameter that is off at 0.
    #[must_use]
    pub fn new(name: &str, unit: &str, range: std::ops::RangeInclusive<f64>, typical: f64) -> Self {
        Self {
            name: name.to_owned(),
            unit: unit.to_owned(),
            min: *range.start(),
            max: *range.end(),
            typical,
            off: 0.0,
            strength: None,
            starts: Vec::new(),
        }
    }
}

/// A constant of a hypothesis: a number with a unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Constant {
    /// As in the law.
    pub name: String,
    /// As in the catalogue.
    pub unit: String,
    /// Its value.
    pub value: f64,
}

/// On which side of a drive with backlash or compliance ([`crate::effects::Drive`]) the law for the arm acts; on a rig
/// without one it is the same.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    /// On the arm, at the arm's angle and speed.
    #[default]
    Arm,
    /// On the motor's rotor; `theta` and `theta_dot` are the rotor's.
    Motor,
}

/// A state of a hypothesis: a number that follows a differential equation.
///
/// ```
/// use furuta_model::effects::own::{Definition, InternalState, Parameter};
/// // Dahl's friction by its torque z.
/// let dahl = Definition {
///     id: "user.dahl".into(),
///     arm: Some("-z".into()),
///     state: Some(InternalState {
///         name: "z".into(),
///         unit: "N m".into(),
///         rate: "k*(theta_dot - abs(theta_dot)*z/c)".into(),
///         start: 0.0,
///     }),
///     parameters: vec![
///         Parameter { strength: Some(true), ..Parameter::new("k", "N m/rad", 0.0..=10.0, 0.1) },
///         Parameter::new("c", "N m", 1e-6..=1.0, 1e-3),
///     ],
///     ..Definition::default()
/// };
/// assert_eq!(dahl.compile()?.parameters.len(), 2);
/// # Ok::<(), furuta_model::effects::own::HypothesisError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct InternalState {
    /// As in the laws: small letters, digits and `_`.
    pub name: String,
    /// As in the catalogue.
    pub unit: String,
    /// Law of how fast it changes, its unit per second: in the rig's variables, itself, parameters and constants.
    pub rate: String,
    /// Where it begins: at the start of a run, and long before the start of any piece of one.
    pub start: f64,
}

/// The laws of a hypothesis by their keys in files; the last is how fast its state changes.
pub(super) const LAWS: [&str; 4] = ["arm", "pendulum", "voltage", "state.rate"];
/// A compiled law of each key; of no operations where there is none.
pub(super) type Tapes = [Tape; LAWS.len()];

impl Definition {
    /// Compiles it into an effect, which is kept for the life of the process (once, however often it is compiled).
    ///
    /// # Errors
    /// [`HypothesisError`]: a name, range, unit or law that cannot be, with the character where it is.
    pub fn compile(&self) -> Result<&'static Spec, HypothesisError> {
        self.compile_of(&|_| None)
    }

    /// The same of a file, of which `line` knows where each key's text stands.
    pub(super) fn compile_of(
        &self,
        line: &dyn Fn(&str) -> Option<usize>,
    ) -> Result<&'static Spec, HypothesisError> {
        self.check_texts()?;
        let mark = |key: &str, text: &str, (span, problem): parse::Mistake| {
            HypothesisError::Text(Box::new(Marked {
                id: self.id.clone(),
                key: key.to_owned(),
                line: line(key),
                text: text.to_owned(),
                span,
                problem,
            }))
        };
        let unit = |table: &str, name: &str, text: &str| {
            let no_unit = |span| {
                let known = Unit::known();
                mark(
                    &format!("{table}.{name}.unit"),
                    text,
                    (span, Problem::NoUnit { known }),
                )
            };
            Unit::read(text).map_err(no_unit)
        };
        let parameters = self.ordered()?;
        let named = parameters
            .iter()
            .map(|p| unit("parameters", &p.name, &p.unit).map(|u| (p.name.clone(), u)))
            .collect::<Result<Vec<_>, _>>()?;
        let constants = self
            .constants
            .iter()
            .map(|c| unit("constants", &c.name, &c.unit).map(|u| (c.name.clone(), c.value, u)))
            .collect::<Result<Vec<_>, _>>()?;
        let state = match &self.state {
            None => None,
            Some(state) => {
                let no_unit = |span| {
                    let known = Unit::known();
                    mark("state.unit", &state.unit, (span, Problem::NoUnit { known }))
                };
                let unit = Unit::read(&state.unit).map_err(no_unit)?;
                Some((state.name.as_str(), unit))
            }
        };
        let per_second = state.map_or(Unit::NONE, |(_, unit)| unit.times(Unit::SECOND, -1));
        let units = [Unit::TORQUE, Unit::TORQUE, Unit::VOLT, per_second];
        let mut tapes: Tapes = Default::default();
        for ((key, wanted), tape) in LAWS.into_iter().zip(units).zip(&mut tapes) {
            let Some(text) = self.law(key) else { continue };
            let names = Names {
                parameters: &named,
                constants: &constants,
                state,
                of_voltage: key == "voltage",
            };
            *tape = parse::parse(text, &names, wanted).map_err(|m| mark(key, text, m))?;
        }
        self.check_values(&parameters, &tapes)?;
        Ok(keep(&self.id, &self.to_toml(&parameters), |id, text| {
            let spec = self.spec(id, &parameters, &tapes);
            let [arm, pendulum, voltage, rate] = tapes;
            let state = self.state.as_ref().map(|state| OwnState {
                rate,
                start: state.start,
            });
            let laws = OwnLaws {
                arm,
                pendulum,
                voltage,
                state,
                on_motor: self.side == Side::Motor,
                text,
            };
            (spec, laws)
        }))
    }

    pub(super) fn law(&self, key: &str) -> Option<&str> {
        match key {
            "arm" => self.arm.as_deref(),
            "pendulum" => self.pendulum.as_deref(),
            "voltage" => self.voltage.as_deref(),
            _ => self.state.as_ref().map(|state| state.rate.as_str()),
        }
    }
}
