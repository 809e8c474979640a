//! Transverse inertia of the pendulum: `inertia * sin²(alpha) more on the arm's axis`.

use super::{Acts, AtRest, Footprint, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::params::Coefficients;
use crate::scalar::Scalar;

parameters! {
    /// Transverse inertia of the pendulum: `inertia * sin²(alpha) more on the arm's axis`.
    PendulumInertiaTransverse {
        /// Inertia beyond that of the rig file, kg m2.
        inertia,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "pendulum.inertia_transverse",
    name: "Transverse inertia of the pendulum",
    law: "inertia * sin²(alpha) more on the arm's axis",
    sentence: "A swung-out pendulum is harder to turn about the arm's axis, by its own inertia and not \
        only by its mass.",
    shows: "The arm answers more slowly than the model while the pendulum is horizontal.",
    experiment: "fast arm motion while the pendulum passes the horizontal",
    look_alikes: &["arm.quadratic"],
    parameters: &[
        ParameterSpec {
            name: "inertia",
            unit: "kg m2",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 100.0,
            off: 0.0,
            typical: Typical::Of(|p| 0.2 * p.coefficients().pendulum),
            starts: &[0.0],
        },
    ],
    strengths: 1,
    footprint: Footprint::Nothing("it acts with the square of the pendulum's angle from hanging"),
    acts: Acts::SHAPE.and(Acts::PENDULUM),
    at_rest: AtRest::Slope,
    own: None,
    offered: Offered::Always,
};

impl<S: Scalar> Law<S> for PendulumInertiaTransverse<S> {
    #[inline(always)]
    fn shape(&self, mut coefficients: Coefficients<S>) -> Coefficients<S> {
        coefficients.swing += self.inertia;
        coefficients
    }
}
