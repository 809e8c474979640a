//! Coulomb friction of the pendulum: `-torque * sign(alpha_dot); at rest it holds up to torque`.

use super::{Acts, AtRest, Footprint, Instant, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// Coulomb friction of the pendulum: `-torque * sign(alpha_dot); at rest it holds up to torque`.
    PendulumCoulomb {
        /// Torque of friction, N m.
        torque,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "pendulum.coulomb",
    name: "Coulomb friction of the pendulum",
    law: "-torque * sign(alpha_dot); at rest it holds up to torque",
    sentence: "The hinge rubs with the same torque at any speed.",
    shows: "Free swings shrink by the same angle each period and stop at once; balancing leaves a small limit cycle.",
    experiment: "a free decay of the pendulum down to rest, the arm held",
    look_alikes: &["pendulum.quadratic"],
    parameters: &[
        ParameterSpec {
            name: "torque",
            unit: "N m",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 1e3,
            off: 0.0,
            typical: Typical::Of(|p| 0.02 * p.coefficients().weight),
            starts: &[0.3, 2.0],
        },
    ],
    strengths: 1,
    footprint: Footprint::PENDULUM_DAMPING,
    acts: Acts::DRY_FRICTION.and(Acts::PENDULUM),
    at_rest: AtRest::Friction("dry friction has no slope at rest"),
    own: None,
    offered: Offered::Always,
};

impl<S: Scalar> Law<S> for PendulumCoulomb<S> {
    #[inline(always)]
    fn dry_friction(&self, _: &Instant<'_, S>) -> [S; 2] {
        [S::ZERO, self.torque]
    }
}
