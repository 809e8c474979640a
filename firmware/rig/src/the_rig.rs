//! The rig and the control system that this firmware is built for: see build.rs.

use arrayvec::ArrayVec;
use furuta_ctrl::supervisor::Supervisor;
use furuta_ctrl::{Config, ConfigError, Limits, Site};
use furuta_model::{Effect, Params, PlantError};
use furuta_wire::Hello;

use crate::EmulatedMechanics;

include!(concat!(env!("OUT_DIR"), "/rig.rs"));

/// What the rig file says of the rig's motion.
#[derive(Clone, Debug)]
pub struct TheRig {
    /// Its parameters.
    pub params: Params<f64>,
    /// The effects that it names.
    pub effects: ArrayVec<Effect<f64>, { EFFECTS.len() }>,
}

impl TheRig {
    /// The rig of the file.
    #[must_use]
    pub fn new() -> Self {
        // The file was checked: none is refused.
        let effects = EFFECTS.iter();
        Self {
            params: Params::from_array(ACTUATION, PARAMS),
            effects: effects
                .filter_map(|(id, values)| Effect::new(id, values).ok())
                .collect(),
        }
    }

    /// Where a controller for it works.
    #[must_use]
    pub fn site(&self) -> Site<'_> {
        Site {
            effects: &self.effects,
            resolution: COUNTS.map(|counts| core::f64::consts::TAU / counts),
            limits: LIMITS,
            ..Site::new(&self.params, f64::from(PERIOD_US) * 1e-6)
        }
    }

    /// The control system of the controller file for it.
    ///
    /// # Errors
    /// Settings that are not possible here; the build has refused these.
    pub fn supervisor(&self) -> Result<Supervisor<f32>, ConfigError> {
        Supervisor::design(&config(), &self.site())
    }

    /// Its model in the place of its mechanics.
    ///
    /// # Errors
    /// Parameters that are not possible; the build has refused these.
    pub fn mechanics(&self) -> Result<EmulatedMechanics, PlantError> {
        EmulatedMechanics::new(&self.params, &self.effects, COUNTS, PERIOD_US)
    }
}

impl Default for TheRig {
    fn default() -> Self {
        Self::new()
    }
}

/// The controller file's settings.
#[must_use]
pub fn config() -> Config {
    // Written by the build from what is read here.
    postcard::from_bytes(&CONTROLLER).unwrap_or_default()
}

/// What the rig says of itself.
#[must_use]
pub fn hello() -> Hello {
    let limits: Limits = LIMITS;
    let command_limit = Params::from_array(ACTUATION, PARAMS).motor.command_limit;
    crate::hello(NAME, PERIOD_US, COUNTS, command_limit, &limits, ACTUATION)
}
