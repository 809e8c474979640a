//! A rectangular pulse in time, shared by the kicks.

use super::{Clock, Kind, ParameterSpec, Typical};
use crate::scalar::Scalar;

/// When it begins.
pub(super) const TIME: ParameterSpec = ParameterSpec {
    name: "time",
    unit: "s",
    kind: Kind::Time,
    default: None,
    min: 0.0,
    max: 1e6,
    off: 0.0,
    typical: Typical::Of(|_| 1.0),
    starts: &[0.0],
};

/// How long it lasts.
pub(super) const DURATION: ParameterSpec = ParameterSpec {
    name: "duration",
    unit: "s",
    kind: Kind::Real,
    default: None,
    min: 0.0,
    max: 1e6,
    off: 0.0,
    typical: Typical::Of(|_| 0.05),
    starts: &[0.4, 1.0, 2.5],
};

/// In which run.
pub(super) const RUN: ParameterSpec = ParameterSpec {
    name: "run",
    unit: "-",
    kind: Kind::Run,
    default: Some(0.0),
    min: 0.0,
    max: 1e6,
    off: 0.0,
    typical: Typical::Of(|_| 1.0),
    starts: &[0.0],
};

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
