//! What a section of a controller file is and takes.

/// A section, or one kind of it: `lqr` of the section `[controller]`.
#[derive(Debug)]
pub struct Spec {
    /// As in the file: `kind = "..."`, or the section's own name where there is only one kind. No two are the same.
    pub id: &'static str,
    /// What it is, in one sentence.
    pub sentence: &'static str,
    /// What it takes; at most 32. Every one may be left out.
    pub parameters: &'static [ParameterSpec],
}

/// One parameter of a section.
#[derive(Copy, Clone, Debug)]
pub struct ParameterSpec {
    /// As in the file.
    pub name: &'static str,
    /// SI unit, empty for a pure number.
    pub unit: &'static str,
    /// What it is, and what follows where it is left out.
    pub sentence: &'static str,
    /// What is written for it.
    pub shape: Shape,
    /// Smallest value allowed, of each number.
    pub min: f64,
    /// Largest value allowed, of each number.
    pub max: f64,
    /// The value where a file leaves it out; `None`: it then follows from the rig, as `sentence` says.
    pub default: Option<f64>,
}

/// What is written for a parameter.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Shape {
    /// A number.
    Number,
    /// A fixed count of numbers.
    Numbers(usize),
    /// A whole number.
    Whole,
    /// `true` or `false`; 1 and 0 elsewhere.
    Switch,
    /// One of these words; its place in the list elsewhere.
    Word(&'static [&'static str]),
}

impl Shape {
    /// How many numbers it takes.
    #[must_use]
    pub const fn len(self) -> usize {
        match self {
            Self::Numbers(n) => n,
            Self::Number | Self::Whole | Self::Switch | Self::Word(_) => 1,
        }
    }

    /// Whether it takes no number at all, which no shape should.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.len() == 0
    }

    /// The word at this place.
    #[must_use]
    pub fn word(self, place: f64) -> Option<&'static str> {
        match self {
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // saturates
            Self::Word(words) => words.get(place as usize).copied(),
            _ => None,
        }
    }
}

impl ParameterSpec {
    /// A number between `min` and `max`, without a default.
    #[must_use]
    pub const fn number(
        name: &'static str,
        unit: &'static str,
        min: f64,
        max: f64,
        sentence: &'static str,
    ) -> Self {
        Self {
            name,
            unit,
            sentence,
            shape: Shape::Number,
            min,
            max,
            default: None,
        }
    }

    /// `n` numbers, each between `min` and `max`, without a default.
    #[must_use]
    pub const fn numbers(
        name: &'static str,
        n: usize,
        unit: &'static str,
        min: f64,
        max: f64,
        sentence: &'static str,
    ) -> Self {
        Self {
            shape: Shape::Numbers(n),
            ..Self::number(name, unit, min, max, sentence)
        }
    }

    /// A whole number between `min` and `max`.
    #[must_use]
    pub const fn whole(
        name: &'static str,
        min: f64,
        max: f64,
        default: f64,
        sentence: &'static str,
    ) -> Self {
        Self {
            shape: Shape::Whole,
            ..Self::number(name, "", min, max, sentence).or(default)
        }
    }

    /// `true` or `false`.
    #[must_use]
    pub const fn switch(name: &'static str, default: bool, sentence: &'static str) -> Self {
        Self {
            shape: Shape::Switch,
            ..Self::number(name, "", 0.0, 1.0, sentence).or(if default { 1.0 } else { 0.0 })
        }
    }

    /// One of these words, the first if none is given.
    #[must_use]
    pub const fn word(
        name: &'static str,
        words: &'static [&'static str],
        sentence: &'static str,
    ) -> Self {
        #[allow(clippy::cast_precision_loss)]
        let last = words.len() as f64 - 1.0;
        Self {
            shape: Shape::Word(words),
            ..Self::number(name, "", 0.0, last, sentence).or(0.0)
        }
    }

    /// The same with a default.
    #[must_use]
    pub const fn or(self, default: f64) -> Self {
        Self {
            default: Some(default),
            ..self
        }
    }
}

impl Spec {
    /// Where the parameter of this name stands.
    #[must_use]
    pub fn place(&self, name: &str) -> Option<usize> {
        self.parameters.iter().position(|p| p.name == name)
    }

    /// The parameters' names, with commas between them.
    #[must_use]
    pub const fn names(&self) -> ParameterNames {
        ParameterNames(self.parameters)
    }
}

/// The names of a section's parameters, printed with commas between them.
#[derive(Copy, Clone, Debug)]
pub struct ParameterNames(&'static [ParameterSpec]);

impl PartialEq for ParameterNames {
    fn eq(&self, other: &Self) -> bool {
        let names = |of: &Self| of.0.iter().map(|p| p.name);
        names(self).eq(names(other))
    }
}

impl core::fmt::Display for ParameterNames {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        for (i, p) in self.0.iter().enumerate() {
            if i > 0 {
                f.write_str(", ")?;
            }
            f.write_str(p.name)?;
        }
        Ok(())
    }
}
