//! A kick: `torque` on the arm for `duration` from `time` on, in one run.

use super::pulse::{DURATION, RUN, TIME};
use super::{Acts, AtRest, Footprint, Instant, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// A kick: `torque` on the arm for `duration` from `time` on, in one run.
    DisturbanceArmKick {
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
    id: "disturbance.arm_kick",
    name: "Kick of the arm",
    law: "torque on the arm while time <= t < time + duration, in run `run` alone",
    sentence: "The arm was pushed once.",
    shows: "One run, one moment: before and after it the model fits, within it the arm jumps.",
    experiment: "the same run again: a push does not come back at the same moment",
    look_alikes: &["disturbance.kick"],
    parameters: &[
        ParameterSpec {
            name: "torque",
            unit: "N m",
            kind: Kind::Real,
            default: None,
            min: -1e3,
            max: 1e3,
            off: 0.0,
            typical: Typical::Of(|p| 0.3 * super::stall_torque(p)),
            starts: &[0.5],
        },
        TIME,
        DURATION,
        RUN,
    ],
    strengths: 1,
    footprint: Footprint::UNCOMMANDED,
    acts: Acts::TORQUE.and(Acts::JUMPS).and(Acts::ARM),
    at_rest: AtRest::UNCOMMANDED,
    own: None,
    offered: Offered::Always,
};

impl<S: Scalar> Law<S> for DisturbanceArmKick<S> {
    #[inline(always)]
    fn jump_after(&self, run: usize, t: S) -> Option<S> {
        super::pulse::jump_after(self.run, self.time, self.duration, run, t)
    }

    #[inline(always)]
    fn torque(&self, at: &Instant<'_, S>) -> [S; 2] {
        let pulse = super::pulse::torque(self.run, self.time, self.duration, self.torque, &at.clock);
        [pulse, S::ZERO]
    }
}
