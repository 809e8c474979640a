//! Constant torque on the pendulum: `torque`.

use super::{Acts, AtRest, Footprint, Instant, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// Constant torque on the pendulum: `torque`.
    PendulumBias {
        /// Torque, N m.
        torque,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "pendulum.bias",
    name: "Constant torque on the pendulum",
    law: "torque",
    sentence: "Something pushes the pendulum steadily to one side: wind, a cable, a hinge that is not level.",
    shows: "It hangs beside straight down to one side and balances beside upright to the other.",
    experiment: "the pendulum hanging at rest, then balanced: a torque leans it to opposite sides, an \
        encoder offset to the same",
    look_alikes: &["sensor.alpha.offset", "arm.tilt"],
    parameters: &[
        ParameterSpec {
            name: "torque",
            unit: "N m",
            kind: Kind::Real,
            default: None,
            min: -1e3,
            max: 1e3,
            off: 0.0,
            typical: Typical::Of(|p| 0.02 * p.coefficients().weight),
            starts: &[0.0],
        },
    ],
    strengths: 1,
    footprint: Footprint::REST,
    acts: Acts::TORQUE.and(Acts::PENDULUM),
    at_rest: AtRest::Slope,
    own: None,
    offered: Offered::Always,
};

impl<S: Scalar> Law<S> for PendulumBias<S> {
    #[inline(always)]
    fn torque(&self, _: &Instant<'_, S>) -> [S; 2] {
        [S::ZERO, self.torque]
    }
}
