//! Lost counts of the arm's encoder: `measured theta = theta + size` from a moment of one run on.

use super::pulse::{RUN, same};
use super::{Acts, AtRest, Footprint, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// Lost counts of the arm's encoder: `measured theta = theta + size` from a moment of one run on.
    SensorThetaLostCounts {
        /// Counted too much, rad.
        size,
        /// From when on, s.
        time,
        /// In which run, from 0.
        run,
    }
}

/// Of every encoder: how many counts too many, as an angle.
pub(super) const SIZE: ParameterSpec = ParameterSpec {
    name: "size",
    unit: "rad",
    kind: Kind::Real,
    default: None,
    min: -100.0,
    max: 100.0,
    off: 0.0,
    typical: Typical::Of(|_| 0.05),
    starts: &[1.0],
};
/// Since when: no fit moves it.
pub(super) const TIME: ParameterSpec = ParameterSpec {
    kind: Kind::Moment,
    ..super::pulse::TIME
};
pub(super) const SPEC: Spec = Spec {
    id: "sensor.theta.lost_counts",
    name: "Lost counts of the arm's encoder",
    law: "measured theta = theta + size from time on, in run `run` alone",
    sentence: "The counter missed some of the encoder's edges, or counted some that were none (interference, a step \
        too fast for it): its zero is elsewhere since.",
    shows: "One run, one moment: the measured angle steps from one sample to the next, its speed before and after is \
        the same, and so is the motion.",
    experiment: "the arm brought back to a mark after the run: the angle read there is not that of before",
    look_alikes: &["disturbance.arm_kick", "sensor.theta.scale"],
    parameters: &[SIZE, TIME, RUN],
    strengths: 1,
    footprint: Footprint::UNCOMMANDED,
    acts: Acts::COUNTS,
    at_rest: AtRest::UNCOMMANDED,
    own: None,
    offered: Offered::OnRequest(
        "thousands of moments are tried, and a step of less than a count explains a little of much: it accused a sound rig",
    ),
};

/// What is lost at time `t` of a run.
#[inline(always)]
pub(super) fn lost<S: Scalar>([size, time, of]: [S; 3], run: usize, t: S) -> S {
    if same(of, run) {
        t.if_less(time, S::ZERO, size)
    } else {
        S::ZERO
    }
}

/// The moment, if it is still to come.
#[inline(always)]
pub(super) fn jump_after<S: Scalar>([_, time, of]: [S; 3], run: usize, t: S) -> Option<S> {
    (same(of, run) && time.real() > t.real()).then_some(time)
}

impl<S: Scalar> Law<S> for SensorThetaLostCounts<S> {
    #[inline(always)]
    fn jump_after(&self, run: usize, t: S) -> Option<S> {
        jump_after([self.size, self.time, self.run], run, t)
    }

    #[inline(always)]
    fn lost(&self, run: usize, t: S) -> [S; 2] {
        [lost([self.size, self.time, self.run], run, t), S::ZERO]
    }
}
