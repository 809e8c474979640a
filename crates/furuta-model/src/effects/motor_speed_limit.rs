//! Largest speed of an arm whose acceleration is commanded: `|theta'| <= speed`.

use super::{Acts, AtRest, Footprint, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// Largest speed of an arm whose acceleration is commanded: `|theta'| <= speed`.
    MotorSpeedLimit {
        /// Largest speed, rad/s.
        speed,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "motor.speed_limit",
    name: "Speed limit of the arm",
    law: "theta'' = u while |theta'| < speed or u against theta', else 0",
    sentence: "The driver of a stepper motor sends steps up to a rate: an arm that is so fast keeps its speed until \
        the command turns.",
    shows: "The arm's speed has a flat top; commands in its direction do nothing there.",
    experiment: "steps of the command held until the arm turns steadily",
    look_alikes: &["motor.saturation"],
    parameters: &[
        ParameterSpec {
            name: "speed",
            unit: "rad/s",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 1e3,
            off: 0.0,
            typical: Typical::Of(typical),
            // Halved again and again: a limit that is not reached changes nothing, and says nothing of where it is.
            starts: &[1.0, 0.5, 0.25, 0.125, 0.0625, 0.03125],
        },
    ],
    strengths: 1,
    footprint: Footprint::Nothing("small motions do not reach it"),
    acts: Acts::SPEED_LIMIT.and(Acts::BACKWARDS).and(Acts::LIMIT),
    at_rest: AtRest::LeftOut("a rig at rest is far from it"),
    offered: Offered::Always,
    own: None,
};

/// What the largest command reaches in a quarter of the pendulum's swing.
fn typical(p: &crate::Params<f64>) -> f64 {
    let c = p.coefficients();
    let quarter = 0.5 * core::f64::consts::PI * libm::sqrt(c.pendulum / c.weight.max(1e-12));
    p.motor.command_limit * quarter
}

impl<S: Scalar> Law<S> for MotorSpeedLimit<S> {
    #[inline(always)]
    fn speed_limit(&self) -> S {
        self.speed
    }
}
