//! Stribeck friction on the arm: `-(coulomb + (static - coulomb) exp(-(theta_dot/velocity)²)) sign(theta_dot)`.

use super::{Acts, AtRest, Footprint, Instant, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// Stribeck friction on the arm: `-(coulomb + (static - coulomb) exp(-(theta_dot/velocity)²)) sign(theta_dot)`.
    ArmStribeck {
        /// Friction of a fast arm, N m.
        coulomb,
        /// Friction at rest, N m.
        r#static,
        /// Speed at which most of the difference is gone, rad/s.
        velocity,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "arm.stribeck",
    name: "Stribeck friction on the arm",
    law: "-(coulomb + (static - coulomb) exp(-(theta_dot/velocity)²)) sign(theta_dot)",
    sentence: "The arm rubs most at rest and less once it turns: it sticks, breaks loose, and then runs more easily.",
    shows: "Stick and slip at low speed; the error is largest near rest and of the sign of the speed.",
    experiment: "slow arm sweeps across zero speed at several accelerations, against steady turns",
    look_alikes: &["arm.coulomb", "arm.presliding"],
    parameters: &[
        ParameterSpec {
            name: "coulomb",
            unit: "N m",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 1e3,
            off: 0.0,
            typical: Typical::Of(|p| 0.05 * super::stall_torque(p)),
            starts: &[0.5],
        },
        ParameterSpec {
            name: "static",
            unit: "N m",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 1e3,
            off: 0.0,
            typical: Typical::Of(|p| 0.1 * super::stall_torque(p)),
            starts: &[0.75],
        },
        ParameterSpec {
            name: "velocity",
            unit: "rad/s",
            kind: Kind::Real,
            default: None,
            min: 1e-3,
            max: 1e3,
            off: 0.0,
            typical: Typical::Of(|_| 0.5),
            starts: &[1.0],
        },
    ],
    strengths: 2,
    footprint: Footprint::ARM_DAMPING,
    acts: Acts::DRY_FRICTION.and(Acts::SHAFT),
    at_rest: AtRest::Friction("dry friction has no slope at rest"),
    own: None,
    offered: Offered::Always,
};

impl<S: Scalar> Law<S> for ArmStribeck<S> {
    #[inline(always)]
    fn dry_friction(&self, at: &Instant<'_, S>) -> [S; 2] {
        let v = at.x.theta_dot / self.velocity;
        let level = self.coulomb + (self.r#static - self.coulomb) * (-(v * v)).exp();
        [level.if_less(S::ZERO, S::ZERO, level), S::ZERO]
    }

    #[inline(always)]
    fn contradiction(&self) -> Option<&'static str> {
        let grows = self.r#static.value() < self.coulomb.value();
        grows.then_some("this friction grows with the speed, where Stribeck's falls")
    }
}
