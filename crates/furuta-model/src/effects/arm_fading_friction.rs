//! Friction of the arm that fades: dry friction of `torque exp(-t/time_constant)`.

use super::{Acts, AtRest, Footprint, Instant, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// Friction of the arm that fades: dry friction of `torque exp(-t/time_constant)`.
    ArmFadingFriction {
        /// Friction at the run's start, N m.
        torque,
        /// In which it falls to 1/e, s.
        time_constant,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "arm.fading_friction",
    name: "Friction of the arm that fades",
    law: "dry friction of torque exp(-t/time_constant)",
    sentence: "A rig that has rested rubs more at first: its grease warms and spreads, and the arm turns more easily \
        as the run goes on.",
    shows: "An error of the sign of the arm's speed that is largest at the run's start and gone by its end.",
    experiment: "the same excitation at the beginning and at the end of a long run, and again right after it",
    look_alikes: &["arm.coulomb", "arm.stribeck", "motor.drift"],
    parameters: &[
        ParameterSpec {
            name: "torque",
            unit: "N m",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 1e3,
            off: 0.0,
            typical: Typical::Of(|p| 0.1 * super::stall_torque(p)),
            starts: &[0.5],
        },
        ParameterSpec {
            name: "time_constant",
            unit: "s",
            kind: Kind::Real,
            default: None,
            min: 0.01,
            max: 1e4,
            off: 0.0,
            typical: Typical::Of(|_| 5.0),
            starts: &[0.4, 2.0],
        },
    ],
    strengths: 1,
    footprint: Footprint::ARM_DAMPING,
    acts: Acts::DRY_FRICTION.and(Acts::SHAFT).and(Acts::CLOCK),
    at_rest: AtRest::Friction("dry friction has no slope at rest"),
    own: None,
    offered: Offered::OnRequest("in recordings much shorter than its time constant it is Coulomb friction, and a rig \
        that is warm has none"),
};

impl<S: Scalar> Law<S> for ArmFadingFriction<S> {
    #[inline(always)]
    fn dry_friction(&self, at: &Instant<'_, S>) -> [S; 2] {
        [self.torque * (-(at.clock.t / self.time_constant)).exp(), S::ZERO]
    }
}
