//! Cogging of the motor: `amplitude sin(order theta + phase)`.

use super::{Acts, AtRest, Footprint, Instant, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// Cogging of the motor: `amplitude sin(order theta + phase)`.
    ArmCogging {
        /// Largest torque, N m.
        amplitude,
        /// How often per turn, a whole number.
        order,
        /// Where in the turn, rad.
        phase,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "arm.cogging",
    name: "Cogging torque",
    law: "amplitude sin(order theta + phase)",
    sentence: "The motor's magnets prefer certain angles: the arm is pulled towards them, the same number \
        of times in every turn.",
    shows: "The error repeats with the arm's angle, not with time; a free arm comes to rest at preferred angles.",
    experiment: "slow turns over a full revolution in both directions: the holding voltage repeats with the angle",
    look_alikes: &["arm.spring", "disturbance.vibration", "arm.cable", "motor.ripple"],
    parameters: &[
        ParameterSpec {
            name: "amplitude",
            unit: "N m",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 1e3,
            off: 0.0,
            typical: Typical::Of(|p| 0.1 * super::stall_torque(p)),
            starts: &[0.3],
        },
        ParameterSpec {
            name: "order",
            unit: "-",
            kind: Kind::Whole,
            default: None,
            min: 0.0,
            max: 1000.0,
            off: 0.0,
            typical: Typical::Of(|_| 1.0),
            starts: &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0],
        },
        ParameterSpec {
            name: "phase",
            unit: "rad",
            kind: Kind::Phase,
            default: Some(0.0),
            min: -100.0,
            max: 100.0,
            off: 0.0,
            typical: Typical::Of(|_| 1.0),
            starts: &[0.0],
        },
    ],
    strengths: 1,
    footprint: Footprint::Like("arm.spring", "about one of its rests it pulls the arm back, order times \
        amplitude per radian"),
    acts: Acts::TORQUE.and(Acts::ANGLE).and(Acts::SHAFT),
    at_rest: AtRest::WITHIN_A_TOOTH,
    own: None,
    offered: Offered::Always,
};

impl<S: Scalar> Law<S> for ArmCogging<S> {
    #[inline(always)]
    fn torque(&self, at: &Instant<'_, S>) -> [S; 2] {
        let (sin, _) = (self.order * at.x.theta + self.phase).sin_cos();
        [self.amplitude * sin, S::ZERO]
    }
}
