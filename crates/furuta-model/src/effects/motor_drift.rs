//! Drift of the motor's gain: `u -> (1 + rate * t) u`.

use super::{Acts, AtRest, BaseParameter, Footprint, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// Drift of the motor's gain: `u -> (1 + rate * t) u`.
    MotorDrift {
        /// Relative change of gain per second, 1/s.
        rate,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "motor.drift",
    name: "Drift of the motor's gain",
    law: "u -> (1 + rate * t) u",
    sentence: "The winding warms up or the supply sags: the same voltage does less and less as the run goes on.",
    shows: "The error grows with time, not with state; the start of a run fits, its end does not.",
    experiment: "the same excitation at the beginning and at the end of a long run",
    look_alikes: &["arm.coulomb", "arm.fading_friction"],
    parameters: &[
        ParameterSpec {
            name: "rate",
            unit: "1/s",
            kind: Kind::Real,
            default: None,
            min: -1.0,
            max: 1.0,
            off: 0.0,
            typical: Typical::Of(|_| 0.01),
            starts: &[0.0],
        },
    ],
    strengths: 1,
    footprint: Footprint::Refitted(BaseParameter::MotorGain, "the mean over the recording is seen"),
    acts: Acts::VOLTAGE.and(Acts::CLOCK),
    at_rest: AtRest::Local("at the run's start"),
    own: None,
    offered: Offered::Always,
};

impl<S: Scalar> Law<S> for MotorDrift<S> {
    #[inline(always)]
    fn voltage(&self, t: S, volts: S) -> S {
        volts + self.rate * t * volts
    }
}
