//! Tilted base: gravity leans by `angle` towards the arm direction `theta = direction`.

use super::{Acts, AtRest, Footprint, Instant, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// Tilted base: gravity leans by `angle` towards the arm direction `theta = direction`.
    ArmTilt {
        /// By how much the motor's axis leans, rad.
        angle,
        /// The arm angle towards which it leans: where the arm points downhill, rad.
        direction,
        /// What the arm weighs down beside the pendulum: its own moment about the axis, in units of the pendulum's
        /// `m L_r`.
        unbalance,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "arm.tilt",
    name: "Tilted base",
    law: "gravity = g [sin(angle) cos(direction), sin(angle) sin(direction), -cos(angle)] in the base's axes",
    sentence: "The table is not level: the arm rolls towards its lowest point and the pendulum's upright \
        is not where it seems.",
    shows: "The arm is pulled towards one direction like a pendulum, and where the pendulum balances \
        depends on where the arm points.",
    experiment: "the pendulum hanging at rest with the arm in several directions: a level base shows the \
        same angle everywhere",
    look_alikes: &["motor.bias", "sensor.alpha.offset", "arm.spring"],
    parameters: &[
        ParameterSpec {
            name: "angle",
            unit: "rad",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 1.6,
            off: 0.0,
            typical: Typical::Of(|_| 0.05),
            starts: &[0.3],
        },
        ParameterSpec {
            name: "direction",
            unit: "rad",
            kind: Kind::Phase,
            default: None,
            min: -100.0,
            max: 100.0,
            off: 0.0,
            typical: Typical::Of(|_| 1.0),
            starts: &[0.0],
        },
        // A level rig shows neither the arm's own moment nor, beside `m c`, where the pendulum's centre of mass is: a
        // fit of a tilted one finds both here.
        ParameterSpec {
            name: "unbalance",
            unit: "-",
            kind: Kind::Real,
            default: Some(0.0),
            min: -0.9,
            max: 10.0,
            off: 0.0,
            typical: Typical::Of(|_| 1.0),
            starts: &[0.0],
        },
    ],
    strengths: 1,
    footprint: Footprint::Own(&["angle"]),
    acts: Acts::TORQUE.and(Acts::ANGLE),
    at_rest: AtRest::Slope,
    own: None,
    offered: Offered::Always,
};

impl<S: Scalar> Law<S> for ArmTilt<S> {
    /// From the potential energy `m g [c cos(alpha) cos(angle) - sin(angle) ((1 + unbalance) L_r cos(e) + c sin(alpha)
    /// sin(e))]`, `e = theta - direction`.
    #[inline(always)]
    fn torque(&self, at: &Instant<'_, S>) -> [S; 2] {
        let (c, a) = (at.coefficients, at.angle);
        let (lean_sin, lean_cos) = self.angle.sin_cos();
        let (sin, cos) = (at.x.theta - self.direction).sin_cos();
        [
            lean_sin * (c.weight * a.sin * cos - c.lever * (self.unbalance + S::ONE) * sin),
            c.weight * (lean_sin * a.cos * sin - (S::ONE - lean_cos) * a.sin),
        ]
    }
}
