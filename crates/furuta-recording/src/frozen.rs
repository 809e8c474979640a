//! Whether an encoder stops counting while its axis must move.

use core::f64::consts::PI;

use furuta_model::Rig;

use super::differences::{DIFFERENCE, differences};
use super::weak::{self, pendulum};
use super::{NoticeKind, Recording};

/// The shortest standstill that is looked at, s.
const SHORTEST: f64 = 0.7;
/// Samples of it at least.
const SAMPLES: usize = 20;
/// An arm that stands leaves the pendulum's equation this share of its motion at most; one that moves unseen leaves
/// more.
const LEFT: f64 = 0.004;
/// The pendulum's acceleration in that time at least, as a share of that of its full weight.
const MOVES: f64 = 0.05;
/// A standing pendulum that is pushed by this share of its weight is held by no friction.
const PUSHED: f64 = 0.2;

/// Suspects an encoder that stands while the other one shows that its axis moves: the arm's where the pendulum is
/// pushed by an arm that seems to stand, the
/// pendulum's where it seems to stand although the arm or its weight pushes it.
pub(super) fn frozen(recording: &Recording, rig: &Rig) -> Option<NoticeKind> {
    [("theta", &recording.theta), ("alpha", &recording.alpha)]
        .into_iter()
        .find_map(|(column, values)| {
            let (start, end) = standstill(recording, values)?;
            let must = if column == "theta" {
                arm_moves(recording, rig, (start, end))
            } else {
                pendulum_is_pushed(recording, rig, (start, end))
            };
            let at = |k: usize| recording.t.get(k).copied().unwrap_or_default();
            must.then(|| NoticeKind::FrozenSuspected {
                column,
                since: at(start),
                until: at(end - 1),
                at: values.get(start).copied().unwrap_or_default(),
            })
        })
}

/// The longest stretch in which a value does not change, `start..end`.
fn standstill(recording: &Recording, values: &[f64]) -> Option<(usize, usize)> {
    let mut longest = (0, 0);
    for segment in &recording.segments {
        let mut start = segment.start;
        for k in segment.clone() {
            if values.get(k) != values.get(start) {
                start = k;
            }
            if k + 1 - start > longest.1 - longest.0 {
                longest = (start, k + 1);
            }
        }
    }
    let samples = ((SHORTEST / recording.sample_period) as usize).max(SAMPLES);
    (longest.1 - longest.0 >= samples).then_some(longest)
}

/// Whether the pendulum's equation fails while theta stands: gravity and friction are what a standing arm leaves of it.
fn arm_moves(recording: &Recording, rig: &Rig, (start, end): (usize, usize)) -> bool {
    let c = rig.params.coefficients();
    let stretch = recording.part(start..end);
    let regression = pendulum::regression(&stretch, 1.0, PI).only(pendulum::STANDING);
    let left = regression.solve(weak::CORRELATED).map(|s| s.left);
    let columns = [stretch.theta.as_slice(), stretch.alpha.as_slice()];
    let (mut squares, mut count) = (0.0_f64, 0.0_f64);
    differences(&stretch, columns, DIFFERENCE, |[_, a]| {
        squares += a.acceleration * a.acceleration;
        count += 1.0;
    });
    let size = (squares / count).sqrt() * c.pendulum / c.weight;
    size > MOVES && left.is_some_and(|left| left > LEFT)
}

/// Whether arm and weight push a pendulum that seems to stand.
fn pendulum_is_pushed(recording: &Recording, rig: &Rig, (start, end): (usize, usize)) -> bool {
    let c = rig.params.coefficients();
    let columns = [recording.theta.as_slice(), recording.alpha.as_slice()];
    let (mut squares, mut count) = (0.0_f64, 0.0_f64);
    differences(recording, columns, DIFFERENCE, |[t, a]| {
        if (start..end).contains(&a.index) {
            let (sin, cos) = a.angle.sin_cos();
            let push = c.weight * sin + c.coupling * cos * t.acceleration;
            squares += push * push;
            count += 1.0;
        }
    });
    (squares / count).sqrt() > PUSHED * c.weight
}
