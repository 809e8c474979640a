//! Resolution of the command: `u -> step round(u/step)`.

use super::{Acts, AtRest, Footprint, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// Resolution of the command: `u -> step round(u/step)`.
    MotorResolution {
        /// From one level to the next, V.
        step,
    }
}

/// Smaller steps (V) are none.
const LEAST: f64 = 1e-9;

pub(super) const SPEC: Spec = Spec {
    id: "motor.resolution",
    name: "Resolution of the command",
    law: "u -> step round(u/step)",
    sentence: "The amplifier has few levels, as a timer of few counts gives for pulse-width modulation: a command \
        becomes the nearest of them.",
    shows: "Small changes of the command do nothing or too much; the error is at most half a step and does not grow \
        with the command.",
    experiment: "a slow ramp of the command over several steps with the arm turning",
    look_alikes: &["motor.deadzone", "arm.coulomb"],
    parameters: &[
        ParameterSpec {
            name: "step",
            unit: "V",
            kind: Kind::Spacing,
            default: None,
            min: 0.0,
            max: 1e3,
            off: 0.0,
            typical: Typical::Of(|p| 0.1 * p.motor.command_limit),
            starts: &[0.5, 1.0, 2.0],
        },
    ],
    strengths: 1,
    footprint: Footprint::GAIN_BY_LEVEL,
    acts: Acts::VOLTAGE,
    at_rest: AtRest::KINKED,
    own: None,
    offered: Offered::OnRequest("a data sheet tells it, and few amplifiers have so few levels that it shows"),
};

impl<S: Scalar> Law<S> for MotorResolution<S> {
    #[inline(always)]
    fn voltage(&self, _: S, volts: S) -> S {
        // A fit may come to no step at all.
        let least = S::from_f64(LEAST);
        let step = self.step.if_less(least, least, self.step);
        step * (volts / step).round()
    }
}
