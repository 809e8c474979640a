//! One value of a controller file: from TOML to numbers and back.

use crate::section::{ParameterSpec, Shape};
use toml::Value;

/// A number, with or without a decimal point.
#[allow(clippy::cast_precision_loss)] // whole numbers beyond 2^53 are out of every range
pub(super) fn number(value: &Value) -> Option<f64> {
    value
        .as_float()
        .or_else(|| value.as_integer().map(|i| i as f64))
}

/// The numbers of a parameter from what a file holds; `None` where it is of the wrong type.
#[allow(clippy::cast_precision_loss)]
pub(super) fn numbers(p: &ParameterSpec, value: &Value) -> Option<Vec<f64>> {
    match p.shape {
        Shape::Number | Shape::Whole => number(value).map(|x| vec![x]),
        Shape::Numbers(_) => value.as_array()?.iter().map(number).collect(),
        Shape::Switch => value.as_bool().map(|on| vec![f64::from(u8::from(on))]),
        Shape::Word(words) => {
            let word = value.as_str()?;
            let place = words.iter().position(|w| *w == word)?;
            Some(vec![place as f64])
        }
    }
}

/// What a file must hold for a parameter.
pub(super) fn wanted(shape: Shape) -> String {
    match shape {
        Shape::Number => "a number".to_owned(),
        Shape::Numbers(n) => format!("a list of {n} numbers, [..., ...]"),
        Shape::Whole => "a whole number".to_owned(),
        Shape::Switch => "true or false".to_owned(),
        Shape::Word(words) => format!("one of \"{}\"", words.join("\", \"")),
    }
}

/// A parameter's numbers as a file holds them.
pub(super) fn written(p: &ParameterSpec, values: &[f64]) -> String {
    let first = values.first().copied().unwrap_or_default();
    match p.shape {
        Shape::Number => format!("{first:?}"),
        Shape::Numbers(_) => format!("{values:?}"),
        Shape::Whole => format!("{first:.0}"),
        Shape::Switch => (first == 1.0).to_string(),
        Shape::Word(_) => format!("\"{}\"", p.shape.word(first).unwrap_or_default()),
    }
}
