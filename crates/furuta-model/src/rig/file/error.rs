//! What is wrong with a rig file.

use crate::actuation::Actuation;
use crate::effects::EffectError;
use crate::effects::own::HypothesisError;
use crate::params::ParamError;
use crate::plant::PlantError;
use furuta_input::{InputError, foreign, number, quoted};

/// What is wrong with a rig file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RigError {
    /// Neither a built-in rig nor a file that can be read.
    #[error(
        "rig `{}`: cannot be read ({source}); give a file, or one of the built-in rigs: {builtin}",
        quoted(path)
    )]
    Unreadable {
        /// What was asked for.
        path: String,
        /// The built-in names.
        builtin: String,
        /// Why not.
        source: std::io::Error,
    },
    /// No file of text, or too large a one.
    #[error(transparent)]
    Input(#[from] InputError),
    /// Not TOML, an unknown key, a missing key, or a value of the wrong kind.
    #[error("rig file, line {line}: {}", foreign(message))]
    Syntax {
        /// Where, from 1.
        line: usize,
        /// What.
        message: String,
    },
    /// A kind of command that there is not, or one in a unit that it has not.
    #[error(
        "rig file: motor.kind = \"{}\"{} is not known: write \"voltage\" (V), \"torque\" (unit = \"A\" or \"N m\") or \
         \"acceleration\" (rad/s2)",
        quoted(kind),
        if unit.is_empty() { String::new() } else { format!(" with unit = \"{}\"", quoted(unit)) }
    )]
    UnknownActuation {
        /// As written.
        kind: String,
        /// As written; empty where it is left out.
        unit: String,
    },
    /// A key that rigs of this kind of command need.
    #[error("rig file: {key} is missing: a rig whose motor.kind is \"{actuation}\" needs it")]
    Missing {
        /// Which.
        key: &'static str,
        /// What the rig's command is.
        actuation: Actuation,
    },
    /// A key that stands in no equation of rigs of this kind of command.
    #[error(
        "rig file: {key} does not enter the equations of a rig whose motor.kind is \"{actuation}\": leave it out"
    )]
    DoesNotEnter {
        /// Which.
        key: &'static str,
        /// What the rig's command is.
        actuation: Actuation,
    },
    /// A physical parameter outside its range.
    #[error("rig file: {0}; values are in SI units")]
    Parameter(#[from] ParamError),
    /// A sensor or limit outside its range.
    #[error("rig file: {key} = {} is outside the allowed range [{min}, {max}]", number(*value))]
    OutOfRange {
        /// Which.
        key: &'static str,
        /// What it was.
        value: f64,
        /// Lower end.
        min: f64,
        /// Upper end.
        max: f64,
    },
    /// The tolerance of a number that no sheet has.
    #[error(
        "rig file: [tolerance] has `{}`, which is no parameter of a rig; write {known}",
        quoted(key)
    )]
    UnknownTolerance {
        /// As written.
        key: String,
        /// What there is.
        known: String,
    },
    /// A tolerance that is none.
    #[error(
        "rig file: [tolerance] {key} = {} is outside the allowed range [{min}, {max}]; it is one standard deviation \
         as a share of the value: 0.02 is 2 %",
        number(*share)
    )]
    Tolerance {
        /// Of which parameter.
        key: &'static str,
        /// What it was.
        share: f64,
        /// Lower end.
        min: f64,
        /// Upper end.
        max: f64,
    },
    /// A name or source that no terminal can show.
    #[error(
        "rig file: {key} = `{}` has characters that are not printable; use letters, digits, signs and \
         spaces, at most {most}",
        quoted(text)
    )]
    NotPrintable {
        /// Which.
        key: &'static str,
        /// What it was.
        text: String,
        /// How many characters it may have.
        most: usize,
    },
    /// An effect's id without quotation marks, whose dot then divides tables.
    #[error(
        "rig file: [effects.{}] needs quotation marks, for the id has a dot in it: write [effects.\"{}\"]",
        quoted(id),
        quoted(id)
    )]
    UnquotedEffect {
        /// The id as written.
        id: String,
    },
    /// An effect that the catalogue does not have.
    #[error(
        "rig file: effect `{}` is not in the catalogue; known are {known}",
        quoted(id)
    )]
    UnknownEffect {
        /// Its id.
        id: String,
        /// The ids there are.
        known: String,
    },
    /// An effect of a user's own without its law.
    #[error(
        "rig file: effect `{}` is a law of one's own, which a table [hypothesis.\"{}\"] of the same file has to say",
        quoted(id),
        quoted(id)
    )]
    NoHypothesis {
        /// Its id.
        id: String,
    },
    /// A law of a user's own that cannot be.
    #[error("rig file: {0}")]
    Hypothesis(#[from] HypothesisError),
    /// An effect's parameter that it does not have, or lacks.
    #[error(
        "rig file: effect `{}` {problem} `{}`; it has {known}",
        quoted(id),
        quoted(parameter)
    )]
    EffectParameter {
        /// The effect.
        id: String,
        /// `has no parameter` or `lacks`.
        problem: &'static str,
        /// The parameter.
        parameter: String,
        /// What it has.
        known: String,
    },
    /// A word where an effect wants a number, or another word.
    #[error(
        "rig file: effect `{}`: {parameter} = \"{}\" must be {wanted}",
        quoted(id),
        quoted(word)
    )]
    EffectWord {
        /// The effect.
        id: String,
        /// The parameter.
        parameter: &'static str,
        /// What was given.
        word: String,
        /// What it can be.
        wanted: String,
    },
    /// An effect's value outside its range.
    #[error("rig file: effect {0}")]
    Effect(#[from] EffectError),
    /// More effects than a plant can hold.
    #[error("rig file: {0}")]
    Plant(#[from] PlantError),
    /// Any of these in a file with a name.
    #[error("{}: {error}", quoted(path))]
    InFile {
        /// The file.
        path: String,
        /// What is wrong in it.
        error: Box<RigError>,
    },
}

impl RigError {
    /// The same error, naming the file.
    #[must_use]
    pub fn in_file(self, path: &str) -> Self {
        Self::InFile {
            path: path.to_owned(),
            error: Box::new(self),
        }
    }
}
