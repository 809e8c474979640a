//! Rig files: TOML in, TOML out, every mistake named with its key.

mod error;
mod motor;
#[cfg(test)]
mod tests;

pub use error::RigError;

use super::{Limits, Rig, Sensors, Tolerance};
use crate::effects::own::{HypothesisText, define_text};
use crate::effects::{self, Effect, Kind, MAX_PARAMETERS, Spec};
use crate::params::{Arm, Params, Pendulum, RANGES};
use crate::plant::{MAX_EFFECTS, PlantError};
use furuta_input::is_printable;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fmt::Write as _;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileText {
    rig: RigText,
    arm: ArmText,
    pendulum: PendulumText,
    motor: MotorText,
    sensors: SensorsText,
    environment: EnvironmentText,
    limits: Option<LimitsText>,
    tolerance: Option<BTreeMap<String, BTreeMap<String, f64>>>,
    effects: Option<BTreeMap<String, BTreeMap<String, ValueText>>>,
    hypothesis: Option<BTreeMap<String, HypothesisText>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RigText {
    name: String,
    source: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ArmText {
    length: f64,
    inertia: Option<f64>,
    viscous: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PendulumText {
    mass: f64,
    com: f64,
    inertia: f64,
    inertia_transverse: Option<f64>,
    inertia_axial: Option<f64>,
    viscous: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MotorText {
    kind: Option<String>,
    unit: Option<String>,
    resistance: Option<f64>,
    torque_constant: Option<f64>,
    back_emf_constant: Option<f64>,
    gear_ratio: Option<f64>,
    efficiency: Option<f64>,
    amplifier_gain: Option<f64>,
    command_limit: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SensorsText {
    arm_counts_per_rev: f64,
    pendulum_counts_per_rev: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EnvironmentText {
    gravity: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LimitsText {
    arm_angle: Option<f64>,
    arm_speed: Option<f64>,
    pendulum_speed: Option<f64>,
}

/// An effect's value: a number, or one of a few words. A table stands there where the effect's id has no quotation
/// marks.
#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "the value of an effect must be a number or a word in quotation marks"
)]
enum ValueText {
    Number(f64),
    Word(String),
    Table {},
}

/// Characters of a rig's name, and of what it says of its source.
const NAME_LENGTH: usize = 80;
const SOURCE_LENGTH: usize = 4000;

/// The text, if a terminal can show it.
fn printable(key: &'static str, text: String, most: usize) -> Result<String, RigError> {
    let shown = |c: char| is_printable(c) || c == '\n' && most > NAME_LENGTH;
    if text.chars().count() <= most && text.chars().all(shown) {
        Ok(text)
    } else {
        Err(RigError::NotPrintable { key, text, most })
    }
}

pub(super) fn parse(text: &str) -> Result<Rig, RigError> {
    let file: FileText = toml::from_str(text).map_err(|e| syntax(text, &e))?;
    let p = &file.pendulum;
    let motor = motor::parse(&file)?;
    let params = Params {
        arm: Arm {
            length: file.arm.length,
            inertia: file.arm.inertia.unwrap_or(1.0),
            viscous: file.arm.viscous.unwrap_or(0.0),
        },
        pendulum: Pendulum {
            mass: p.mass,
            com: p.com,
            inertia: p.inertia,
            inertia_transverse: p.inertia_transverse.unwrap_or(p.inertia),
            inertia_axial: p.inertia_axial.unwrap_or(0.0),
            viscous: p.viscous,
        },
        motor,
        gravity: file.environment.gravity,
    };
    params.validate()?;
    let sensors = Sensors {
        arm_counts_per_rev: within(
            "sensors.arm_counts_per_rev",
            file.sensors.arm_counts_per_rev,
            4.0,
            1e8,
        )?,
        pendulum_counts_per_rev: within(
            "sensors.pendulum_counts_per_rev",
            file.sensors.pendulum_counts_per_rev,
            4.0,
            1e8,
        )?,
    };
    let limit = |key, value: Option<f64>, max| value.map(|v| within(key, v, 1e-3, max)).transpose();
    let limits = match &file.limits {
        None => Limits::default(),
        Some(l) => Limits {
            arm_angle: limit("limits.arm_angle", l.arm_angle, 1e3)?,
            arm_speed: limit("limits.arm_speed", l.arm_speed, 1e4)?,
            pendulum_speed: limit("limits.pendulum_speed", l.pendulum_speed, 1e4)?,
        },
    };
    let mut tolerance = Tolerance::default();
    for (table, shares) in file.tolerance.iter().flatten() {
        for (key, share) in shares {
            tolerance.set(&format!("{table}.{key}"), *share)?;
        }
    }
    let own = define_text(text, file.hypothesis.unwrap_or_default())?;
    let effects = file
        .effects
        .unwrap_or_default()
        .iter()
        .map(|(id, values)| effect(id, values, &own))
        .collect::<Result<Vec<_>, _>>()?;
    if effects.len() > MAX_EFFECTS {
        return Err(PlantError::TooManyEffects {
            given: effects.len(),
        }
        .into());
    }
    for effect in &effects {
        effect.validate_for(params.motor.actuation)?;
    }
    Ok(Rig {
        name: printable("rig.name", file.rig.name, NAME_LENGTH)?,
        source: printable(
            "rig.source",
            file.rig.source.unwrap_or_default(),
            SOURCE_LENGTH,
        )?,
        params,
        sensors,
        limits,
        tolerance,
        effects,
    })
}

fn within(key: &'static str, value: f64, min: f64, max: f64) -> Result<f64, RigError> {
    if value >= min && value <= max {
        Ok(value)
    } else {
        Err(RigError::OutOfRange {
            key,
            value,
            min,
            max,
        })
    }
}

/// `own` are the hypotheses of the same file: a rig file says itself what its effects are.
fn effect(
    id: &str,
    values: &BTreeMap<String, ValueText>,
    own: &[&'static Spec],
) -> Result<Effect<f64>, RigError> {
    if let Some((rest, _)) = values
        .iter()
        .find(|(_, value)| matches!(value, ValueText::Table {}))
    {
        return Err(RigError::UnquotedEffect {
            id: format!("{id}.{rest}"),
        });
    }
    let catalogue = || effects::known().find(|s| s.id == id);
    let known = own.iter().copied().find(|s| s.id == id);
    if known.is_none() && id.starts_with("user.") {
        return Err(RigError::NoHypothesis { id: id.to_owned() });
    }
    let known = known.or_else(catalogue);
    let spec = known.ok_or_else(|| RigError::UnknownEffect {
        id: id.to_owned(),
        known: effects::known()
            .map(|s| s.id)
            .collect::<Vec<_>>()
            .join(", "),
    })?;
    let wrong = |problem, parameter: &str| RigError::EffectParameter {
        id: id.to_owned(),
        problem,
        parameter: parameter.to_owned(),
        known: spec
            .parameters
            .iter()
            .map(|p| format!("{} [{}]", p.name, p.unit))
            .collect::<Vec<_>>()
            .join(", "),
    };
    if let Some(unknown) = values
        .keys()
        .find(|k| spec.parameters.iter().all(|p| p.name != **k))
    {
        return Err(wrong("has no parameter", unknown));
    }
    let list = spec
        .parameters
        .iter()
        .map(|p| match values.get(p.name) {
            Some(ValueText::Number(value)) => Ok(*value),
            Some(ValueText::Table {}) => Err(wrong("has a table for", p.name)),
            Some(ValueText::Word(word)) => p.choice(word).ok_or_else(|| RigError::EffectWord {
                id: id.to_owned(),
                parameter: p.name,
                word: word.clone(),
                wanted: wanted(p),
            }),
            None => p.default.ok_or_else(|| wrong("lacks", p.name)),
        })
        .collect::<Result<arrayvec::ArrayVec<f64, MAX_PARAMETERS>, _>>()?;
    Ok(Effect::checked(spec, &list)?)
}

fn wanted(p: &effects::ParameterSpec) -> String {
    match p.kind {
        Kind::Choice(words) => words
            .iter()
            .map(|w| format!("\"{w}\""))
            .collect::<Vec<_>>()
            .join(" or "),
        _ => "a number".to_owned(),
    }
}

fn syntax(text: &str, e: &toml::de::Error) -> RigError {
    let start = e.span().map_or(0, |s| s.start.min(text.len()));
    RigError::Syntax {
        line: text.as_bytes()[..start]
            .iter()
            .filter(|b| **b == b'\n')
            .count()
            + 1,
        message: e.message().replace('\n', " "),
    }
}

pub(super) fn write(rig: &Rig) -> String {
    let mut out = String::new();
    // Writing to a String cannot fail.
    let _ = writeln!(
        out,
        "[rig]\nname = {}",
        toml::Value::from(rig.name.as_str())
    );
    if !rig.source.is_empty() {
        let _ = writeln!(out, "source = {}", toml::Value::from(rig.source.as_str()));
    }
    let mut section = "";
    let actuation = rig.params.motor.actuation;
    for (range, value) in RANGES.iter().zip(rig.params.to_array()) {
        if !actuation.uses(range.key) {
            continue;
        }
        let (table, key) = range.key.split_once('.').unwrap_or(("", range.key));
        if table != section {
            if table == "environment" {
                let s = &rig.sensors;
                let _ = writeln!(
                    out,
                    "\n[sensors]\narm_counts_per_rev = {:?}\npendulum_counts_per_rev = {:?}",
                    s.arm_counts_per_rev, s.pendulum_counts_per_rev
                );
            }
            let _ = writeln!(out, "\n[{table}]");
            if table == "motor" {
                out.push_str(&motor::written(actuation));
            }
            section = table;
        }
        let _ = writeln!(out, "{key} = {value:?}   # {}", range.unit_for(actuation));
    }
    let l = &rig.limits;
    let limits = [
        ("arm_angle", l.arm_angle),
        ("arm_speed", l.arm_speed),
        ("pendulum_speed", l.pendulum_speed),
    ];
    if limits.iter().any(|(_, v)| v.is_some()) {
        let _ = writeln!(out, "\n[limits]");
        for (key, value) in limits {
            if let Some(value) = value {
                let _ = writeln!(out, "{key} = {value:?}");
            }
        }
    }
    let mut stated = rig.tolerance.stated().peekable();
    if stated.peek().is_some() {
        let _ = writeln!(
            out,
            "\n[tolerance]   # one standard deviation, a share of the value"
        );
    }
    for (key, share) in stated {
        let _ = writeln!(out, "{key} = {share:?}");
    }
    for e in &rig.effects {
        let spec = e.spec();
        if let Some(laws) = spec.own {
            let _ = write!(out, "\n[hypothesis.\"{}\"]\n{}", spec.id, laws.text());
        }
        let _ = writeln!(out, "\n[effects.\"{}\"]   # {}", spec.id, spec.name);
        for (p, v) in spec.parameters.iter().zip(e.values()) {
            let _ = match p.word(v) {
                Some(word) => writeln!(out, "{} = \"{word}\"", p.name),
                None => writeln!(out, "{} = {v:?}   # {}", p.name, actuation.unit_of(p.unit)),
            };
        }
    }
    out
}
