//! Friction that depends on the arm's angle: `-torque (1 + depth sin(order theta + phase)) sign(theta_dot)`.

use super::sensor_theta_eccentricity::PHASE;
use super::{Acts, AtRest, Footprint, Instant, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// Friction that depends on the arm's angle: `-torque (1 + depth sin(order theta + phase)) sign(theta_dot)`; at
    /// rest it holds up to that.
    ArmAngleFriction {
        /// Its mean, N m.
        torque,
        /// How much it varies, a share of the mean, 0 to 1.
        depth,
        /// How often per turn, a whole number.
        order,
        /// Where in the turn, rad.
        phase,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "arm.angle_friction",
    name: "Friction that depends on the arm's angle",
    law: "-torque (1 + depth sin(order theta + phase)) sign(theta_dot); at rest it holds up to that",
    sentence: "A shaft that is bent or a seal that is worn rubs harder at some angles of the arm than at others.",
    shows: "The error has the sign of the arm's speed, as with Coulomb friction, and its size repeats with the \
        arm's angle.",
    experiment: "slow turns from stop to stop, both ways: friction changes its sign with the direction, cogging \
        does not",
    look_alikes: &["arm.coulomb", "arm.cogging", "motor.ripple"],
    parameters: &[
        ParameterSpec {
            name: "torque",
            unit: "N m",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 1e3,
            off: 0.0,
            typical: Typical::Of(|p| 0.05 * super::stall_torque(p)),
            starts: &[0.3, 2.0],
        },
        ParameterSpec {
            name: "depth",
            unit: "-",
            kind: Kind::Share,
            default: None,
            min: 0.0,
            max: 1.0,
            off: 0.0,
            typical: Typical::Of(|_| 0.5),
            starts: &[1.0],
        },
        ParameterSpec {
            name: "order",
            unit: "-",
            kind: Kind::Whole,
            default: Some(1.0),
            min: 0.0,
            max: 1000.0,
            off: 0.0,
            typical: Typical::Of(|_| 1.0),
            starts: &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
        },
        PHASE,
    ],
    strengths: 1,
    footprint: Footprint::ARM_DAMPING,
    acts: Acts::DRY_FRICTION.and(Acts::SHAFT).and(Acts::ANGLE),
    at_rest: AtRest::Friction("dry friction has no slope at rest"),
    own: None,
    offered: Offered::OnRequest("its mean is Coulomb friction, and its orders and phases are many more starts of a \
        fit"),
};

impl<S: Scalar> Law<S> for ArmAngleFriction<S> {
    #[inline(always)]
    fn dry_friction(&self, at: &Instant<'_, S>) -> [S; 2] {
        let (sin, _) = (self.order * at.x.theta + self.phase).sin_cos();
        [self.torque * (S::ONE + self.depth * sin), S::ZERO]
    }
}
