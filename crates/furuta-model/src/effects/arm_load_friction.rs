//! Friction of the arm under load: dry friction of `coefficient |drive u - back_emf arm_damping theta_dot|`.

use super::{Acts, AtRest, Footprint, Instant, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use super::motor_inductance::BACK_EMF;
use crate::scalar::Scalar;

parameters! {
    /// Friction of the arm under load: dry friction of `coefficient |drive u - back_emf arm_damping theta_dot|`, the
    /// torque that the motor passes on, as gears have it (the load-dependent term of the BAM servo models, Duclusaud et
    /// al., 2025).
    ArmLoadFriction {
        /// Friction over the torque that the motor passes on, -.
        coefficient,
        /// The part of the arm's damping that is back-EMF, 0 to 1: the rest brakes the arm itself, and passes no gears.
        back_emf,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "arm.load_friction",
    name: "Friction of the arm under load",
    law: "dry friction of coefficient |drive u - back_emf arm_damping theta_dot|; at rest it holds up to that",
    sentence: "Gears rub in proportion to the torque that they pass on: what arrives at the arm is less than what \
        the motor gives.",
    shows: "The error has the sign of the arm's speed and grows with the voltage; an arm that coasts without \
        voltage shows little.",
    experiment: "the same slow turn against a weak and against a strong pull, both ways",
    look_alikes: &["arm.coulomb", "motor.asymmetry", "motor.deadzone"],
    parameters: &[
        ParameterSpec {
            name: "coefficient",
            unit: "-",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 0.99,
            off: 0.0,
            typical: Typical::Of(|_| 0.2),
            starts: &[0.5],
        },
        BACK_EMF,
    ],
    strengths: 1,
    footprint: Footprint::ARM_DAMPING,
    acts: Acts::DRY_FRICTION.and(Acts::SHAFT),
    at_rest: AtRest::Friction("dry friction has no slope at rest"),
    own: None,
    offered: Offered::OnRequest("under a command of one size it is Coulomb friction with another motor gain"),
};

impl<S: Scalar> Law<S> for ArmLoadFriction<S> {
    #[inline(always)]
    fn dry_friction(&self, at: &Instant<'_, S>) -> [S; 2] {
        let c = at.coefficients;
        let passed = c.drive * at.volts - self.back_emf * c.arm_damping * at.x.theta_dot;
        [self.coefficient * passed.abs(), S::ZERO]
    }
}
