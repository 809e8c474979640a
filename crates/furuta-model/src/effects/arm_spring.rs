//! Spring (cable) on the arm: `-stiffness * (theta - rest)`.

use super::{Acts, AtRest, Footprint, Instant, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// Spring (cable) on the arm: `-stiffness * (theta - rest)`.
    ArmSpring {
        /// Torque per radian, N m/rad.
        stiffness,
        /// Angle at which it does not pull, rad.
        rest,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "arm.spring",
    name: "Spring (cable) on the arm",
    law: "-stiffness * (theta - rest)",
    sentence: "Something elastic, most often the encoder cable between base and arm, pulls the arm back \
        towards one angle.",
    shows: "The arm drifts back to one place whenever it is left alone; the model's arm wanders off.",
    experiment: "letting the arm go from both ends of its range with the motor off",
    look_alikes: &["arm.cable", "arm.tilt", "motor.bias", "arm.cogging"],
    parameters: &[
        ParameterSpec {
            name: "stiffness",
            unit: "N m/rad",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 1e3,
            off: 0.0,
            typical: Typical::Of(|p| 0.05 * super::stall_torque(p)),
            starts: &[0.3],
        },
        ParameterSpec {
            name: "rest",
            unit: "rad",
            kind: Kind::Rest,
            default: None,
            min: -100.0,
            max: 100.0,
            off: 0.0,
            typical: Typical::Of(|_| 0.3),
            starts: &[0.0],
        },
    ],
    strengths: 1,
    footprint: Footprint::Own(&["stiffness"]),
    acts: Acts::TORQUE.and(Acts::ANGLE).and(Acts::ARM),
    at_rest: AtRest::Slope,
    own: None,
    offered: Offered::Always,
};

impl<S: Scalar> Law<S> for ArmSpring<S> {
    #[inline(always)]
    fn torque(&self, at: &Instant<'_, S>) -> [S; 2] {
        [-(self.stiffness * (at.x.theta - self.rest)), S::ZERO]
    }
}
