//! Sampling that jitters though the time stamps are even: the angles are read at `t + e`, `e` random.

use super::{Acts, AtRest, Footprint, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;
use crate::signals::random::{bits, normal};

parameters! {
    /// Sampling that jitters though the time stamps are even: the angles are read at `t + e`, `e` random.
    SensorJitter {
        /// Standard deviation of `e`, s.
        spread,
        /// Of the random numbers.
        seed,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "sensor.jitter",
    name: "Jitter of the sampling",
    law: "measured angles = angles + e speeds, e random at each sample: mean 0, standard deviation spread",
    sentence: "The samples are not taken when their time stamps say: the operating system wakes the program a little \
        sooner or later, and the stamps were counted, not measured.",
    shows: "White noise of both angles in proportion to their speeds, of the same sign where both turn the same way; a \
        rig at rest is quiet.",
    experiment: "the same motion with stamps from a hardware timer, or a pendulum that swings fast beside one that \
        hangs at rest",
    look_alikes: &["sensor.delay", "motor.delay"],
    parameters: &[
        ParameterSpec {
            name: "spread",
            unit: "s",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 1.0,
            off: 0.0,
            typical: Typical::Of(|_| 0.001),
            starts: &[1.0],
        },
        ParameterSpec {
            name: "seed",
            unit: "-",
            kind: Kind::Whole,
            default: Some(0.0),
            min: 0.0,
            max: 1e9,
            off: 0.0,
            typical: Typical::Of(|_| 1.0),
            starts: &[0.0],
        },
    ],
    strengths: 1,
    footprint: Footprint::UNCOMMANDED,
    acts: Acts::UNTIMELY,
    at_rest: AtRest::UNCOMMANDED,
    own: None,
    offered: Offered::Never(
        "no fit can follow random moments: a diagnosis measures its spread whatever is asked for",
    ),
};

/// Samples this far apart have random numbers of their own, s; the same in both precisions.
const TICK: f64 = 1e-4;

impl<S: Scalar> Law<S> for SensorJitter<S> {
    #[inline(always)]
    fn untimely(&self, run: usize, t: S) -> S {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let tick = libm::floor(t.value() / TICK + 0.5) as i64 as u64;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let seed = bits(self.seed.value() as u64, run as u64);
        self.spread * S::from_f64(normal(seed, tick))
    }
}
