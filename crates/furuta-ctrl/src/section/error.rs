//! What is wrong with a setting.

use arrayvec::ArrayString;

use super::spec::ParameterNames;

/// The most bytes that an error keeps of a name that is not known.
const MAX_NAME: usize = 32;

/// The most numbers that one section can hold.
pub const MAX_NUMBERS: usize = 48;

/// What is wrong with a setting.
#[derive(Copy, Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SettingsError {
    /// The section has no parameter of this name.
    #[error("{section} has no parameter `{name}`; it has {known}")]
    Unknown {
        /// The section.
        section: &'static str,
        /// What was asked for, its first characters.
        name: ArrayString<MAX_NAME>,
        /// The parameters that it has.
        known: ParameterNames,
    },
    /// A value outside its range, or not a number.
    #[error(
        "{section}: {name} = {} is outside the allowed range [{min}, {max}]{}{unit}",
        furuta_input::number(*.value), if .unit.is_empty() { "" } else { " " }
    )]
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
