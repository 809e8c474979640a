//! Scale of the arm's encoder: `measured theta = scale * theta`.

use super::{Acts, AtRest, Footprint, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::transfer::Output;
use crate::scalar::Scalar;

parameters! {
    /// Scale of the arm's encoder: `measured theta = scale * theta`.
    SensorThetaScale {
        /// Measured over true angle, -.
        scale,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "sensor.theta.scale",
    name: "Scale of the arm's encoder",
    law: "measured theta = scale * theta",
    sentence: "The encoder has another number of counts per turn than the rig file says.",
    shows: "The arm seems to move too far or too little in every motion, and to push the pendulum too hard \
        or too gently.",
    experiment: "turning the arm by hand against a mark, once round",
    look_alikes: &["motor.asymmetry", "sensor.alpha.scale"],
    parameters: &[
        ParameterSpec {
            name: "scale",
            unit: "-",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 10.0,
            off: 1.0,
            typical: Typical::Of(|_| 0.02),
            starts: &[0.0],
        },
    ],
    strengths: 1,
    footprint: Footprint::Scale(Output::Theta),
    acts: Acts::READING,
    at_rest: AtRest::READING,
    own: None,
    offered: Offered::Always,
};

impl<S: Scalar> Law<S> for SensorThetaScale<S> {
    #[inline(always)]
    fn reading(&self, [theta, alpha]: [S; 2]) -> [S; 2] {
        [self.scale * theta, alpha]
    }
}
