//! From what a user writes to an effect: names, ranges, laws, and whether the law is off where it should be.

use super::error::{HypothesisError, Marked};
use super::parse::{self, Names};
use super::registry::{keep, leak};
use super::tape::{Moment, Operation, Tape, Variable};
use super::units::Unit;
use super::{OwnLaws, Problem};
use crate::effects::{Acts, AtRest, Footprint, Kind, MAX_PARAMETERS, ParameterSpec, Spec, Typical};
use furuta_input::is_printable;
use std::fmt::Write as _;

/// The most constants of one hypothesis.
pub const MAX_CONSTANTS: usize = 8;
/// Characters of an id, and of a parameter's name.
const ID_LENGTH: usize = 40;
const NAME_LENGTH: usize = 24;
/// Characters of the name in words and of the other sentences.
const SENTENCE_LENGTH: usize = 200;
/// The most starting values of a parameter.
const MAX_STARTS: usize = 5;

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

/// The laws of a hypothesis: key in files, unit.
const LAWS: [(&str, Unit, &str); 3] = [
    ("arm", Unit::TORQUE, "N m"),
    ("pendulum", Unit::TORQUE, "N m"),
    ("voltage", Unit::VOLT, "V"),
];

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
        let mut tapes: [Tape; 3] = Default::default();
        for ((key, wanted, _), tape) in LAWS.into_iter().zip(&mut tapes) {
            let Some(text) = self.law(key) else { continue };
            let names = Names {
                parameters: &named,
                constants: &constants,
                of_voltage: key == "voltage",
            };
            *tape = parse::parse(text, &names, wanted).map_err(|m| mark(key, text, m))?;
        }
        self.check_values(&parameters, &tapes)?;
        Ok(keep(&self.id, &self.to_toml(&parameters), |id, text| {
            let spec = self.spec(id, &parameters, &tapes);
            let [arm, pendulum, voltage] = tapes;
            let laws = OwnLaws {
                arm,
                pendulum,
                voltage,
                text,
            };
            (spec, laws)
        }))
    }

    fn law(&self, key: &str) -> Option<&str> {
        match key {
            "arm" => self.arm.as_deref(),
            "pendulum" => self.pendulum.as_deref(),
            _ => self.voltage.as_deref(),
        }
    }

    fn value_error(&self, key: String, given: impl ToString, wanted: &str) -> HypothesisError {
        HypothesisError::Value {
            id: self.id.clone(),
            key,
            given: given.to_string(),
            wanted: wanted.to_owned(),
        }
    }

    /// Everything but laws and units.
    fn check_texts(&self) -> Result<(), HypothesisError> {
        let letters = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "-_".contains(c);
        let own = self.id.strip_prefix("user.").unwrap_or("");
        let is_id = own.starts_with(|c: char| c.is_ascii_lowercase()) && own.chars().all(letters);
        if !is_id || self.id.len() > ID_LENGTH {
            return Err(HypothesisError::Id {
                id: self.id.clone(),
                most: ID_LENGTH,
            });
        }
        for (key, text) in [("name", &self.name), ("experiment", &self.experiment)] {
            if text.chars().count() > SENTENCE_LENGTH || !text.chars().all(is_printable) {
                let wanted = format!("one line of at most {SENTENCE_LENGTH} printable characters");
                return Err(self.value_error(key.to_owned(), text, &wanted));
            }
        }
        if LAWS.iter().all(|(key, ..)| self.law(key).is_none()) {
            return Err(HypothesisError::NoLaw {
                id: self.id.clone(),
            });
        }
        let (most, given) = (MAX_PARAMETERS, self.parameters.len());
        if !(1..=most).contains(&given) {
            let wanted = format!(
                "a hypothesis has 1 to {most} parameters; numbers that are not fitted are constants"
            );
            return Err(self.value_error("number of parameters".to_owned(), given, &wanted));
        }
        if self.constants.len() > MAX_CONSTANTS {
            let wanted = format!("at most {MAX_CONSTANTS}");
            let given = self.constants.len();
            return Err(self.value_error("number of constants".to_owned(), given, &wanted));
        }
        let constants = self.constants.iter().map(|c| ("constants", &c.name));
        let names = self.parameters.iter().map(|p| ("parameters", &p.name));
        let mut seen: Vec<&String> = Vec::new();
        for (table, name) in names.chain(constants) {
            let fits = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
            let key = format!("name in {table}");
            if !name.starts_with(|c: char| c.is_ascii_lowercase())
                || !name.chars().all(fits)
                || name.len() > NAME_LENGTH
            {
                let wanted = format!(
                    "a small letter and then small letters, digits or _, at most {NAME_LENGTH} characters"
                );
                return Err(self.value_error(key, name, &wanted));
            }
            if parse::is_taken(name) || seen.contains(&name) {
                return Err(self.value_error(key, name, "that name means something else already"));
            }
            seen.push(name);
        }
        if let Some(c) = self.constants.iter().find(|c| !c.value.is_finite()) {
            let key = format!("constants.{}.value", c.name);
            return Err(self.value_error(key, c.value, "a finite number"));
        }
        for p in &self.parameters {
            let key = |key: &str| format!("parameters.{}.{key}", p.name);
            if !(p.min.is_finite() && p.max.is_finite() && p.min < p.max) {
                let range = format!("[{}, {}]", p.min, p.max);
                return Err(self.value_error(
                    key("range"),
                    range,
                    "min and max are finite, min below max",
                ));
            }
            if !(p.typical > 0.0 && p.typical.is_finite()) {
                let wanted = "a positive number: a size that would be noticed";
                return Err(self.value_error(key("typical"), p.typical, wanted));
            }
            let inside = |x: f64| x >= p.min && x <= p.max;
            if !p.off.is_finite() || (p.strength == Some(true) && !inside(p.off)) {
                return Err(self.value_error(key("off"), p.off, "a number within min and max"));
            }
            if let Some(start) = p.starts.iter().find(|x| !inside(**x)) {
                return Err(self.value_error(key("starts"), start, "numbers within min and max"));
            }
            if p.starts.len() > MAX_STARTS {
                let wanted = format!("at most {MAX_STARTS} numbers");
                return Err(self.value_error(key("starts"), p.starts.len(), &wanted));
            }
        }
        Ok(())
    }

    /// The parameters, strengths first.
    fn ordered(&self) -> Result<Vec<Parameter>, HypothesisError> {
        let mut all = self.parameters.clone();
        if let [only] = &mut all[..] {
            only.strength = only.strength.or(Some(true));
        }
        all.sort_by_key(|p| p.strength != Some(true));
        if all.iter().all(|p| p.strength != Some(true)) {
            let names = all.iter().map(|p| p.name.as_str());
            return Err(HypothesisError::NoStrength {
                id: self.id.clone(),
                parameters: names.collect::<Vec<_>>().join(", "),
            });
        }
        if let Some(p) = all
            .iter()
            .find(|p| p.strength == Some(true) && !(p.off >= p.min && p.off <= p.max))
        {
            let key = format!("parameters.{}.off", p.name);
            let wanted = "a strength can be off: let off lie within min and max";
            return Err(self.value_error(key, p.off, wanted));
        }
        Ok(all)
    }

    /// Whether the laws have values at a few places, and are off where their strengths are.
    fn check_values(
        &self,
        parameters: &[Parameter],
        tapes: &[Tape; 3],
    ) -> Result<(), HypothesisError> {
        let typical = |p: &Parameter| (p.off + p.typical).clamp(p.min, p.max);
        let on: Vec<f64> = parameters.iter().map(typical).collect();
        let strength = |p: &Parameter| p.strength == Some(true);
        let switched = |p: &Parameter| if strength(p) { p.off } else { typical(p) };
        let off: Vec<f64> = parameters.iter().map(switched).collect();
        for (theta, alpha, theta_dot, alpha_dot, u, t) in PLACES {
            let (sin, cos) = f64::sin_cos(alpha);
            let at = Moment {
                theta,
                alpha,
                theta_dot,
                alpha_dot,
                u,
                t,
                angle: [sin, cos],
            };
            for ((key, _, unit), tape) in LAWS.into_iter().zip(tapes) {
                let place = || {
                    format!(
                        "theta = {theta} rad, alpha = {alpha} rad, theta_dot = {theta_dot} rad/s, alpha_dot = \
                         {alpha_dot} rad/s, u = {u} V, t = {t} s"
                    )
                };
                let value = tape.value(&on, &at);
                if !value.is_finite() {
                    return Err(HypothesisError::NotFinite {
                        id: self.id.clone(),
                        key,
                        value,
                        at: place(),
                    });
                }
                let value = tape.value(&off, &at);
                if value != 0.0 {
                    let strengths = parameters.iter().filter(|p| strength(p));
                    let words = strengths.map(|p| format!("{} = {}", p.name, p.off));
                    return Err(HypothesisError::NotOff {
                        id: self.id.clone(),
                        key,
                        off: words.collect::<Vec<_>>().join(" and "),
                        value,
                        unit,
                        at: place(),
                    });
                }
            }
        }
        Ok(())
    }

    fn spec(&self, id: &'static str, parameters: &[Parameter], tapes: &[Tape; 3]) -> Spec {
        let name = if self.name.is_empty() {
            id
        } else {
            leak(&self.name)
        };
        let laws = LAWS.iter().filter_map(|(key, ..)| {
            let text = self.law(key)?;
            Some(format!("{key}: {text}"))
        });
        let uses = |wanted: &[Variable]| {
            let all = tapes.iter().flat_map(|t| &t.operations);
            let mut seen = all.filter_map(|o| match o {
                Operation::Variable(v) => Some(v),
                _ => None,
            });
            seen.any(|v| wanted.contains(v))
        };
        let kinked = |o: &Operation| matches!(o, Operation::Abs | Operation::Min | Operation::Max);
        let [arm, pendulum, voltage] = tapes.each_ref().map(|t| !t.operations.is_empty());
        let mut acts = Acts::NOWHERE;
        if arm || pendulum {
            acts = acts.and(Acts::TORQUE);
        }
        if voltage {
            acts = acts.and(Acts::VOLTAGE);
        }
        if uses(&[Variable::Theta]) {
            acts = acts.and(Acts::ANGLE);
        }
        Spec {
            id,
            name,
            law: leak(&laws.collect::<Vec<_>>().join("; ")),
            sentence: "A law that the user wrote; what it stands for is in its name and its text.",
            shows: "What is left of the gap follows the law.",
            experiment: if self.experiment.is_empty() {
                "motions in which its law differs most from what it could be confused with"
            } else {
                leak(&self.experiment)
            },
            look_alikes: &[],
            strengths: parameters
                .iter()
                .filter(|p| p.strength == Some(true))
                .count(),
            parameters: Vec::leak(parameters.iter().map(parameter).collect()),
            footprint: Footprint::Nothing(
                "a law of the user's own is looked for in motions, not in frequency responses",
            ),
            acts,
            at_rest: if uses(&[Variable::T]) {
                AtRest::UNCOMMANDED
            } else if tapes[2].operations.iter().any(kinked) {
                AtRest::KINKED
            } else {
                AtRest::Slope
            },
            own: None,
            offered: crate::effects::Offered::OnRequest("it is a user's own law"),
        }
    }

    /// The lines of its table in a file: what is written can be read, and is the same.
    fn to_toml(&self, parameters: &[Parameter]) -> String {
        let mut out = String::new();
        let text = |s: &str| toml::Value::from(s).to_string();
        // Writing to a String cannot fail.
        for (key, value) in [("name", &self.name), ("experiment", &self.experiment)] {
            if !value.is_empty() {
                let _ = writeln!(out, "{key} = {}", text(value));
            }
        }
        for (key, ..) in LAWS {
            if let Some(law) = self.law(key) {
                let _ = writeln!(out, "{key} = {}", text(law));
            }
        }
        for p in parameters {
            let _ = write!(
                out,
                "parameters.{} = {{ unit = {}, min = {:?}, max = {:?}, typical = {:?}",
                p.name,
                text(&p.unit),
                p.min,
                p.max,
                p.typical
            );
            if p.off != 0.0 {
                let _ = write!(out, ", off = {:?}", p.off);
            }
            if p.strength == Some(true) {
                let _ = write!(out, ", strength = true");
            }
            if !p.starts.is_empty() {
                let _ = write!(out, ", starts = {:?}", p.starts);
            }
            let _ = writeln!(out, " }}");
        }
        for c in &self.constants {
            let _ = writeln!(
                out,
                "constants.{} = {{ value = {:?}, unit = {} }}",
                c.name,
                c.value,
                text(&c.unit)
            );
        }
        out
    }
}

/// Where laws are tried: theta, alpha, theta_dot, alpha_dot, u, t.
const PLACES: [(f64, f64, f64, f64, f64, f64); 4] = [
    (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    (0.3, -0.2, 2.0, -3.0, 1.5, 0.7),
    (-1.1, 2.9, -7.0, 11.0, -4.0, 3.0),
    (0.9, -3.0, 0.4, 0.6, 0.2, 12.0),
];

/// What a search knows of a parameter.
fn parameter(p: &Parameter) -> ParameterSpec {
    let multiples = |x: &f64| (x - p.off) / p.typical;
    let starts: &'static [f64] = if !p.starts.is_empty() {
        Vec::leak(p.starts.iter().map(multiples).collect())
    } else if p.strength != Some(true) {
        &[1.0]
    } else if p.min >= p.off {
        &[0.3]
    } else if p.max <= p.off {
        &[-0.3]
    } else {
        &[0.0]
    };
    ParameterSpec {
        name: leak(&p.name),
        unit: leak(p.unit.trim()),
        kind: Kind::Real,
        default: None,
        min: p.min,
        max: p.max,
        off: p.off,
        typical: Typical::Is(p.typical),
        starts,
    }
}
