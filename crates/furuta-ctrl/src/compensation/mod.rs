//! Compensation: what is added to a controller's command for effects that the rig file names.

mod hold;

use crate::config::ConfigError;
use crate::real::{Real, is_finite};
use crate::settings::{ParameterSpec, Settings, Spec};
use crate::site::Site;
use furuta_model::Plant;

/// What a controller file may say of it.
pub static SPEC: Spec = Spec {
    id: "compensate",
    sentence: "What is added to the command for effects that the rig file names",
    parameters: &[ParameterSpec::switch(
        "hold",
        true,
        "the voltage that holds the arm at its reference against springs and whatever else pulls it",
    )],
};

/// Feed-forward from the rig's model.
#[derive(Clone, Debug)]
pub struct Compensation<T: Real> {
    plant: Plant<T>,
    /// Friction counts as holding an axis where it stops it at this rate, 1/s.
    stick_rate: T,
    hold: bool,
}

impl<T: Real> Compensation<T> {
    /// With these settings at this site.
    ///
    /// # Errors
    /// Where the rig's model is not possible.
    pub fn design(settings: &Settings, site: &Site<'_>) -> Result<Self, ConfigError> {
        let plant: Plant<f64> = Plant::new(site.params, site.effects)?;
        Ok(Self {
            hold: settings.is_on("hold") && !plant.effects().is_empty(),
            plant: plant.cast(),
            stick_rate: T::from_f64(1.0 / site.period),
        })
    }

    /// The command (V) to be added while the pendulum is balanced with the arm at `theta` (rad); always finite.
    pub fn command(&self, theta: T) -> T {
        if !self.hold {
            return T::ZERO;
        }
        let volts = hold::voltage(&self.plant, theta, self.stick_rate);
        if is_finite(volts) { volts } else { T::ZERO }
    }
}
