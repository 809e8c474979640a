//! Saturation of the motor voltage: `|u| <= limit`.

use super::{Acts, AtRest, Footprint, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// Saturation of the motor voltage: `|u| <= limit`.
    MotorSaturation {
        /// Largest voltage, V.
        limit,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "motor.saturation",
    name: "Saturation of the motor voltage",
    law: "|u| <= limit",
    sentence: "The supply or the amplifier gives less than is asked for: commands beyond a limit are cut off.",
    shows: "Large commands do no more than middling ones; small ones are exact.",
    experiment: "steps of increasing size up to the command limit",
    look_alikes: &["motor.asymmetry"],
    parameters: &[
        ParameterSpec {
            name: "limit",
            unit: "V",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 1e3,
            off: 0.0,
            typical: Typical::Of(|p| 0.5 * p.motor.command_limit),
            // A limit above what was commanded does nothing: from 0.95 of the largest command down to a sixteenth of
            // it. The first one is taken where no start is searched for.
            starts: &[0.5, 1.9, 1.5, 1.2, 0.95, 0.75, 0.35, 0.25, 0.125],
        },
    ],
    strengths: 1,
    footprint: Footprint::GAIN_BY_LEVEL,
    acts: Acts::VOLTAGE.and(Acts::BACKWARDS).and(Acts::LIMIT),
    at_rest: AtRest::KINKED,
    own: None,
    offered: Offered::Always,
};

impl<S: Scalar> Law<S> for MotorSaturation<S> {
    #[inline(always)]
    fn voltage(&self, _: S, volts: S) -> S {
        volts.clamp(-self.limit, self.limit)
    }
}
