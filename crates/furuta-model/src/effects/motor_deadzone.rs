//! Dead zone of the motor: `u -> sign(u) * max(|u| - width, 0)`.

use super::{Acts, AtRest, Footprint, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// Dead zone of the motor: `u -> sign(u) * max(|u| - width, 0)`.
    MotorDeadzone {
        /// Voltage swallowed, V.
        width,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "motor.deadzone",
    name: "Dead zone of the motor",
    law: "u -> sign(u) * max(|u| - width, 0)",
    sentence: "Below a certain voltage the amplifier gives nothing, and above it that much less.",
    shows: "Small commands do nothing, whatever the speed; large ones are short by the same voltage.",
    experiment: "small commands while the arm already turns fast (dead zone acts there, friction does not change)",
    look_alikes: &["arm.coulomb", "motor.asymmetry"],
    parameters: &[
        ParameterSpec {
            name: "width",
            unit: "V",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 1e3,
            off: 0.0,
            typical: Typical::Of(|p| 0.05 * p.motor.command_limit),
            starts: &[0.3, 2.0],
        },
    ],
    strengths: 1,
    footprint: Footprint::GAIN_BY_LEVEL,
    acts: Acts::VOLTAGE,
    at_rest: AtRest::KINKED,
    own: None,
    offered: Offered::Always,
};

impl<S: Scalar> Law<S> for MotorDeadzone<S> {
    #[inline(always)]
    fn voltage(&self, _: S, volts: S) -> S {
        let past = volts.abs() - self.width;
        let left = past.if_less(S::ZERO, S::ZERO, past);
        volts.if_less(S::ZERO, -left, left)
    }
}
