//! Delay of the encoders: both angles are read `delay` late.

use super::{Acts, AtRest, Footprint, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// Delay of the encoders: both angles are read `delay` late.
    SensorDelay {
        /// Time by which they are late, s.
        delay,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "sensor.delay",
    name: "Delay of the encoders",
    law: "measured(t) = true(t - delay)",
    sentence: "The angles reach the controller late: counting, filtering or transmission take time.",
    shows: "Everything seems to happen a little later than the model says; on recorded input and output \
        the same as a late command.",
    experiment: "none on input and output alone: record a second, prompt sensor beside the encoders",
    look_alikes: &["motor.delay", "motor.lag"],
    parameters: &[
        ParameterSpec {
            name: "delay",
            unit: "s",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 10.0,
            off: 0.0,
            typical: Typical::Of(|_| 0.005),
            starts: &[0.3, 2.0],
        },
    ],
    strengths: 1,
    footprint: Footprint::Like("motor.delay", "late is late, before the rig or behind it"),
    acts: Acts::SENSOR_DELAY,
    at_rest: AtRest::Slope,
    own: None,
    offered: Offered::Always,
};

impl<S: Scalar> Law<S> for SensorDelay<S> {
    #[inline(always)]
    fn sensor_delay(&self) -> S {
        self.delay
    }
}
