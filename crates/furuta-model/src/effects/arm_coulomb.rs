//! Coulomb friction on the arm: `-torque * sign(theta_dot); at rest it holds up to torque`.

use super::{Acts, AtRest, Footprint, Instant, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// Coulomb friction on the arm: `-torque * sign(theta_dot); at rest it holds up to torque`.
    ArmCoulomb {
        /// Torque of friction, N m.
        torque,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "arm.coulomb",
    name: "Coulomb friction on the arm",
    law: "-torque * sign(theta_dot); at rest it holds up to torque",
    sentence: "Bearing, brushes or gear rub with the same torque at any speed, and hold the arm still \
        until the motor pulls harder. Friction that is stronger in one direction is this, half the sum of both, and \
        an offset of the motor's voltage (motor.bias), half their difference.",
    shows: "The arm comes to rest early and stays; the error changes sign with the arm's direction and \
        does not grow with its speed.",
    experiment: "slow arm sweeps with many reversals, and starts from rest with slowly rising voltage",
    look_alikes: &["arm.stribeck", "motor.deadzone", "arm.presliding"],
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
    ],
    strengths: 1,
    footprint: Footprint::ARM_DAMPING,
    acts: Acts::DRY_FRICTION.and(Acts::SHAFT),
    at_rest: AtRest::Friction("dry friction has no slope at rest"),
    own: None,
    offered: Offered::Always,
};

impl<S: Scalar> Law<S> for ArmCoulomb<S> {
    #[inline(always)]
    fn dry_friction(&self, _: &Instant<'_, S>) -> [S; 2] {
        [self.torque, S::ZERO]
    }
}
