//! Scale of the pendulum's encoder: `measured alpha = zero + scale * (alpha - zero)`.

use super::{Acts, AtRest, Footprint, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::transfer::Output;
use crate::scalar::Scalar;

parameters! {
    /// Scale of the pendulum's encoder: `measured alpha = zero + scale * (alpha - zero)`.
    SensorAlphaScale {
        /// Measured over true angle, counted from the encoder's zero, -.
        scale,
        /// Where the encoder was zeroed: 0 upright (alpha = 0), 1 hanging (alpha = pi).
        zero,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "sensor.alpha.scale",
    name: "Scale of the pendulum's encoder",
    law: "measured alpha = zero + scale * (alpha - zero), zero: 0 upright, pi hanging",
    sentence: "The encoder has another number of counts per turn than the rig file says.",
    shows: "A full turn does not measure a full turn; where the encoder was zeroed the angle is right, half a turn \
    from there it is wrong.",
    experiment: "several full turns of the pendulum: a scale error adds up, an offset does not",
    look_alikes: &["sensor.alpha.offset", "pendulum.spring", "sensor.theta.scale"],
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
        // An incremental encoder counts from where it was switched on or zeroed, mostly hanging; without a word it is
        // upright, as it always was.
        ParameterSpec {
            name: "zero",
            unit: "-",
            kind: Kind::Choice(&["upright", "hanging"]),
            default: Some(0.0),
            min: 0.0,
            max: 1.0,
            off: 0.0,
            typical: Typical::Of(|_| 1.0),
            starts: &[0.0, 1.0],
        },
    ],
    strengths: 1,
    footprint: Footprint::Scale(Output::Alpha),
    acts: Acts::READING.and(Acts::PENDULUM),
    at_rest: AtRest::READING,
    own: None,
    offered: Offered::Always,
};

impl<S: Scalar> Law<S> for SensorAlphaScale<S> {
    #[inline(always)]
    fn reading(&self, [theta, alpha]: [S; 2]) -> [S; 2] {
        let zero = if self.zero.value() > 0.5 { S::from_f64(core::f64::consts::PI) } else { S::ZERO };
        [theta, zero + self.scale * (alpha - zero)]
    }
}
