//! Offset of the motor voltage: `u -> u + voltage`.

use super::{Acts, AtRest, Footprint, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// Offset of the motor voltage: `u -> u + voltage`.
    MotorBias {
        /// Voltage added, V.
        voltage,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "motor.bias",
    name: "Offset of the motor voltage",
    law: "u -> u + voltage",
    sentence: "The amplifier's zero is off: with zero command the motor still pulls to one side.",
    shows: "The arm creeps in one direction; balancing needs a mean command that is not zero.",
    experiment: "equal and opposite steps of the command from several arm angles",
    look_alikes: &["arm.tilt", "motor.asymmetry", "arm.spring"],
    parameters: &[
        ParameterSpec {
            name: "voltage",
            unit: "V",
            kind: Kind::Real,
            default: None,
            min: -1e3,
            max: 1e3,
            off: 0.0,
            typical: Typical::Of(|p| 0.05 * p.motor.command_limit),
            starts: &[0.0],
        },
    ],
    strengths: 1,
    footprint: Footprint::REST,
    acts: Acts::VOLTAGE,
    at_rest: AtRest::Slope,
    own: None,
    offered: Offered::Always,
};

impl<S: Scalar> Law<S> for MotorBias<S> {
    #[inline(always)]
    fn voltage(&self, _: S, volts: S) -> S {
        volts + self.voltage
    }
}
