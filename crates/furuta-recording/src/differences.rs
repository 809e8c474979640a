//! Speeds and accelerations of both angles by central differences.

use core::ops::Range;

use super::Recording;

/// Time over which the second difference is taken, s: long enough that a count of the encoder does not drown the
/// acceleration, short against a swing.
pub(super) const DIFFERENCE: f64 = 0.02;
/// A motion does not take up this speed, rad/s, between two samples and lose it between the next two: at 250 samples a
/// second that takes 2500 rad/s^2, and at their limits the motors of the built-in rigs give 70 to 1450.
const LONE_SPEED: f64 = 10.0;
/// Nor does rounding or a late sample make a step this many times those before and behind it.
const LONE_STEP: f64 = 3.0;
/// Steps of an encoder that rounding may put into one: half of one at either end, and one more of noise.
const LONE_COUNTS: f64 = 2.0;

/// An angle with its derivatives at one sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Differences {
    pub(super) index: usize,
    pub(super) angle: f64,
    pub(super) speed: f64,
    pub(super) acceleration: f64,
}

/// Calls `f` with the central differences of two columns at every sample that has them, and returns the lag of the
/// differences, in samples. None is taken across a step of an angle that is no motion, as lost counts leave it.
pub(super) fn differences(
    recording: &Recording,
    columns: [&[f64]; 2],
    span: f64,
    mut f: impl FnMut([Differences; 2]),
) -> Option<usize> {
    let lag = (span / recording.sample_period).round().max(1.0);
    if lag >= recording.len() as f64 {
        return None;
    }
    let (span, lag) = (lag * recording.sample_period, lag as usize);
    for segment in &recording.segments {
        let [Some(first), Some(second)] = columns.map(|c| c.get(segment.clone())) else {
            continue;
        };
        for stretch in stretches([first, second], recording.sample_period) {
            let [first, second] =
                [first, second].map(|column| column.get(stretch.clone()).unwrap_or_default());
            let windows = first.windows(2 * lag + 1).zip(second.windows(2 * lag + 1));
            for (k, (first, second)) in windows.enumerate() {
                f([first, second].map(|window| {
                    let [x0, x1, x2] = ends_and_middle(window, lag);
                    Differences {
                        index: segment.start + stretch.start + k + lag,
                        angle: x1,
                        speed: (x2 - x0) / (2.0 * span),
                        acceleration: (x2 - 2.0 * x1 + x0) / (span * span),
                    }
                }));
            }
        }
    }
    Some(lag)
}

fn ends_and_middle(window: &[f64], lag: usize) -> [f64; 3] {
    [0, lag, 2 * lag].map(|k| window.get(k).copied().unwrap_or(0.0))
}

/// The samples between the lone steps of either column.
pub(super) fn stretches(columns: [&[f64]; 2], period: f64) -> impl Iterator<Item = Range<usize>> {
    let samples = columns[0].len();
    let mut cuts = columns.map(|c| lone_steps(c, period)).concat();
    cuts.sort_unstable();
    let starts = core::iter::once(0).chain(cuts.clone());
    let ends = cuts.into_iter().chain(core::iter::once(samples));
    starts.zip(ends).map(|(start, end)| start..end)
}

/// The samples up to which a column steps by far more than it does before and behind.
fn lone_steps(column: &[f64], period: f64) -> Vec<usize> {
    let steps = || column.windows(2).map(|w| (w[1] - w[0]).abs());
    let count = (steps().filter(|step| *step > 0.0)).fold(f64::INFINITY, f64::min);
    let least = (LONE_SPEED * period).max(LONE_COUNTS * count);
    let before = core::iter::once(0.0).chain(steps());
    let behind = steps().skip(1).chain(core::iter::once(0.0));
    before
        .zip(steps())
        .zip(behind)
        .enumerate()
        .filter(|(_, ((before, step), behind))| {
            *step > least && *step > LONE_STEP * before.max(*behind)
        })
        .map(|(k, _)| k + 1)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_step_that_is_no_motion_is_left_out() {
        let h = 0.004;
        let angle = |k: usize| 0.5 * (8.0 * h * k as f64).sin();
        let count = core::f64::consts::TAU / 2048.0;
        let rounded = |x: f64| (x / count).round() * count;
        let sound: Vec<f64> = (0..1000).map(|k| rounded(angle(k))).collect();
        assert!(lone_steps(&sound, h).is_empty());
        // A kick: the speed changes between two samples, and stays changed.
        let kicked: Vec<f64> = (0..1000)
            .map(|k| rounded(angle(k.min(500)) + 15.0 * h * k.saturating_sub(500) as f64))
            .collect();
        assert!(lone_steps(&kicked, h).is_empty());
        // A sample that comes three periods late.
        let late: Vec<f64> = (0..1000)
            .map(|k| rounded(angle(if k < 700 { k } else { k + 2 })))
            .collect();
        assert!(lone_steps(&late, h).is_empty());
        let lost: Vec<f64> = (0..1000)
            .map(|k| rounded(angle(k) + if k < 300 { 0.0 } else { 0.15 }))
            .collect();
        assert_eq!(lone_steps(&lost, h), vec![300_usize]);
    }
}
