//! Resonance of a stepper motor: the arm rings about the commanded course.

use super::resonance::Resonance;
use super::{Acts, AtRest, Footprint, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// Resonance of a stepper motor: the arm rings about the commanded course.
    MotorResonance {
        /// Of a free swing without damping, s.
        period,
        /// Of critical damping.
        damping,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "motor.resonance",
    name: "Resonance of the stepper motor",
    law: "theta'' = w^2 e + 2 damping w e', e'' = u - theta'', w = 2 pi/period",
    sentence: "The field holds a stepper motor's rotor as a spring does: the arm follows the commanded course by \
        ringing about it. What the pendulum does to it is left out.",
    shows: "After each change of the command the arm's speed swings about the commanded one, always at one rate.",
    experiment: "steps of the command, read by an encoder on the arm, five times in a period or more",
    look_alikes: &["motor.lag", "motor.delay"],
    parameters: &[
        ParameterSpec {
            name: "period",
            unit: "s",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 10.0,
            off: 0.0,
            // Motors of this size have 50 to 150 Hz, and less with an arm on them.
            typical: Typical::Is(0.03),
            starts: &[0.5, 1.0, 2.0],
        },
        ParameterSpec {
            name: "damping",
            unit: "-",
            kind: Kind::Real,
            default: Some(0.1),
            min: 0.0,
            // Critical damping is a limit of the formula.
            max: 0.99,
            off: 0.0,
            typical: Typical::Is(0.1),
            starts: &[1.0],
        },
    ],
    strengths: 1,
    footprint: Footprint::Like("motor.lag", "below its rate it is late as a lag is"),
    acts: Acts::RESONANCE,
    at_rest: AtRest::Slope,
    own: None,
    offered: Offered::OnRequest("it is seen by an encoder on the arm alone, at sample rates that kits seldom have"),
};

impl<S: Scalar> Law<S> for MotorResonance<S> {
    #[inline(always)]
    fn resonance(&self) -> Resonance<S> {
        Resonance {
            period: self.period,
            damping: self.damping,
        }
    }
}
