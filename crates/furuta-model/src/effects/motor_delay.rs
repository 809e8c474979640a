//! Delay of the command: `u(t) -> u(t - delay)`.

use super::{Acts, AtRest, Footprint, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// Delay of the command: `u(t) -> u(t - delay)`.
    MotorDelay {
        /// Time by which it is late, s.
        delay,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "motor.delay",
    name: "Delay of the command",
    law: "u(t) -> u(t - delay)",
    sentence: "The command reaches the motor late: communication, computation or the amplifier take time.",
    shows: "Everything happens a little later than the model says, by the same time at every frequency.",
    experiment: "single large steps of the command from rest, recorded at the highest rate",
    look_alikes: &["sensor.delay", "motor.lag"],
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
    footprint: Footprint::Own(&["delay"]),
    acts: Acts::DELAY,
    at_rest: AtRest::Slope,
    own: None,
    offered: Offered::Always,
};

impl<S: Scalar> Law<S> for MotorDelay<S> {
    #[inline(always)]
    fn delay(&self) -> S {
        self.delay
    }
}
