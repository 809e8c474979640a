//! Limit of the motor's current: `|drive u - back_emf arm_damping theta_dot| <= limit`.

use super::{Acts, AtRest, Footprint, Instant, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use super::motor_inductance::BACK_EMF;
use crate::scalar::Scalar;

parameters! {
    /// Limit of the motor's current: `|drive u - back_emf arm_damping theta_dot| <= limit`.
    MotorCurrentLimit {
        /// Torque of the largest current, N m.
        limit,
        /// The part of the arm's damping that is back-EMF, 0 to 1.
        back_emf,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "motor.current_limit",
    name: "Limit of the motor's current",
    law: "|drive u - back_emf arm_damping theta_dot| <= limit",
    sentence: "The amplifier limits the current, and with it the torque: a motor at rest gives no more at the full \
        voltage than at a part of it, while one that turns does.",
    shows: "Large commands do less than they should while the arm is slow or is being braked; once it runs with the \
        voltage they are exact.",
    experiment: "the full voltage from rest, and the same voltage reversed at speed",
    look_alikes: &["motor.saturation", "motor.asymmetry"],
    parameters: &[
        ParameterSpec {
            name: "limit",
            unit: "N m",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 1e6,
            off: 0.0,
            typical: Typical::Of(|p| 0.4 * super::stall_torque(p)),
            // A limit above what was reached does nothing: halves, down to a thirtieth of the stall torque.
            starts: &[0.7, 1.2, 1.8, 0.35, 0.175, 0.0875],
        },
        BACK_EMF,
    ],
    strengths: 1,
    footprint: Footprint::GAIN_BY_LEVEL,
    acts: Acts::TORQUE
        .and(Acts::SHAFT)
        .and(Acts::CURRENT)
        .and(Acts::BACKWARDS)
        .and(Acts::LIMIT),
    at_rest: AtRest::LeftOut("the current is taken not to reach its limit"),
    own: None,
    offered: Offered::OnRequest("where the back-EMF takes little of the voltage it is motor.saturation"),
};

impl<S: Scalar> Law<S> for MotorCurrentLimit<S> {
    #[inline(always)]
    fn torque(&self, at: &Instant<'_, S>) -> [S; 2] {
        let c = at.coefficients;
        let wanted = c.drive * at.volts - self.back_emf * c.arm_damping * at.x.theta_dot;
        [wanted.clamp(-self.limit, self.limit) - wanted, S::ZERO]
    }
}
