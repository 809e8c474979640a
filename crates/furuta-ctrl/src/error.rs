//! Why settings give no control system.

use crate::design::{DesignError, RegulatorError};
use crate::section::SettingsError;
use furuta_model::PlantError;
use furuta_model::linear_plant::NoEquilibrium;

/// Why settings give no control system.
#[derive(Copy, Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ConfigError {
    /// A setting.
    #[error("{0}")]
    Settings(#[from] SettingsError),
    /// A section that is none of those asked for.
    #[error("`{found}` cannot be a {section}")]
    WrongSection {
        /// What was wanted.
        section: &'static str,
        /// What was given.
        found: &'static str,
    },
    /// Settings that exclude each other.
    #[error("{section}: {problem}")]
    Contradiction {
        /// The section.
        section: &'static str,
        /// What to do.
        problem: &'static str,
    },
    /// The rig has no such controller.
    #[error("{section} does not suit this rig: {problem}")]
    Unsuitable {
        /// The section.
        section: &'static str,
        /// Why not.
        problem: &'static str,
    },
    /// A kind of command that this version does not know.
    #[error(
        "the rig's command is of a kind ({code}) that this version does not know: build both ends from one version"
    )]
    UnknownActuation {
        /// [`furuta_model::Actuation::code`] as received.
        code: u8,
    },
    /// A delay that a controller cannot have as its states.
    #[error(
        "mpc: a delay of {delay} s is outside the allowed range [0, {most}] s, what its remembered commands span: \
         take a longer sample period, or delay = \"none\" and an estimator that looks ahead"
    )]
    Delay {
        /// What was asked for, s.
        delay: f64,
        /// The longest, s.
        most: f64,
    },
    /// A sample period that no loop has.
    #[error("the sample period is {period} s, must be above 0 and at most 0.1 s")]
    Period {
        /// What was given, s.
        period: f64,
    },
    /// The gains cannot be designed.
    #[error("no gain can be designed: {0}")]
    Design(#[from] DesignError),
    /// There is no steady motion for the reference.
    #[error("{0}")]
    Regulator(#[from] RegulatorError),
    /// The rig's model is not possible.
    #[error("{0}")]
    Plant(#[from] PlantError),
    /// The rig's effects let nothing rest upright.
    #[error("{0}")]
    Equilibrium(#[from] NoEquilibrium),
}
