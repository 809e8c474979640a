//! A whole control system as settings: what a controller file holds, in fixed size.

pub use crate::error::ConfigError;

use crate::section::{Settings, Spec};
use crate::trajectory::Trajectory;
use crate::{compensation, controllers, estimators, thresholds};

/// What a controller file says: one [`Settings`] for each of its sections. Sections that it leaves out are standard
/// ones.
///
/// It can be sent to a microcontroller (it is serde's `Serialize` and `Deserialize`, without an allocation) and is
/// checked there again.
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
    /// `[trajectory]`: a swing-up to follow, where one is given; else, and where it is lost, by energy.
    pub trajectory: Option<Trajectory>,
}

/// The sections of a controller file: name, and the kinds it can be of, the standard one first. A section of one kind
/// needs no `kind`.
pub static SECTIONS: [(&str, &[&Spec]); 6] = [
    ("controller", controllers::CATALOGUE),
    ("estimator", estimators::CATALOGUE),
    ("swing_up", &[&controllers::SWING_UP]),
    ("supervisor", &[&thresholds::SPEC]),
    ("limits", &[&thresholds::LIMITS]),
    ("compensate", &[&compensation::SPEC]),
];

/// Every section of every kind.
pub fn specs() -> impl Iterator<Item = &'static Spec> {
    SECTIONS.iter().flat_map(|(_, kinds)| kinds.iter().copied())
}

/// The section with this id, whatever it configures.
#[must_use]
pub fn find(id: &str) -> Option<&'static Spec> {
    specs().find(|spec| spec.id == id)
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
            trajectory: None,
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
