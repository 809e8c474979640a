//! Scale of the pendulum's encoder: `measured alpha = scale * alpha`.

use super::{Acts, Footprint, Kind, Law, ParameterSpec, Spec};
use crate::transfer::Output;
use crate::scalar::Scalar;

parameters! {
    /// Scale of the pendulum's encoder: `measured alpha = scale * alpha`.
    SensorAlphaScale {
        /// Measured over true angle, counted from upright, -.
        scale,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "sensor.alpha.scale",
    name: "Scale of the pendulum's encoder",
    law: "measured alpha = scale * alpha",
    sentence: "The encoder has another number of counts per turn than the rig file says.",
    shows: "A full turn does not measure a full turn; the hanging position is wrong where the upright one is right.",
    experiment: "several full turns of the pendulum: a scale error adds up, an offset does not",
    look_alikes: &["sensor.alpha.offset", "pendulum.spring"],
    parameters: &[
        ParameterSpec {
            name: "scale",
            unit: "-",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 10.0,
            off: 1.0,
            typical: |_| 0.02,
            starts: &[0.0],
        },
    ],
    strengths: 1,
    footprint: Footprint::Scale(Output::Alpha),
    acts: Acts::READING,
};

impl<S: Scalar> Law<S> for SensorAlphaScale<S> {
    #[inline(always)]
    fn reading(&self, [theta, alpha]: [S; 2]) -> [S; 2] {
        [theta, self.scale * alpha]
    }
}
