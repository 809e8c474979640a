//! What is wrong with an effect asked for.

use crate::actuation::Actuation;

/// What is wrong with an effect asked for.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum EffectError {
    /// An effect that makes no sense on a rig with this kind of command.
    OtherActuation {
        /// The effect's id.
        effect: &'static str,
        /// What the rig's command is.
        actuation: Actuation,
        /// Why not.
        why: &'static str,
    },
    /// The id is not in the catalogue.
    UnknownEffect,
    /// The number of values differs from the number of parameters.
    WrongCount {
        /// The effect's id.
        effect: &'static str,
        /// How many were given.
        given: usize,
        /// How many it has.
        expected: usize,
    },
    /// A parameter without a default was left out.
    Missing {
        /// The effect's id.
        effect: &'static str,
        /// The parameter's name.
        parameter: &'static str,
        /// Its unit.
        unit: &'static str,
    },
    /// A value outside its range, or not a number.
    OutOfRange {
        /// The effect's id.
        effect: &'static str,
        /// The parameter's name.
        parameter: &'static str,
        /// What was given.
        value: f64,
        /// Lower end of the range.
        min: f64,
        /// Upper end of the range.
        max: f64,
        /// Unit.
        unit: &'static str,
    },
    /// A fraction where a whole number or a place in a list is wanted.
    NotWhole {
        /// The effect's id.
        effect: &'static str,
        /// The parameter's name.
        parameter: &'static str,
        /// What was given.
        value: f64,
        /// Lower end of the range.
        min: f64,
        /// Upper end of the range.
        max: f64,
    },
}

impl core::fmt::Display for EffectError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::UnknownEffect => {
                write!(f, "no such effect in the catalogue, nor an empirical term")
            }
            Self::WrongCount {
                effect,
                given,
                expected,
            } => write!(
                f,
                "{effect} has {expected} parameters, {given} values were given"
            ),
            Self::Missing {
                effect,
                parameter,
                unit,
            } => write!(f, "{effect} lacks {parameter} ({unit}): give it a value"),
            Self::OutOfRange {
                effect,
                parameter,
                value,
                min,
                max,
                unit,
            } => write!(
                f,
                "{effect}: {parameter} = {} is outside the allowed range [{min}, {max}] {unit}",
                furuta_input::number(*value)
            ),
            Self::OtherActuation {
                effect,
                actuation,
                why,
            } => write!(
                f,
                "{effect} cannot act on a rig whose motor.kind is \"{actuation}\" ({why}): leave it out"
            ),
            Self::NotWhole {
                effect,
                parameter,
                value,
                min,
                max,
            } => write!(
                f,
                "{effect}: {parameter} = {} must be a whole number in [{min}, {max}]",
                furuta_input::number(*value)
            ),
        }
    }
}

impl core::error::Error for EffectError {}
