//! Spring (encoder cable) on the pendulum: `-stiffness * (alpha - rest)`.

use super::{Acts, AtRest, Footprint, Instant, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// Spring (encoder cable) on the pendulum: `-stiffness * (alpha - rest)`.
    PendulumSpring {
        /// Torque per radian, N m/rad.
        stiffness,
        /// Angle at which it does not pull, alpha never wrapped, rad.
        rest,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "pendulum.spring",
    name: "Spring (encoder cable) on the pendulum",
    law: "-stiffness * (alpha - rest)",
    sentence: "The pendulum's encoder cable winds up and pulls it back towards one angle.",
    shows: "The pendulum swings a little faster or slower than gravity says, and leans to one side after a full turn.",
    experiment: "full turns of the pendulum in both directions, then free swings: a cable remembers the \
        turns, gravity does not",
    look_alikes: &["sensor.alpha.scale", "pendulum.bias"],
    parameters: &[
        ParameterSpec {
            name: "stiffness",
            unit: "N m/rad",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 1e3,
            off: 0.0,
            typical: Typical::Of(|p| 0.05 * p.coefficients().weight),
            starts: &[0.3],
        },
        ParameterSpec {
            name: "rest",
            unit: "rad",
            kind: Kind::Real,
            default: Some(core::f64::consts::PI),
            min: -100.0,
            max: 100.0,
            off: core::f64::consts::PI,
            typical: Typical::Of(|_| 0.3),
            starts: &[0.0],
        },
    ],
    strengths: 1,
    footprint: Footprint::Own(&["stiffness"]),
    acts: Acts::TORQUE.and(Acts::PENDULUM),
    at_rest: AtRest::Slope,
    own: None,
    offered: Offered::Always,
};

impl<S: Scalar> Law<S> for PendulumSpring<S> {
    #[inline(always)]
    fn torque(&self, at: &Instant<'_, S>) -> [S; 2] {
        [S::ZERO, -(self.stiffness * (at.x.alpha - self.rest))]
    }
}
