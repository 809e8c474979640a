//! What is wrong with a law of a user's own, with the place in the text.

use super::units::Unit;
use furuta_input::{foreign, is_printable, number, quoted};
use std::fmt::{self, Display, Formatter};
use std::ops::Range;

/// What is wrong with a hypothesis.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum HypothesisError {
    /// Not TOML, an unknown key, a missing key, or a value of the wrong kind.
    #[error("line {line}: {}", foreign(message))]
    Syntax {
        /// Where, from 1.
        line: usize,
        /// What.
        message: String,
    },
    /// A file that cannot be read.
    #[error("{0}")]
    Input(String),
    /// A mistake in a file.
    #[error("{file}: {error}")]
    InFile {
        /// The file's name.
        file: String,
        /// The mistake.
        error: Box<HypothesisError>,
    },
    /// A file without hypotheses.
    #[error(
        "no hypothesis in it: write a table [hypothesis.\"user.my-drag\"] with a law and its parameters"
    )]
    Nothing,
    /// Too many hypotheses at once.
    #[error("{given} hypotheses are too many: at most {most}")]
    TooMany {
        /// How many.
        given: usize,
        /// The most there can be.
        most: usize,
    },
    /// A name that is none.
    #[error(
        "hypothesis `{}`: an id is `user.` and then letters, digits, - or _, at most {most} characters: \
         user.my-drag",
        quoted(id)
    )]
    Id {
        /// As given.
        id: String,
        /// How many characters it may have.
        most: usize,
    },
    /// A hypothesis that does nothing.
    #[error(
        "hypothesis {id}: it has no law; write one for `arm` or `pendulum` (a torque, N m) or `voltage` (added to the \
         command, V)"
    )]
    NoLaw {
        /// Which.
        id: String,
    },
    /// A mistake in a law or a unit.
    #[error("{0}")]
    Text(Box<Marked>),
    /// A parameter or constant that cannot be.
    #[error("hypothesis {id}: {key} = {}: {wanted}", foreign(given))]
    Value {
        /// The hypothesis.
        id: String,
        /// Which key.
        key: String,
        /// What it is.
        given: String,
        /// What it must be.
        wanted: String,
    },
    /// None of several parameters is said to switch the law on.
    #[error(
        "hypothesis {id}: which of its parameters switches it off? Mark it with strength = true; it has {parameters}"
    )]
    NoStrength {
        /// The hypothesis.
        id: String,
        /// Its parameters.
        parameters: String,
    },
    /// A law that acts where its strengths say that it does nothing.
    #[error(
        "hypothesis {id}: with {off} the law of `{key}` is {} {unit} at {at}; it must be 0 there: multiply the law by \
         a strength",
        number(*value)
    )]
    NotOff {
        /// The hypothesis.
        id: String,
        /// Which law.
        key: &'static str,
        /// The strengths and their values.
        off: String,
        /// What the law is.
        value: f64,
        /// In which unit.
        unit: String,
        /// Where.
        at: String,
    },
    /// A law that has no value.
    #[error(
        "hypothesis {id}: with all parameters at their typical sizes the law of `{key}` is {value} at {at}; keep \
         divisors and roots away from 0, and exponents small"
    )]
    NotFinite {
        /// The hypothesis.
        id: String,
        /// Which law.
        key: &'static str,
        /// Not a number, or infinite.
        value: f64,
        /// Where.
        at: String,
    },
}

/// A text with a mistake in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Marked {
    /// The hypothesis.
    pub id: String,
    /// The key whose text it is: `arm`, `parameters.k.unit`.
    pub key: String,
    /// The line of the file, from 1, where it is of a file.
    pub line: Option<usize>,
    /// The text.
    pub text: String,
    /// Which of its bytes are wrong.
    pub span: Range<usize>,
    /// What is wrong with them.
    pub problem: Problem,
}

impl Marked {
    /// Where the mistake begins, in characters from 1.
    #[must_use]
    pub fn column(&self) -> usize {
        self.characters(self.span.start) + 1
    }

    fn characters(&self, byte: usize) -> usize {
        let before = self.text.char_indices().take_while(|(i, _)| *i < byte);
        before.count()
    }
}

impl Display for Marked {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "hypothesis {}, {}", self.id, self.key)?;
        if let Some(line) = self.line {
            write!(f, " (line {line})")?;
        }
        writeln!(f, ", character {}: {}", self.column(), self.problem)?;
        let shown = |c: char| if is_printable(c) { c } else { '?' };
        writeln!(f, "  {}", self.text.chars().map(shown).collect::<String>())?;
        let from = self.characters(self.span.start);
        let wide = (self.characters(self.span.end) - from).max(1);
        write!(f, "  {}{}", " ".repeat(from), "^".repeat(wide))
    }
}

/// What is wrong with a part of a law or of a unit.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    /// Something else is wanted here.
    #[error("{} here, wanted is {wanted}", found_words(*found))]
    Unexpected {
        /// What is there; nothing at the end.
        found: Option<char>,
        /// What is wanted.
        wanted: &'static str,
    },
    /// A name that means nothing.
    #[error(
        "`{}` is no variable, parameter, constant or function; known are {known}",
        quoted(name)
    )]
    UnknownName {
        /// The name.
        name: String,
        /// What there is.
        known: String,
    },
    /// Part of the rig's state, or the law's own, in a law of the voltage.
    #[error(
        "`{name}` is not seen here: a law of the voltage is a map of u and t; write a torque on the arm instead"
    )]
    NotOfVoltage {
        /// The variable.
        name: String,
    },
    /// A number that is none.
    #[error("this is no finite number")]
    Number,
    /// A power that is not a whole number.
    #[error(
        "a power is a whole number from 1 to {most}; sqrt(x) is the root, 1/x^2 a negative power"
    )]
    Power {
        /// The largest.
        most: u8,
    },
    /// A function with too few or too many arguments.
    #[error(
        "{name} takes {wanted} argument(s), here are {given}{}",
        if name == "sign" { ": sign(x, width) is tanh(x/width), smooth, since a jump cannot be integrated" } else { "" }
    )]
    Arguments {
        /// The function.
        name: String,
        /// How many there are.
        given: usize,
        /// How many it takes.
        wanted: usize,
    },
    /// Two parts of unlike units are added or compared.
    #[error(
        "`{right}` is {} and `{left}` {}: only like units can be added or compared",
        right_unit.words(),
        left_unit.words()
    )]
    UnlikeUnits {
        /// The part before.
        left: String,
        /// Its unit.
        left_unit: Unit,
        /// The part that is marked.
        right: String,
        /// Its unit.
        right_unit: Unit,
    },
    /// The argument of a function has a unit.
    #[error("{function} takes a pure number or an angle, `{argument}` is {}", unit.words())]
    NotPure {
        /// The function.
        function: String,
        /// Its argument.
        argument: String,
        /// The argument's unit.
        unit: Unit,
    },
    /// A root of a unit that has none.
    #[error("a root of {unit} has no unit")]
    Root {
        /// The unit.
        unit: Unit,
    },
    /// The whole law has the wrong unit.
    #[error("the law is {}, it must be in {wanted}: a factor in {lacks} is missing", unit.words())]
    WrongUnit {
        /// Its unit.
        unit: Unit,
        /// What it must be.
        wanted: Unit,
        /// Their quotient.
        lacks: Unit,
    },
    /// A unit that is none.
    #[error(
        "this is no unit; write it as N m s2/rad2, with {known}, powers as digits, N m/(rad V), or - for a pure number"
    )]
    NoUnit {
        /// What there is.
        known: String,
    },
    /// Too long a text.
    #[error("the law is longer than {most} characters")]
    TooLong {
        /// How many it may have.
        most: usize,
    },
    /// Too many operations.
    #[error("the law has more than {most} numbers, names and operations")]
    TooManyOperations {
        /// How many it may have.
        most: usize,
    },
    /// Too many open results.
    #[error("the law is nested more than {most} deep: put the longest part first")]
    TooDeep {
        /// How many there may be.
        most: usize,
    },
}

fn found_words(found: Option<char>) -> String {
    match found {
        None => "the law ends".to_owned(),
        Some(c) if is_printable(c) => format!("`{c}` stands"),
        Some(c) => format!("the character U+{:04X} stands", u32::from(c)),
    }
}
