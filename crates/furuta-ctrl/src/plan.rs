//! Everything a microcontroller needs to control a rig, in one value that can be sent or compiled in.

use crate::config::Config;
use crate::error::ConfigError;
use crate::real::Real;
use crate::site::{Limits, Site};
use crate::supervisor::Supervisor;
use arrayvec::{ArrayString, ArrayVec};
use furuta_model::effects::MAX_PARAMETERS;
use furuta_model::plant::MAX_EFFECTS;
use furuta_model::{Actuation, Effect, EffectError, Params};

/// A controller file and what its controller is made for: plain numbers, no text, no allocation; serde's `Serialize`
/// and `Deserialize`.
///
/// ```
/// use furuta_ctrl::supervisor::Supervisor;
/// use furuta_ctrl::{Config, Plan, Site};
/// let rig = furuta_model::Rig::builtin("qube-servo-2").ok_or("no such rig")?;
/// // On the host: files are read, and the plan is sent.
/// let plan = Plan::new(Config::default(), &Site::of(&rig, 0.002));
/// let mut buffer = [0; 1024];
/// let bytes = postcard::to_slice(&plan, &mut buffer)?;
/// // On the target: the same designs run there, in the precision of the target.
/// let received: Plan = postcard::from_bytes(bytes)?;
/// let supervisor: Supervisor<f32> = received.supervisor()?;
/// # let _ = supervisor;
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Plan {
    /// The controller file.
    pub config: Config,
    /// Sample period, s.
    pub period: f64,
    /// Parameters in the order of [`furuta_model::params::RANGES`].
    params: [f64; 17],
    /// [`Actuation::code`].
    actuation: u8,
    command_limit: f64,
    resolution: [f64; 2],
    limits: Limits,
    effects: ArrayVec<SentEffect, MAX_EFFECTS>,
}

/// An effect by its id.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
struct SentEffect {
    id: ArrayString<48>,
    values: ArrayVec<f64, MAX_PARAMETERS>,
}

impl Plan {
    /// This configuration at this site. Of more effects than a plant can have, the first count.
    #[must_use]
    pub fn new(config: Config, site: &Site<'_>) -> Self {
        let effects = site
            .effects
            .iter()
            .filter_map(|e| {
                Some(SentEffect {
                    id: ArrayString::from(e.spec().id).ok()?,
                    values: e.values(),
                })
            })
            .take(MAX_EFFECTS)
            .collect();
        Self {
            config,
            period: site.period,
            params: site.params.to_array(),
            actuation: site.params.motor.actuation.code(),
            command_limit: site.command_limit,
            resolution: site.resolution,
            limits: site.limits,
            effects,
        }
    }

    /// The control system, made where this runs.
    ///
    /// # Errors
    /// Parameters, effects or settings that are not possible.
    pub fn supervisor<T: Real>(&self) -> Result<Supervisor<T>, ConfigError> {
        let actuation =
            Actuation::from_code(self.actuation).ok_or(ConfigError::UnknownActuation {
                code: self.actuation,
            })?;
        let params = Params::from_array(actuation, self.params);
        params.validate().map_err(furuta_model::PlantError::from)?;
        let effects = self
            .effects
            .iter()
            .map(|e| Effect::new(&e.id, &e.values))
            .collect::<Result<ArrayVec<Effect<f64>, MAX_EFFECTS>, EffectError>>()
            .map_err(furuta_model::PlantError::from)?;
        let site = Site {
            params: &params,
            effects: &effects,
            period: self.period,
            command_limit: self.command_limit,
            resolution: self.resolution,
            limits: self.limits,
        };
        Supervisor::design(&self.config, &site)
    }
}
