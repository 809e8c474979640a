//! Hypotheses in TOML: tables `[hypothesis."user.my-drag"]`, in files of their own and in rig files.

use super::define::{Constant, Definition, InternalState, Parameter, Side};
use super::error::HypothesisError;
use crate::effects::Spec;
use furuta_input::{read_text, shown};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;
use toml::Spanned;

/// The most hypotheses of one file.
pub const MAX_HYPOTHESES: usize = 16;

/// One table.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct HypothesisText {
    name: Option<String>,
    experiment: Option<String>,
    arm: Option<Spanned<String>>,
    pendulum: Option<Spanned<String>>,
    voltage: Option<Spanned<String>>,
    #[serde(default)]
    side: Side,
    state: Option<StateText>,
    parameters: BTreeMap<String, ParameterText>,
    #[serde(default)]
    constants: BTreeMap<String, ConstantText>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ParameterText {
    unit: Spanned<String>,
    min: f64,
    max: f64,
    typical: f64,
    #[serde(default)]
    off: f64,
    strength: Option<bool>,
    #[serde(default)]
    starts: Vec<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StateText {
    name: String,
    unit: Spanned<String>,
    rate: Spanned<String>,
    #[serde(default)]
    start: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ConstantText {
    value: f64,
    unit: Spanned<String>,
}

/// A file of hypotheses and nothing else.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileText {
    #[serde(default)]
    hypothesis: BTreeMap<String, HypothesisText>,
}

/// Reads the text of a file of hypotheses: tables `[hypothesis."ID"]`, as rig files have them.
///
/// # Errors
/// [`HypothesisError`], with line and character.
///
/// ```
/// let specs = furuta_model::effects::own::read(
///     r#"
///     [hypothesis."user.eddy-brake"]
///     name = "Eddy-current brake at the arm"
///     arm = "-k*theta_dot/(1 + (theta_dot/v)^2)"
///     parameters.k = { unit = "N m s/rad", min = 0.0, max = 1.0, typical = 1e-4, strength = true }
///     parameters.v = { unit = "rad/s", min = 0.5, max = 100.0, typical = 5.0 }
///     "#,
/// )?;
/// assert_eq!((specs[0].id, specs[0].strengths), ("user.eddy-brake", 1));
/// # Ok::<(), furuta_model::effects::own::HypothesisError>(())
/// ```
pub fn read(text: &str) -> Result<Vec<&'static Spec>, HypothesisError> {
    let file: FileText = toml::from_str(text).map_err(|e| HypothesisError::Syntax {
        line: line_of(text, e.span().map_or(0, |s| s.start)),
        message: e.message().replace('\n', " "),
    })?;
    if file.hypothesis.is_empty() {
        return Err(HypothesisError::Nothing);
    }
    define(text, file.hypothesis)
}

/// Reads a file of hypotheses ([`read`]).
///
/// # Errors
/// [`HypothesisError`], with the file's name.
pub fn load(path: impl AsRef<Path>) -> Result<Vec<&'static Spec>, HypothesisError> {
    let path = path.as_ref();
    let text = read_text(path, "a file of hypotheses")
        .map_err(|e| HypothesisError::Input(e.to_string()))?;
    read(&text).map_err(|error| HypothesisError::InFile {
        file: shown(path),
        error: Box::new(error),
    })
}

/// Compiles the tables of a file's text.
pub(crate) fn define(
    text: &str,
    tables: BTreeMap<String, HypothesisText>,
) -> Result<Vec<&'static Spec>, HypothesisError> {
    if tables.len() > MAX_HYPOTHESES {
        return Err(HypothesisError::TooMany {
            given: tables.len(),
            most: MAX_HYPOTHESES,
        });
    }
    let tables = tables.into_iter();
    tables.map(|(id, table)| table.compile(id, text)).collect()
}

impl HypothesisText {
    fn compile(self, id: String, text: &str) -> Result<&'static Spec, HypothesisError> {
        let mut places: Vec<(String, usize)> = Vec::new();
        let mut placed = |key: String, value: Spanned<String>| {
            places.push((key, line_of(text, value.span().start)));
            value.into_inner()
        };
        let [arm, pendulum, voltage] = [
            ("arm", self.arm),
            ("pendulum", self.pendulum),
            ("voltage", self.voltage),
        ]
        .map(|(key, law)| law.map(|law| placed(key.to_owned(), law)));
        let state = self.state.map(|state| InternalState {
            name: state.name,
            unit: placed("state.unit".to_owned(), state.unit),
            rate: placed("state.rate".to_owned(), state.rate),
            start: state.start,
        });
        let parameters = self.parameters.into_iter().map(|(name, p)| Parameter {
            unit: placed(format!("parameters.{name}.unit"), p.unit),
            name,
            min: p.min,
            max: p.max,
            typical: p.typical,
            off: p.off,
            strength: p.strength,
            starts: p.starts,
        });
        let parameters = parameters.collect();
        let constants = self.constants.into_iter().map(|(name, c)| Constant {
            unit: placed(format!("constants.{name}.unit"), c.unit),
            name,
            value: c.value,
        });
        let constants = constants.collect();
        let definition = Definition {
            id,
            name: self.name.unwrap_or_default(),
            experiment: self.experiment.unwrap_or_default(),
            arm,
            pendulum,
            voltage,
            side: self.side,
            state,
            parameters,
            constants,
        };
        let line = |key: &str| places.iter().find(|(k, _)| k == key).map(|(_, line)| *line);
        definition.compile_of(&line)
    }
}

/// The line of a byte, from 1.
fn line_of(text: &str, byte: usize) -> usize {
    let before = &text.as_bytes()[..byte.min(text.len())];
    before.iter().filter(|b| **b == b'\n').count() + 1
}
