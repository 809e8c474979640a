//! Whether a hypothesis can be: names, ranges, and whether its laws are off where they should be.

use super::define::{Definition, LAWS, MAX_CONSTANTS, Parameter, Side, Tapes};
use super::error::HypothesisError;
use super::parse;
use super::tape::{Moment, Operation, Variable};
use crate::effects::MAX_PARAMETERS;
use furuta_input::is_printable;

/// Characters of an id, and of a parameter's name.
const ID_LENGTH: usize = 40;
const NAME_LENGTH: usize = 24;
/// Characters of the name in words and of the other sentences.
const SENTENCE_LENGTH: usize = 200;
/// The most starting values of a parameter.
const MAX_STARTS: usize = 5;

impl Definition {
    pub(super) fn value_error(
        &self,
        key: String,
        given: impl ToString,
        wanted: &str,
    ) -> HypothesisError {
        HypothesisError::Value {
            id: self.id.clone(),
            key,
            given: given.to_string(),
            wanted: wanted.to_owned(),
        }
    }

    /// Everything but laws and units.
    pub(super) fn check_texts(&self) -> Result<(), HypothesisError> {
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
        if self.arm.is_none() && self.pendulum.is_none() && self.voltage.is_none() {
            return Err(HypothesisError::NoLaw {
                id: self.id.clone(),
            });
        }
        if self.side == Side::Motor && (self.arm.is_none() || self.pendulum.is_some()) {
            let wanted = "only a law for `arm` acts on the motor's side: write another hypothesis for the pendulum";
            return Err(self.value_error("side".to_owned(), "motor", wanted));
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
        let state = self.state.iter().map(|state| ("state", &state.name));
        let mut seen: Vec<&String> = Vec::new();
        for (table, name) in names.chain(constants).chain(state) {
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
        if let Some(state) = self.state.as_ref().filter(|s| !s.start.is_finite()) {
            return Err(self.value_error("state.start".to_owned(), state.start, "a finite number"));
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
    pub(super) fn ordered(&self) -> Result<Vec<Parameter>, HypothesisError> {
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

    /// Whether the laws have values at a few places, and torques and voltage are off where the strengths are; and
    /// whether a state does anything.
    pub(super) fn check_values(
        &self,
        parameters: &[Parameter],
        tapes: &Tapes,
    ) -> Result<(), HypothesisError> {
        let typical = |p: &Parameter| (p.off + p.typical).clamp(p.min, p.max);
        let on: Vec<f64> = parameters.iter().map(typical).collect();
        let strength = |p: &Parameter| p.strength == Some(true);
        let switched = |p: &Parameter| if strength(p) { p.off } else { typical(p) };
        let off: Vec<f64> = parameters.iter().map(switched).collect();
        let rate = self.state.as_ref().map(|s| format!("{}/s", s.unit.trim()));
        let units = ["N m", "N m", "V", rate.as_deref().unwrap_or("")];
        if let Some(state) = &self.state {
            let of_torque = tapes[..2].iter().flat_map(|t| &t.operations);
            let sees = |o: &Operation| *o == Operation::Variable(Variable::State);
            if !of_torque.into_iter().any(sees) {
                let wanted = "a law for `arm` or `pendulum` must contain it, or it does nothing";
                return Err(self.value_error("state.name".to_owned(), &state.name, wanted));
            }
        }
        let start = self.state.as_ref().map_or(0.0, |s| s.start);
        let moments = PLACES.map(|(theta, alpha, theta_dot, alpha_dot, u, t)| {
            let (sin, cos) = f64::sin_cos(alpha);
            move |state: f64| Moment {
                theta,
                alpha,
                theta_dot,
                alpha_dot,
                u,
                t,
                state,
                angle: [sin, cos],
            }
        });
        let [.., rate] = tapes;
        let moves = (moments.iter()).any(|at| rate.value(&off, &at(start)) != 0.0);
        for (n, (at, (theta, alpha, theta_dot, alpha_dot, u, t))) in
            moments.iter().zip(PLACES).enumerate()
        {
            for ((key, unit), tape) in LAWS.into_iter().zip(units).zip(tapes) {
                let place = || {
                    let state = self.state.as_ref();
                    let state =
                        state.map_or_else(String::new, |s| format!(", {} = {start}", s.name));
                    format!(
                        "theta = {theta} rad, alpha = {alpha} rad, theta_dot = {theta_dot} rad/s, alpha_dot = \
                         {alpha_dot} rad/s, u = {u} V, t = {t} s{state}"
                    )
                };
                let value = tape.value(&on, &at(start));
                if !value.is_finite() {
                    return Err(HypothesisError::NotFinite {
                        id: self.id.clone(),
                        key,
                        value,
                        at: place(),
                    });
                }
                if key == "state.rate" {
                    continue;
                }
                // A state that moves may be anywhere.
                let offset = if moves { OFFSETS[n] } else { 0.0 };
                let mut values = [start, start + offset].map(|z| tape.value(&off, &at(z)));
                values.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
                if values[1] != 0.0 {
                    let strengths = parameters.iter().filter(|p| strength(p));
                    let words = strengths.map(|p| format!("{} = {}", p.name, p.off));
                    return Err(HypothesisError::NotOff {
                        id: self.id.clone(),
                        key,
                        off: words.collect::<Vec<_>>().join(" and "),
                        value: values[1],
                        unit: unit.to_owned(),
                        at: place(),
                    });
                }
            }
        }
        Ok(())
    }
}

/// Where laws are tried: theta, alpha, theta_dot, alpha_dot, u, t.
const PLACES: [(f64, f64, f64, f64, f64, f64); 4] = [
    (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    (0.3, -0.2, 2.0, -3.0, 1.5, 0.7),
    (-1.1, 2.9, -7.0, 11.0, -4.0, 3.0),
    (0.9, -3.0, 0.4, 0.6, 0.2, 12.0),
];

/// How far from its start a state is there as well, in its unit.
const OFFSETS: [f64; PLACES.len()] = [1e-3, -0.2, 0.5, 1.0];
