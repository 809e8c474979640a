//! Quadratic drag on the arm: `-coefficient * |theta_dot| * theta_dot`.

use super::{Acts, AtRest, Footprint, Instant, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// Quadratic drag on the arm: `-coefficient * |theta_dot| * theta_dot`.
    ArmQuadratic {
        /// Torque over speed squared, N m s2/rad2.
        coefficient,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "arm.quadratic",
    name: "Quadratic drag on the arm",
    law: "-coefficient * |theta_dot| * theta_dot",
    sentence: "The arm pushes air (or a fan, or an eddy-current brake works) and is braked with the square \
        of its speed.",
    shows: "Hardly anything at low speed; fast sweeps fall short in both directions.",
    experiment: "long fast turns of the arm at several speeds",
    look_alikes: &["arm.coulomb"],
    parameters: &[
        ParameterSpec {
            name: "coefficient",
            unit: "N m s2/rad2",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 1e3,
            off: 0.0,
            typical: Typical::Of(|p| 0.002 * super::stall_torque(p)),
            starts: &[0.3],
        },
    ],
    strengths: 1,
    footprint: Footprint::ARM_DAMPING,
    acts: Acts::TORQUE.and(Acts::SHAFT),
    at_rest: AtRest::Friction("at rest its slope is 0"),
    own: None,
    offered: Offered::Always,
};

impl<S: Scalar> Law<S> for ArmQuadratic<S> {
    #[inline(always)]
    fn torque(&self, at: &Instant<'_, S>) -> [S; 2] {
        let v = at.x.theta_dot;
        [-(self.coefficient * (v.abs() * v)), S::ZERO]
    }
}
