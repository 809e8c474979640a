//! First-order lag of the motor voltage: `time_constant * dv/dt = u - v`.

use super::{Acts, AtRest, Footprint, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// First-order lag of the motor voltage: `time_constant * dv/dt = u - v`.
    MotorLag {
        /// Time constant, s.
        time_constant,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "motor.lag",
    name: "First-order lag of the motor voltage",
    law: "time_constant * dv/dt = u - v",
    sentence: "Inductance or the driver's filter lets the voltage rise only gradually.",
    shows: "Fast commands arrive weakened and late; slow ones are unchanged.",
    experiment: "commands that alternate every few samples, against slow ones (a lag weakens them, a delay does not)",
    look_alikes: &["motor.delay", "sensor.delay"],
    parameters: &[
        ParameterSpec {
            name: "time_constant",
            unit: "s",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 10.0,
            off: 0.0,
            typical: Typical::Of(|_| 0.01),
            starts: &[0.3, 2.0],
        },
    ],
    strengths: 1,
    footprint: Footprint::Own(&["time_constant"]),
    acts: Acts::LAG,
    at_rest: AtRest::Slope,
    own: None,
    offered: Offered::Always,
};

impl<S: Scalar> Law<S> for MotorLag<S> {
    #[inline(always)]
    fn lag(&self) -> S {
        self.time_constant
    }
}
