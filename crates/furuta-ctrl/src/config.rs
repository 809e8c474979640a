//! A whole control system as settings: what a controller file holds, in fixed size.

use crate::controllers;
use crate::design::{DesignError, RegulatorError};
use crate::settings::{Settings, SettingsError, Spec};
use crate::{compensation, estimators, supervisor};
use furuta_model::PlantError;

/// What a controller file says: one [`Settings`] for each of its sections. Sections that it leaves out are standard ones.
///
/// It can be sent to a microcontroller (it is serde's `Serialize` and `Deserialize`, without an allocation) and is checked there again.
///
/// ```
/// use furuta_ctrl::Config;
/// let standard = Config::default();
/// assert_eq!(standard.controller.spec().id, "lqr");
/// let mut buffer = [0; 512];
/// let bytes = postcard::to_slice(&standard, &mut buffer)?;
/// assert_eq!(postcard::from_bytes::<Config>(bytes)?, standard);
/// # Ok::<(), postcard::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Config {
    /// `[controller]`: what keeps the pendulum up. Kinds: [`controllers::CATALOGUE`].
    pub controller: Settings,
    /// `[estimator]`: what the encoders do not show. Kinds: [`estimators::CATALOGUE`].
    pub estimator: Settings,
    /// `[swing_up]`.
    pub swing_up: Settings,
    /// `[supervisor]`: when one hands over to the other.
    pub supervisor: Settings,
    /// `[limits]`: where the motor is switched off.
    pub limits: Settings,
    /// `[compensate]`: what is added to the command for effects that the rig file names.
    pub compensate: Settings,
}

/// The sections of a controller file: name, and the kinds it can be of, the standard one first. A section of one kind needs no `kind`.
pub static SECTIONS: [(&str, &[&Spec]); 6] = [
    ("controller", controllers::CATALOGUE),
    ("estimator", estimators::CATALOGUE),
    ("swing_up", &[&controllers::SWING_UP]),
    ("supervisor", &[&supervisor::SPEC]),
    ("limits", &[&supervisor::LIMITS]),
    ("compensate", &[&compensation::SPEC]),
];

/// Every section of every kind.
pub fn specs() -> impl Iterator<Item = &'static Spec> {
    SECTIONS.iter().flat_map(|(_, kinds)| kinds.iter().copied())
}

impl Default for Config {
    fn default() -> Self {
        let [
            controller,
            estimator,
            swing_up,
            supervisor,
            limits,
            compensate,
        ] = SECTIONS.map(|(_, kinds)| Settings::new(kinds[0]));
        Self {
            controller,
            estimator,
            swing_up,
            supervisor,
            limits,
            compensate,
        }
    }
}

impl Config {
    /// The standard one with another controller.
    #[must_use]
    pub fn with_controller(controller: Settings) -> Self {
        Self {
            controller,
            ..Self::default()
        }
    }

    /// The settings in the order of [`SECTIONS`].
    #[must_use]
    pub fn sections(&self) -> [&Settings; 6] {
        [
            &self.controller,
            &self.estimator,
            &self.swing_up,
            &self.supervisor,
            &self.limits,
            &self.compensate,
        ]
    }

    /// The same to change.
    pub fn sections_mut(&mut self) -> [&mut Settings; 6] {
        [
            &mut self.controller,
            &mut self.estimator,
            &mut self.swing_up,
            &mut self.supervisor,
            &mut self.limits,
            &mut self.compensate,
        ]
    }
}

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
}
