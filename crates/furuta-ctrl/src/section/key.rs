//! Parameters of a section as the program reads them: looked up when it is compiled, so that a name which the section
//! has not does not compile.

use super::spec::{ParameterSpec, Shape, Spec};
use super::values::Settings;

/// A number that may be left out.
#[derive(Copy, Clone, Debug)]
pub struct Optional(&'static str);

/// A number or a switch that has a default.
#[derive(Copy, Clone, Debug)]
pub struct Settled {
    name: &'static str,
    default: f64,
}

/// One of some words.
#[derive(Copy, Clone, Debug)]
pub struct Chosen {
    place: Settled,
    words: &'static [&'static str],
}

/// `N` numbers that may be left out.
#[derive(Copy, Clone, Debug)]
pub struct Several<const N: usize>(&'static str);

impl Spec {
    /// The parameter of this name, for a constant.
    ///
    /// # Panics
    /// There is none: in a constant, that does not compile.
    ///
    /// ```compile_fail
    /// use furuta_ctrl::controllers::SWING_UP;
    /// let key = const { SWING_UP.parameter("brake_att").settled() };
    /// ```
    #[must_use]
    pub const fn parameter(&self, name: &str) -> &ParameterSpec {
        let mut i = 0;
        while i < self.parameters.len() {
            if same(self.parameters[i].name, name) {
                return &self.parameters[i];
            }
            i += 1;
        }
        panic!("the section has no such parameter")
    }
}

impl ParameterSpec {
    /// To read it as a number that may be left out.
    ///
    /// # Panics
    /// It has a default, or is more than a number: in a constant, that does not compile.
    #[must_use]
    pub const fn optional(&self) -> Optional {
        assert!(
            self.default.is_none() && matches!(self.shape, Shape::Number),
            "no number without a default"
        );
        Optional(self.name)
    }

    /// To read it as what always has a value.
    ///
    /// # Panics
    /// It has no default: in a constant, that does not compile.
    #[must_use]
    pub const fn settled(&self) -> Settled {
        match self.default {
            Some(default) => Settled {
                name: self.name,
                default,
            },
            None => panic!("the parameter has no default"),
        }
    }

    /// To read it as a word.
    ///
    /// # Panics
    /// It is none: in a constant, that does not compile.
    #[must_use]
    pub const fn chosen(&self) -> Chosen {
        match self.shape {
            Shape::Word(words) => Chosen {
                place: self.settled(),
                words,
            },
            _ => panic!("the parameter is no word"),
        }
    }

    /// To read it as `N` numbers.
    ///
    /// # Panics
    /// It has another count of numbers: in a constant, that does not compile.
    #[must_use]
    pub const fn several<const N: usize>(&self) -> Several<N> {
        assert!(self.shape.len() == N, "another count of numbers");
        Several(self.name)
    }
}

impl Settings {
    /// Whether the parameter is given.
    #[must_use]
    pub fn has(&self, key: Optional) -> bool {
        self.number(key).is_some()
    }

    /// The number, if it is given.
    #[must_use]
    pub fn number(&self, key: Optional) -> Option<f64> {
        self.numbers(key.0)?.first().copied()
    }

    /// The `N` numbers, if they are given.
    #[must_use]
    pub fn vector<const N: usize>(&self, key: Several<N>) -> Option<[f64; N]> {
        self.numbers(key.0)?.try_into().ok()
    }

    /// The number, given or by default.
    #[must_use]
    pub fn value(&self, key: Settled) -> f64 {
        let given = self.numbers(key.name).and_then(|values| values.first());
        given.copied().unwrap_or(key.default)
    }

    /// Whether the switch is on, given or by default.
    #[must_use]
    pub fn is_on(&self, key: Settled) -> bool {
        self.value(key) == 1.0
    }

    /// The whole number, given or by default.
    #[must_use]
    pub fn whole(&self, key: Settled) -> usize {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // checked to be whole
        let whole = self.value(key) as usize;
        whole
    }

    /// The word, given or by default.
    #[must_use]
    pub fn word(&self, key: Chosen) -> &'static str {
        let place = self.whole(key.place); // checked to be within the list
        key.words.get(place).copied().unwrap_or_default()
    }
}

/// Whether two names are the same; `==` is no constant function.
const fn same(a: &str, b: &str) -> bool {
    let (a, b) = (a.as_bytes(), b.as_bytes());
    if a.len() != b.len() {
        return false;
    }
    let mut i = 0;
    while i < a.len() {
        if a[i] != b[i] {
            return false;
        }
        i += 1;
    }
    true
}
