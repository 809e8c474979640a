//! Reads a law: `-k*theta_dot*abs(theta_dot)` becomes a [`Tape`], its units checked on the way.

use super::error::Problem;
use super::tape::{MAX_DEPTH, MAX_OPERATIONS, Operation, Tape, Variable};
use super::units::Unit;
use std::ops::Range;

/// Characters of one law.
pub(super) const MAX_LENGTH: usize = 400;
/// The largest whole power.
const MAX_POWER: u8 = 9;

/// What a law can read of the rig, with units.
static VARIABLES: [(&str, Operation, Unit); 6] = [
    ("theta", Operation::Variable(Variable::Theta), Unit::RADIAN),
    ("alpha", Operation::Variable(Variable::Alpha), Unit::RADIAN),
    (
        "theta_dot",
        Operation::Variable(Variable::ThetaDot),
        Unit::SPEED,
    ),
    (
        "alpha_dot",
        Operation::Variable(Variable::AlphaDot),
        Unit::SPEED,
    ),
    ("u", Operation::Variable(Variable::U), Unit::VOLT),
    ("t", Operation::Variable(Variable::T), Unit::SECOND),
];

/// Functions, with how many arguments each takes.
static FUNCTIONS: [(&str, usize); 9] = [
    ("sin", 1),
    ("cos", 1),
    ("tanh", 1),
    ("exp", 1),
    ("sqrt", 1),
    ("abs", 1),
    ("min", 2),
    ("max", 2),
    ("sign", 2),
];

/// Whether a parameter cannot have this name, because something else has it.
pub(super) fn is_taken(name: &str) -> bool {
    name == "pi"
        || VARIABLES.iter().any(|(word, ..)| *word == name)
        || FUNCTIONS.iter().any(|(word, _)| *word == name)
}

/// What a law's names mean beside the rig's variables.
pub(super) struct Names<'a> {
    pub(super) parameters: &'a [(String, Unit)],
    pub(super) constants: &'a [(String, f64, Unit)],
    /// The state, where the hypothesis has one.
    pub(super) state: Option<(&'a str, Unit)>,
    /// Whether it maps the voltage: then it sees command and time only.
    pub(super) of_voltage: bool,
}

/// A mistake and where it is, in bytes.
pub(super) type Mistake = (Range<usize>, Problem);

/// Reads a law that is to be in `wanted`.
pub(super) fn parse(text: &str, names: &Names<'_>, wanted: Unit) -> Result<Tape, Mistake> {
    if text.len() > MAX_LENGTH {
        return Err((0..0, Problem::TooLong { most: MAX_LENGTH }));
    }
    let mut parser = Parser {
        text,
        at: 0,
        names,
        tape: Tape::default(),
    };
    let whole = parser.sum()?;
    parser.spaces();
    if parser.at < text.len() {
        return Err(parser.unexpected("an operator: + - * / ^"));
    }
    match whole.unit {
        Some(unit) if !unit.is_like(wanted) => Err((
            whole.span,
            Problem::WrongUnit {
                unit,
                wanted,
                lacks: wanted.times(unit, -1),
            },
        )),
        _ => {
            parser.check_depth()?;
            Ok(parser.tape)
        }
    }
}

/// A part of a law: its unit (none: zero, which is of any unit) and where it stands.
#[derive(Clone)]
struct Part {
    unit: Option<Unit>,
    span: Range<usize>,
}

struct Parser<'a> {
    text: &'a str,
    at: usize,
    names: &'a Names<'a>,
    tape: Tape,
}

impl Parser<'_> {
    fn spaces(&mut self) {
        let rest = &self.text[self.at..];
        self.at += rest.len() - rest.trim_start().len();
    }

    fn peek(&mut self) -> Option<char> {
        self.spaces();
        self.text[self.at..].chars().next()
    }

    fn take(&mut self, wanted: char) -> bool {
        let found = self.peek() == Some(wanted);
        if found {
            self.at += wanted.len_utf8();
        }
        found
    }

    fn unexpected(&mut self, wanted: &'static str) -> Mistake {
        let found = self.peek();
        let width = found.map_or(0, char::len_utf8);
        (
            self.at..self.at + width,
            Problem::Unexpected { found, wanted },
        )
    }

    fn push(&mut self, operation: Operation, span: &Range<usize>) -> Result<(), Mistake> {
        let pushed = self.tape.operations.try_push(operation);
        pushed.map_err(|_| {
            (
                span.clone(),
                Problem::TooManyOperations {
                    most: MAX_OPERATIONS,
                },
            )
        })
    }

    fn check_depth(&self) -> Result<(), Mistake> {
        let mut depth = 0_usize;
        for operation in &self.tape.operations {
            depth = (depth + 1).saturating_sub(operation.takes());
            if depth > MAX_DEPTH {
                return Err((0..self.text.len(), Problem::TooDeep { most: MAX_DEPTH }));
            }
        }
        Ok(())
    }

    /// The unit of two parts of which one is added to, or compared with, the other.
    fn alike(&self, a: &Part, b: &Part) -> Result<Option<Unit>, Mistake> {
        match (a.unit, b.unit) {
            (Some(left), Some(right)) if !left.is_like(right) => Err((
                b.span.clone(),
                Problem::UnlikeUnits {
                    left: self.text[a.span.clone()].to_owned(),
                    left_unit: left,
                    right: self.text[b.span.clone()].to_owned(),
                    right_unit: right,
                },
            )),
            (left, right) => Ok(left.or(right)),
        }
    }

    fn sum(&mut self) -> Result<Part, Mistake> {
        let mut whole = self.product()?;
        loop {
            let operation = if self.take('+') {
                Operation::Add
            } else if self.take('-') {
                Operation::Subtract
            } else {
                return Ok(whole);
            };
            let next = self.product()?;
            let unit = self.alike(&whole, &next)?;
            let span = whole.span.start..next.span.end;
            self.push(operation, &span)?;
            whole = Part { unit, span };
        }
    }

    fn product(&mut self) -> Result<Part, Mistake> {
        let mut whole = self.factor()?;
        loop {
            let (operation, power) = if self.take('*') {
                (Operation::Multiply, 1)
            } else if self.take('/') {
                (Operation::Divide, -1)
            } else {
                return Ok(whole);
            };
            let next = self.factor()?;
            let span = whole.span.start..next.span.end;
            self.push(operation, &span)?;
            let unit = match (whole.unit, next.unit) {
                (Some(a), Some(b)) => Some(a.times(b, power)),
                _ => None,
            };
            whole = Part { unit, span };
        }
    }

    fn factor(&mut self) -> Result<Part, Mistake> {
        self.spaces();
        let start = self.at;
        if self.take('-') {
            let inner = self.factor()?;
            let span = start..inner.span.end;
            self.push(Operation::Negate, &span)?;
            return Ok(Part { span, ..inner });
        }
        let base = self.atom()?;
        if !self.take('^') {
            return Ok(base);
        }
        self.spaces();
        let digits = self.at;
        let number = self.digits(digits);
        let power: Option<u8> = self.text[digits..number].parse().ok();
        let Some(power) = power.filter(|n| (1..=MAX_POWER).contains(n)) else {
            let end = number.max((digits + 1).min(self.text.len()));
            return Err((digits..end, Problem::Power { most: MAX_POWER }));
        };
        self.at = number;
        let span = base.span.start..number;
        self.push(Operation::Power(power), &span)?;
        #[allow(clippy::cast_possible_wrap)] // at most 9
        let unit = base.unit.map(|u| Unit::NONE.times(u, power as i8));
        Ok(Part { unit, span })
    }

    /// Where the digits that begin here end.
    fn digits(&self, from: usize) -> usize {
        let bytes = self.text.as_bytes()[from..].iter();
        from + bytes.take_while(|b| b.is_ascii_digit()).count()
    }

    fn atom(&mut self) -> Result<Part, Mistake> {
        let wanted = "a number, a name, a function or (";
        let start = {
            self.spaces();
            self.at
        };
        match self.peek() {
            Some('(') => {
                self.at += 1;
                let inner = self.sum()?;
                if !self.take(')') {
                    return Err(self.unexpected(") or an operator: + - * / ^"));
                }
                let span = start..self.at;
                Ok(Part { span, ..inner })
            }
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(start),
            Some(c) if c.is_ascii_alphabetic() => {
                let bytes = self.text.as_bytes()[start..].iter();
                let word = bytes.take_while(|b| b.is_ascii_alphanumeric() || **b == b'_');
                self.at = start + word.count();
                self.name(start)
            }
            _ => Err(self.unexpected(wanted)),
        }
    }

    fn number(&mut self, start: usize) -> Result<Part, Mistake> {
        let mut end = self.digits(start);
        let bytes = self.text.as_bytes();
        if bytes.get(end) == Some(&b'.') {
            end = self.digits(end + 1);
        }
        if matches!(bytes.get(end), Some(b'e' | b'E')) {
            let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
            let last = self.digits(end + 1 + sign);
            if last > end + 1 + sign {
                end = last;
            }
        }
        let value: Option<f64> = self.text[start..end].parse().ok();
        let Some(value) = value.filter(|x| x.is_finite()) else {
            return Err((start..end, Problem::Number));
        };
        self.at = end;
        let span = start..end;
        self.push(Operation::Number(value), &span)?;
        let unit = (value != 0.0).then_some(Unit::NONE);
        Ok(Part { unit, span })
    }

    /// A name that has just been read.
    fn name(&mut self, start: usize) -> Result<Part, Mistake> {
        let name = &self.text[start..self.at];
        let span = start..self.at;
        if let Some((_, arguments)) = FUNCTIONS.iter().find(|(word, _)| *word == name) {
            return self.function(start, *arguments);
        }
        let state = (self.names.state)
            .filter(|(word, _)| *word == name)
            .map(|(word, unit)| (word, Operation::Variable(Variable::State), unit));
        let variable = VARIABLES.iter().find(|(word, ..)| *word == name).copied();
        let variable = variable.or(state);
        let constant = self.names.constants.iter().find(|(word, ..)| word == name);
        let parameter = self
            .names
            .parameters
            .iter()
            .position(|(word, _)| word == name);
        let (operation, unit) = if let Some((_, operation, unit)) = variable {
            if self.names.of_voltage && !matches!(name, "u" | "t") {
                let name = name.to_owned();
                return Err((span, Problem::NotOfVoltage { name }));
            }
            (operation, unit)
        } else if let Some(i) = parameter {
            #[allow(clippy::cast_possible_truncation)] // at most MAX_PARAMETERS
            (Operation::Parameter(i as u8), self.names.parameters[i].1)
        } else if let Some((_, value, unit)) = constant {
            (Operation::Number(*value), *unit)
        } else if name == "pi" {
            (Operation::Number(std::f64::consts::PI), Unit::NONE)
        } else {
            let own = self.names.parameters.iter().map(|(word, _)| word.as_str());
            let constants = self.names.constants.iter().map(|(word, ..)| word.as_str());
            let state = self.names.state.map(|(word, _)| word);
            let known = VARIABLES.iter().map(|(word, ..)| *word).chain(state);
            let known: Vec<&str> = known.chain(own).chain(constants).collect();
            let functions = FUNCTIONS.map(|(word, _)| word).join(", ");
            return Err((
                span,
                Problem::UnknownName {
                    name: name.to_owned(),
                    known: format!("{}, pi; functions {functions}", known.join(", ")),
                },
            ));
        };
        self.push(operation, &span)?;
        Ok(Part {
            unit: Some(unit),
            span,
        })
    }

    fn function(&mut self, start: usize, arguments: usize) -> Result<Part, Mistake> {
        let text = self.text;
        let name = &text[start..self.at];
        if !self.take('(') {
            return Err(self.unexpected("( behind a function's name"));
        }
        let mut parts = vec![self.sum()?];
        while self.take(',') {
            parts.push(self.sum()?);
        }
        if !self.take(')') {
            return Err(self.unexpected("), a comma or an operator: + - * / ^"));
        }
        let span = start..self.at;
        if parts.len() != arguments {
            let (name, given) = (name.to_owned(), parts.len());
            return Err((
                span,
                Problem::Arguments {
                    name,
                    given,
                    wanted: arguments,
                },
            ));
        }
        let first = parts[0].clone();
        let pure = || match first.unit {
            Some(unit) if !unit.is_like(Unit::NONE) => Err((
                first.span.clone(),
                Problem::NotPure {
                    function: name.to_owned(),
                    argument: text[first.span.clone()].to_owned(),
                    unit,
                },
            )),
            _ => Ok(Some(Unit::NONE)),
        };
        let (operation, unit) = match name {
            "sin" => (self.of_alpha(Variable::SinAlpha, Operation::Sin), pure()?),
            "cos" => (self.of_alpha(Variable::CosAlpha, Operation::Cos), pure()?),
            "tanh" => (Operation::Tanh, pure()?),
            "exp" => (Operation::Exp, pure()?),
            "abs" => (Operation::Abs, first.unit),
            "sqrt" => {
                let root = first.unit.map(|unit| {
                    unit.root()
                        .ok_or_else(|| (first.span.clone(), Problem::Root { unit }))
                });
                (Operation::Sqrt, root.transpose()?)
            }
            "min" => (Operation::Min, self.alike(&first, &parts[1])?),
            "max" => (Operation::Max, self.alike(&first, &parts[1])?),
            _ => {
                self.alike(&first, &parts[1])?;
                (Operation::Sign, Some(Unit::NONE))
            }
        };
        self.push(operation, &span)?;
        Ok(Part { unit, span })
    }

    /// Sine or cosine of what was just read: of the pendulum's angle alone it is known already.
    fn of_alpha(&mut self, known: Variable, otherwise: Operation) -> Operation {
        let last = self.tape.operations.last();
        if last == Some(&Operation::Variable(Variable::Alpha)) {
            self.tape.operations.pop();
            Operation::Variable(known)
        } else {
            otherwise
        }
    }
}
