//! Settings: the numbers of a controller file's sections, checked against what each section says it takes.
//!
//! A section is described by a [`Spec`] beside the code that reads it; reading and writing of files, messages about mistakes, lists for
//! people and what goes over a wire to a microcontroller all follow from it. No allocation.

mod key;
mod spec;
mod wire;

pub use key::{Optional, Settled, Several};
pub use spec::{ParameterSpec, Shape, Spec};

use arrayvec::ArrayVec;

/// The most numbers that one section can hold.
pub const MAX_NUMBERS: usize = 48;

/// The numbers given in one section. What is not given has its default, or is designed from the rig.
///
/// ```
/// use furuta_ctrl::controllers;
/// let settings = controllers::settings("lqr").ok_or("no such controller")?;
/// let settings = settings.with("gain", &[-1.0, 27.7, -2.0, 3.6])?;
/// assert_eq!(settings.numbers("gain"), Some(&[-1.0, 27.7, -2.0, 3.6][..]));
/// let error = settings.with("gain", &[f64::NAN; 4]).unwrap_err();
/// assert_eq!(error.to_string(), "lqr: gain = NaN is outside the allowed range [-1000000, 1000000] V/rad, V s/rad");
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Settings {
    spec: &'static Spec,
    /// Bit `i`: whether parameter `i` is given.
    given: u32,
    /// The given ones, one after the other.
    numbers: ArrayVec<f64, MAX_NUMBERS>,
}

impl PartialEq for Settings {
    fn eq(&self, other: &Self) -> bool {
        self.spec.id == other.spec.id && self.given == other.given && self.numbers == other.numbers
    }
}

/// What is wrong with a setting.
#[derive(Copy, Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SettingsError {
    /// The section has no parameter of this name.
    #[error("{section} has no such parameter; it has {}", Names(.section))]
    Unknown {
        /// The section.
        section: &'static str,
    },
    /// A value outside its range, or not a number.
    #[error("{section}: {name} = {} is outside the allowed range [{min}, {max}]{}{unit}", furuta_input::number(*.value), if .unit.is_empty() { "" } else { " " })]
    OutOfRange {
        /// The section.
        section: &'static str,
        /// The parameter.
        name: &'static str,
        /// What it was.
        value: f64,
        /// Lower end.
        min: f64,
        /// Upper end.
        max: f64,
        /// Unit of value and range.
        unit: &'static str,
    },
    /// A number that is not whole where it must be.
    #[error("{section}: {name} = {} must be a whole number from {min} to {max}", furuta_input::number(*.value))]
    NotWhole {
        /// The section.
        section: &'static str,
        /// The parameter.
        name: &'static str,
        /// What it was.
        value: f64,
        /// Lower end.
        min: f64,
        /// Upper end.
        max: f64,
    },
    /// Too many or too few numbers.
    #[error("{section}: {name} needs {wanted} number{}, not {given}", if *.wanted == 1 { "" } else { "s" })]
    Count {
        /// The section.
        section: &'static str,
        /// The parameter.
        name: &'static str,
        /// How many there are.
        given: usize,
        /// How many there must be.
        wanted: usize,
    },
    /// More numbers than a section can hold.
    #[error("{section}: more than {MAX_NUMBERS} numbers in one section")]
    Full {
        /// The section.
        section: &'static str,
    },
}

/// The parameters of a section by name, for messages.
struct Names<'a>(&'a &'static str);

impl core::fmt::Display for Names<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match find(self.0) {
            Some(spec) => spec.names().fmt(f),
            None => Ok(()),
        }
    }
}

/// The section with this id, whatever it configures.
#[must_use]
pub fn find(id: &str) -> Option<&'static Spec> {
    crate::config::specs().find(|spec| spec.id == id)
}

impl Settings {
    /// Nothing given.
    #[must_use]
    pub const fn new(spec: &'static Spec) -> Self {
        Self {
            spec,
            given: 0,
            numbers: ArrayVec::new_const(),
        }
    }

    /// What the section is and takes.
    #[must_use]
    pub const fn spec(&self) -> &'static Spec {
        self.spec
    }

    /// The same with `name` set to these numbers (one for a number, a switch or the place of a word).
    ///
    /// # Errors
    /// No such parameter, another count, or a value outside its range.
    pub fn with(&self, name: &str, values: &[f64]) -> Result<Self, SettingsError> {
        let section = self.spec.id;
        let place = self
            .spec
            .place(name)
            .ok_or(SettingsError::Unknown { section })?;
        let parameter = &self.spec.parameters[place];
        parameter.check(section, values)?;
        let mut next = Self::new(self.spec);
        for (i, p) in self.spec.parameters.iter().enumerate() {
            let values = if i == place {
                values
            } else {
                match self.numbers(p.name) {
                    Some(values) => values,
                    None => continue,
                }
            };
            next.given |= 1 << i;
            next.numbers
                .try_extend_from_slice(values)
                .map_err(|_| SettingsError::Full { section })?;
        }
        Ok(next)
    }

    /// The numbers given for `name`.
    #[must_use]
    pub fn numbers(&self, name: &str) -> Option<&[f64]> {
        let place = self.spec.place(name)?;
        if self.given & (1 << place) == 0 {
            return None;
        }
        let start = self.spec.parameters[..place]
            .iter()
            .enumerate()
            .filter(|(i, _)| self.given & (1 << i) != 0)
            .map(|(_, p)| p.shape.len())
            .sum();
        self.numbers
            .get(start..start + self.spec.parameters[place].shape.len())
    }

    /// The parameters that are given, with their numbers.
    pub fn given(&self) -> impl Iterator<Item = (&'static ParameterSpec, &[f64])> {
        self.spec
            .parameters
            .iter()
            .filter_map(|p| Some((p, self.numbers(p.name)?)))
    }
}
