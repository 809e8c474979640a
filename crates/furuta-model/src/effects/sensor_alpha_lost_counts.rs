//! Lost counts of the pendulum's encoder: `measured alpha = alpha + size` from a moment of one run on.

use super::pulse::RUN;
use super::sensor_theta_lost_counts::{self as of_theta, SIZE, TIME};
use super::{Acts, AtRest, Footprint, Law, Offered, Spec};
use crate::scalar::Scalar;

parameters! {
    /// Lost counts of the pendulum's encoder: `measured alpha = alpha + size` from a moment of one run on.
    SensorAlphaLostCounts {
        /// Counted too much, rad.
        size,
        /// From when on, s.
        time,
        /// In which run, from 0.
        run,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "sensor.alpha.lost_counts",
    name: "Lost counts of the pendulum's encoder",
    law: "measured alpha = alpha + size from time on, in run `run` alone",
    sentence: "The counter missed some of the encoder's edges, or counted some that were none (interference, a fast \
        swing): its zero is elsewhere since.",
    shows: "One run, one moment: the measured angle steps from one sample to the next; from then on the pendulum \
        seems to hang and to balance beside the vertical.",
    experiment: "the pendulum hanging at rest before and after the run: the angles read there differ",
    look_alikes: &["disturbance.kick", "sensor.alpha.offset"],
    parameters: &[SIZE, TIME, RUN],
    strengths: 1,
    footprint: Footprint::UNCOMMANDED,
    acts: Acts::COUNTS.and(Acts::PENDULUM),
    at_rest: AtRest::UNCOMMANDED,
    own: None,
    offered: Offered::OnRequest(
        "the zero of the whole recording follows a part of the step, and may hide its moment",
    ),
};

impl<S: Scalar> Law<S> for SensorAlphaLostCounts<S> {
    #[inline(always)]
    fn jump_after(&self, run: usize, t: S) -> Option<S> {
        of_theta::jump_after([self.size, self.time, self.run], run, t)
    }

    #[inline(always)]
    fn lost(&self, run: usize, t: S) -> [S; 2] {
        [S::ZERO, of_theta::lost([self.size, self.time, self.run], run, t)]
    }
}
