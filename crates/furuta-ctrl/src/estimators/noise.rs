//! What the Kalman filters suppose of a rig: how far it may be from its model, and from its encoders.

use crate::section::{ParameterSpec, Settings};
use crate::site::Site;
use core::f64::consts::TAU;

/// Settings that they have in common.
pub(super) const COMMAND: ParameterSpec = ParameterSpec::number(
    "command_noise",
    "V",
    1e-6,
    1e3,
    "how far, RMS, what drives the arm is from the model's, anew in every sample; 5 % of the largest \
     command if left out",
);
/// See [`COMMAND`].
pub(super) const PENDULUM: ParameterSpec = ParameterSpec::number(
    "pendulum_noise",
    "rad/s^2",
    1e-6,
    1e6,
    "how far, RMS, the pendulum's acceleration is from the model's, anew in every sample; 5 % of what \
     gravity gives it lying if left out",
);
/// See [`COMMAND`].
pub(super) const READING: ParameterSpec = ParameterSpec::numbers(
    "reading_noise",
    2,
    "rad",
    1e-9,
    1.0,
    "RMS error of the encoders, arm and pendulum; that of rounding to counts if left out",
);

/// Where the rig's encoders are not known of: 4096 counts.
const RESOLUTION: f64 = TAU / 4096.0;

/// Standard deviations.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct Noise {
    /// V.
    pub(super) command: f64,
    /// rad/s².
    pub(super) pendulum: f64,
    /// rad.
    pub(super) reading: [f64; 2],
}

impl Noise {
    pub(super) fn of(settings: &Settings, site: &Site<'_>) -> Self {
        let frequency = site.frequency();
        let of_counts = site.resolution.map(|count| {
            let count = if count > 0.0 { count } else { RESOLUTION };
            // Rounding errs evenly over a count.
            count / libm::sqrt(12.0)
        });
        Self {
            command: settings
                .number(const { COMMAND.optional() })
                .unwrap_or(0.05 * site.command_limit),
            pendulum: settings
                .number(const { PENDULUM.optional() })
                .unwrap_or(0.05 * frequency * frequency),
            reading: settings
                .vector(const { READING.several::<2>() })
                .unwrap_or(of_counts),
        }
    }
}
