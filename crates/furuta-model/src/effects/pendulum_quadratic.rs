//! Air drag of the pendulum: `-coefficient * |alpha_dot| * alpha_dot`.

use super::{Acts, AtRest, Footprint, Instant, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// Air drag of the pendulum: `-coefficient * |alpha_dot| * alpha_dot`.
    PendulumQuadratic {
        /// Torque over speed squared, N m s2/rad2.
        coefficient,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "pendulum.quadratic",
    name: "Air drag of the pendulum",
    law: "-coefficient * |alpha_dot| * alpha_dot",
    sentence: "The pendulum pushes air and is braked with the square of its speed.",
    shows: "Large swings die out quickly, small ones last.",
    experiment: "a free decay of the pendulum from a large angle, the arm held",
    look_alikes: &["pendulum.coulomb"],
    parameters: &[
        ParameterSpec {
            name: "coefficient",
            unit: "N m s2/rad2",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 1e3,
            off: 0.0,
            typical: Typical::Of(|p| 0.001 * p.coefficients().weight),
            starts: &[0.3],
        },
    ],
    strengths: 1,
    footprint: Footprint::PENDULUM_DAMPING,
    acts: Acts::TORQUE.and(Acts::PENDULUM),
    at_rest: AtRest::Friction("at rest its slope is 0"),
    own: None,
    offered: Offered::Always,
};

impl<S: Scalar> Law<S> for PendulumQuadratic<S> {
    #[inline(always)]
    fn torque(&self, at: &Instant<'_, S>) -> [S; 2] {
        let v = at.x.alpha_dot;
        [S::ZERO, -(self.coefficient * (v.abs() * v))]
    }
}
