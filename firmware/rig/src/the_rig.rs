//! The rig and the control system that this firmware is built for: see build.rs.

use arrayvec::ArrayVec;
use furuta_ctrl::supervisor::Supervisor;
use furuta_ctrl::{Config, ConfigError, Limits, Site};
use furuta_model::{Effect, EffectError, Params, PlantError};
use furuta_wire::Hello;

use crate::EmulatedMechanics;

include!(concat!(env!("OUT_DIR"), "/rig.rs"));

/// What cannot be built of the constants; the build has refused files of which that is true.
#[derive(Debug, thiserror::Error)]
pub enum Unusable {
    /// An effect of the rig file.
    #[error("rig file: {0}")]
    Effect(#[from] EffectError),
    /// The rig's model.
    #[error("rig file: {0}")]
    Plant(#[from] PlantError),
    /// The controller file's settings as they were sent.
    #[error("controller file: {0}")]
    Settings(#[from] postcard::Error),
    /// The control system that they describe.
    #[error("controller file: {0}")]
    Control(#[from] ConfigError),
}

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
    ///
    /// # Errors
    /// An effect that is not possible.
    pub fn new() -> Result<Self, Unusable> {
        let effects = EFFECTS.iter().map(|(id, values)| Effect::new(id, values));
        Ok(Self {
            params: Params::from_array(ACTUATION, PARAMS),
            effects: effects.collect::<Result<_, _>>()?,
        })
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
    /// Settings that cannot be read, or are not possible here.
    pub fn supervisor(&self) -> Result<Supervisor<f32>, Unusable> {
        let config: Config = postcard::from_bytes(&CONTROLLER)?;
        Ok(Supervisor::design(&config, &self.site())?)
    }

    /// Its model in the place of its mechanics.
    ///
    /// # Errors
    /// Parameters or effects that are not possible.
    pub fn mechanics(&self) -> Result<EmulatedMechanics, Unusable> {
        let mechanics = EmulatedMechanics::new(&self.params, &self.effects, COUNTS, PERIOD_US);
        Ok(mechanics?)
    }
}

/// What the rig says of itself.
#[must_use]
pub fn hello() -> Hello {
    let limits: Limits = LIMITS;
    let command_limit = Params::from_array(ACTUATION, PARAMS).motor.command_limit;
    crate::hello(NAME, PERIOD_US, COUNTS, command_limit, &limits, ACTUATION)
}
