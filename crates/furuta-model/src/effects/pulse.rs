//! A rectangular pulse in time, shared by the kicks.

use super::Clock;
use crate::scalar::Scalar;

/// The first edge after `t`; none in other runs.
#[inline(always)]
pub(super) fn jump_after<S: Scalar>(of: S, time: S, duration: S, run: usize, t: S) -> Option<S> {
    if !same(of, run) {
        return None;
    }
    let now = t.real();
    [time, time + duration]
        .into_iter()
        .find(|edge| edge.real() > now)
}

/// `torque` within the pulse, nothing outside it.
#[inline(always)]
pub(super) fn torque<S: Scalar>(of: S, time: S, duration: S, torque: S, clock: &Clock<S>) -> S {
    let now = clock.within.real();
    if same(of, clock.run) && now >= time.real() && now < (time + duration).real() {
        torque
    } else {
        S::ZERO
    }
}

/// Whether what belongs to the run `of` acts in this one.
#[inline(always)]
pub(super) fn same<S: Scalar>(of: S, run: usize) -> bool {
    #[allow(clippy::cast_precision_loss)]
    let run = run as f64;
    of.value() == run
}
