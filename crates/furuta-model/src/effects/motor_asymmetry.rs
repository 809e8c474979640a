//! Gain of the motor that depends on direction: `u -> negative_gain * u for u < 0`.

use super::{Acts, AtRest, BaseParameter, Footprint, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// Gain of the motor that depends on direction: `u -> negative_gain * u for u < 0`.
    MotorAsymmetry {
        /// Gain for negative commands, 1 for positive ones, -.
        negative_gain,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "motor.asymmetry",
    name: "Gain of the motor that depends on direction",
    law: "u -> negative_gain * u for u < 0",
    sentence: "The bridge or the brushes work better one way round: the same voltage turns the arm harder to one side.",
    shows: "The arm drifts to one side under symmetric commands, the more the larger they are.",
    experiment: "equal and opposite commands of several sizes: a bias stays the same, an asymmetry grows with them",
    look_alikes: &["motor.bias"],
    parameters: &[
        ParameterSpec {
            name: "negative_gain",
            unit: "-",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 10.0,
            off: 1.0,
            typical: Typical::Of(|_| 0.1),
            starts: &[0.0],
        },
    ],
    strengths: 1,
    footprint: Footprint::Refitted(BaseParameter::MotorGain, "the mean of both directions' gains is seen"),
    acts: Acts::VOLTAGE,
    at_rest: AtRest::KINKED,
    own: None,
    offered: Offered::Always,
};

impl<S: Scalar> Law<S> for MotorAsymmetry<S> {
    #[inline(always)]
    fn voltage(&self, _: S, volts: S) -> S {
        volts.if_less(S::ZERO, self.negative_gain * volts, volts)
    }
}
