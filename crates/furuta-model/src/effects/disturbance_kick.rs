//! A kick: `torque` on the pendulum for `duration` from `time` on, in one run.

use super::pulse::{DURATION, RUN, TIME};
use super::{Acts, AtRest, Footprint, Instant, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// A kick: `torque` on the pendulum for `duration` from `time` on, in one run.
    DisturbanceKick {
        /// How strong it is, N m.
        torque,
        /// When it begins, s.
        time,
        /// How long it lasts, s.
        duration,
        /// Which run, from 0.
        run,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "disturbance.kick",
    name: "Kick of the pendulum",
    law: "torque on the pendulum while time <= t < time + duration, in run `run` alone",
    sentence: "The pendulum was pushed once.",
    shows: "One run, one moment: before and after it the model fits, within it the pendulum jumps.",
    experiment: "the same run again: a push does not come back at the same moment",
    look_alikes: &["disturbance.arm_kick"],
    parameters: &[
        ParameterSpec {
            name: "torque",
            unit: "N m",
            kind: Kind::Real,
            default: None,
            min: -1e3,
            max: 1e3,
            off: 0.0,
            typical: Typical::Of(|p| 0.3 * p.coefficients().weight),
            starts: &[0.5],
        },
        TIME,
        DURATION,
        RUN,
    ],
    strengths: 1,
    footprint: Footprint::UNCOMMANDED,
    acts: Acts::TORQUE.and(Acts::JUMPS).and(Acts::PENDULUM),
    at_rest: AtRest::UNCOMMANDED,
    own: None,
    offered: Offered::Always,
};

impl<S: Scalar> Law<S> for DisturbanceKick<S> {
    #[inline(always)]
    fn jump_after(&self, run: usize, t: S) -> Option<S> {
        super::pulse::jump_after(self.run, self.time, self.duration, run, t)
    }

    #[inline(always)]
    fn torque(&self, at: &Instant<'_, S>) -> [S; 2] {
        let pulse = super::pulse::torque(self.run, self.time, self.duration, self.torque, &at.clock);
        [S::ZERO, pulse]
    }
}
