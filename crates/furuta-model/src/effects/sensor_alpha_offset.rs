//! Offset of the pendulum's encoder: `measured alpha = alpha + angle`.

use super::{Acts, AtRest, Footprint, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// Offset of the pendulum's encoder: `measured alpha = alpha + angle`.
    SensorAlphaOffset {
        /// Angle added, rad.
        angle,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "sensor.alpha.offset",
    name: "Offset of the pendulum's encoder",
    law: "measured alpha = alpha + angle",
    sentence: "The encoder's zero is not where the pendulum stands upright (it was zeroed while the \
        pendulum still swung or leaned).",
    shows: "The pendulum seems to balance beside upright and to hang beside straight down by the same angle.",
    experiment: "the pendulum hanging at rest in several arm positions, then balanced for a while",
    look_alikes: &["arm.tilt", "pendulum.bias", "sensor.alpha.scale"],
    parameters: &[
        ParameterSpec {
            name: "angle",
            unit: "rad",
            kind: Kind::Real,
            default: None,
            min: -3.2,
            max: 3.2,
            off: 0.0,
            typical: Typical::Of(|_| 0.02),
            starts: &[0.0],
        },
    ],
    strengths: 1,
    footprint: Footprint::Nothing("a response is of changes"),
    acts: Acts::READING.and(Acts::PENDULUM).and(Acts::ZERO),
    at_rest: AtRest::READING,
    own: None,
    offered: Offered::Always,
};

impl<S: Scalar> Law<S> for SensorAlphaOffset<S> {
    #[inline(always)]
    fn reading(&self, [theta, alpha]: [S; 2]) -> [S; 2] {
        [theta, alpha + self.angle]
    }
}
