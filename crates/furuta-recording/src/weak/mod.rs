//! Equations of motion in their weak form: multiplied by a smooth bump and integrated, so that no angle is
//! differentiated twice.
//!
//! A second difference drowns in counts, and lowers the harmonics of a large motion. Integrated by parts, the
//! derivatives act on the bump, which is known exactly.

pub(super) mod arm;
pub(super) mod pendulum;

use core::ops::Range;

use super::Recording;
use super::differences::stretches;

/// Half the width of a bump, in samples, at least.
const LEAST_HALF: usize = 6;
/// Speeds are differences over this much either way, s.
const SPEED: f64 = 0.006;
/// Speed below which the direction of dry friction is smooth, rad/s.
const SLOW: f64 = 0.1;
/// Bumps over a recording at most; over a longer one they lie further apart.
const BUMPS: usize = 1000;
/// Bumps overlap: one in this many is independent.
pub(super) const CORRELATED: f64 = 2.0;

/// The bump and its first two derivatives by time at one sample of it.
#[derive(Clone, Copy)]
struct Weight {
    phi: f64,
    slope: f64,
    curvature: f64,
}

/// A bump laid over a stretch of a recording.
struct Window<'a> {
    theta: &'a [f64],
    alpha: &'a [f64],
    /// Samples by which the window begins before the bump and ends behind it: speeds reach as far.
    lag: usize,
    period: f64,
    /// Place of the bump's first sample in the recording.
    first: usize,
}

impl Window<'_> {
    /// Both angles under the bump's sample `j`.
    fn at(&self, j: usize) -> [f64; 2] {
        [self.theta, self.alpha].map(|v| v.get(j + self.lag).copied().unwrap_or_default())
    }

    /// Their speeds.
    fn speeds(&self, j: usize) -> [f64; 2] {
        [self.theta, self.alpha].map(|v| {
            let [before, after] =
                [j, j + 2 * self.lag].map(|k| v.get(k).copied().unwrap_or_default());
            (after - before) / (2.0 * self.lag as f64 * self.period)
        })
    }
}

/// Lays bumps of `half` s from centre to end over a recording and calls `f` with each.
fn over(recording: &Recording, half: f64, mut f: impl FnMut(&Window, &[Weight])) {
    let h = recording.sample_period;
    let half = ((half / h).round() as usize).max(LEAST_HALF);
    let lag = ((SPEED / h).round() as usize).max(1);
    let bump: Vec<Weight> = (0..=2 * half)
        .map(|j| Weight::of(j as f64 / half as f64 - 1.0, half as f64 * h))
        .collect();
    let samples = 2 * (half + lag) + 1;
    let stride = half.div_ceil(2).max(recording.len() / BUMPS);
    for stretch in unbroken(recording) {
        let columns = [&recording.theta, &recording.alpha].map(|c| c.get(stretch.clone()));
        let [Some(theta), Some(alpha)] = columns else {
            continue;
        };
        let windows = theta.windows(samples).zip(alpha.windows(samples));
        for (k, (theta, alpha)) in windows.enumerate().step_by(stride) {
            let window = Window {
                theta,
                alpha,
                lag,
                period: h,
                first: stretch.start + lag + k,
            };
            f(&window, &bump);
        }
    }
}

/// The stretches without a gap, and without a step of either angle that is no motion.
fn unbroken(recording: &Recording) -> impl Iterator<Item = Range<usize>> {
    recording.segments.iter().flat_map(|segment| {
        let columns = [&recording.theta, &recording.alpha];
        let columns = columns.map(|c| c.get(segment.clone()).unwrap_or_default());
        let within = stretches(columns, recording.sample_period);
        within.map(|s| segment.start + s.start..segment.start + s.end)
    })
}

impl Weight {
    /// `(1 - x²)^4`, `half` s from centre to end.
    fn of(x: f64, half: f64) -> Self {
        let inside = (1.0 - x * x).max(0.0);
        Self {
            phi: inside.powi(4),
            slope: -8.0 * x * inside.powi(3) / half,
            curvature: (48.0 * x * x * inside.powi(2) - 8.0 * inside.powi(3)) / (half * half),
        }
    }
}
