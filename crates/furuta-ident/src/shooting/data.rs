//! Recordings made ready for fitting: noise floor, weights, speeds, windows.

use core::f64::consts::{PI, TAU};

use furuta_model::{Rig, State};
use nalgebra::{SMatrix, SVector};

use super::noise::{Stretch, noise_floor};
use super::reversals::Reversals;
use crate::pendulum::Pendulum;
use crate::recording::{Recording, hangs};

/// A stretch of a recording without a gap.
#[derive(Clone, Debug)]
pub(crate) struct Run {
    /// Name of the recording.
    pub(crate) name: String,
    /// Index of the recording it comes from.
    pub(crate) recording: usize,
    /// Sample period, s; of samples that are not evenly spaced the mean interval.
    pub(crate) h: f64,
    /// Time of the first sample, s.
    pub(crate) t0: f64,
    /// Times of the samples as recorded, s, where they are not evenly spaced; then `h` is the mean interval. Empty
    /// where they are.
    times: Vec<f64>,
    /// Command from each sample to the next, V.
    pub(crate) u: Vec<f64>,
    /// Command before the first sample: zero for a rig at rest, otherwise the first one, V.
    pub(crate) u_before: f64,
    /// Measured `[theta, alpha]`, rad.
    pub(crate) y: Vec<[f64; 2]>,
    /// Speeds from local polynomials, rad/s.
    pub(crate) speed: Vec<[f64; 2]>,
    /// Where the arm turned back.
    pub(crate) reversals: Reversals,
    /// Root of the weight of each residual, 1 for a fast encoder, less where counts are rare, 0 where the angle is not
    /// looked at.
    pub(crate) weight: Vec<[f64; 2]>,
    /// What the rig was when it was recorded.
    pub(crate) state: Pendulum,
}

/// A stretch predicted from one initial state: samples `start + 1 ..= start + len`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Window {
    /// Index into the runs.
    pub(crate) run: usize,
    /// The sample whose state is free.
    pub(crate) start: usize,
    /// How many samples are predicted.
    pub(crate) len: usize,
}

/// Everything a fit is given.
#[derive(Clone, Debug)]
pub(crate) struct Data {
    /// The stretches.
    pub(crate) runs: Vec<Run>,
    /// Standard deviation of the encoders' noise, `[theta, alpha]`, rad.
    pub(crate) noise: [f64; 2],
    /// How many recordings they come from.
    pub(crate) recordings: usize,
}

/// A pendulum that rests no further than this from straight down hangs, rad: encoders that are off and tilted bases
/// move it by less, and what a hand lets go swings further.
const HANGING: f64 = 0.2;
/// Samples either side of the local polynomials that give speeds; 13 samples in all.
const HALF: usize = 6;
/// How fast an encoder moves is an average over the time in which it moves by this many counts. From one sample to the
/// next it is fast where the reading steps by a count, and there it is farthest from the true angle.
const COUNTS: f64 = 3.0;
/// At most this time on either side, s.
const STEADY: f64 = 0.05;
/// The way of an arm that turns back is smoothed over this time on either side, s.
const TURN: f64 = 0.02;
/// A sample counts fully where the encoder moves a count per sample, and never less than this.
const LEAST_WEIGHT: f64 = 0.05;

impl Data {
    /// Sum of the weights of a window's samples: the cost that noise alone leaves, but for the degrees of freedom.
    pub(crate) fn samples(&self, w: &Window) -> f64 {
        let run = &self.runs[w.run];
        run.weight[w.start + 1..=w.start + w.len]
            .iter()
            .map(|w| w[0] * w[0] + w[1] * w[1])
            .sum()
    }

    /// What the rig was at each recording.
    pub(crate) fn states(&self) -> Vec<Pendulum> {
        let mut states = vec![Pendulum::Swings; self.recordings];
        for run in &self.runs {
            states[run.recording] = run.state;
        }
        states
    }

    /// What a perfect model leaves in a window: one for each sample, less those that its initial state takes; at least
    /// one.
    pub(crate) fn floor(&self, w: &Window) -> f64 {
        (self.samples(w) - self.initial(w)).max(1.0)
    }

    /// How many numbers of a window's initial state its samples determine: two for each angle that is looked at.
    fn initial(&self, w: &Window) -> f64 {
        let looked_at = self.runs[w.run].state.looks_at();
        looked_at.iter().filter(|at| **at).count() as f64 * 2.0
    }

    /// All stretches of all recordings of the rig as it is built, ready to fit.
    pub(crate) fn new(recordings: &[Recording], rig: &Rig) -> Self {
        Self::in_states(recordings, rig, |_| Pendulum::Swings)
    }

    /// The same of the rig in the state that it was in at each recording, by its number.
    pub(crate) fn in_states(
        recordings: &[Recording],
        rig: &Rig,
        state: impl Fn(usize) -> Pendulum,
    ) -> Self {
        let resolution = rig.sensors.resolution();
        let mut runs = Vec::new();
        for (i, r) in recordings.iter().enumerate() {
            let state = state(i);
            let r = &*state.seen(r);
            for segment in &r.segments {
                if segment.len() < 4 * HALF {
                    continue;
                }
                let y: Vec<[f64; 2]> = segment.clone().map(|k| [r.theta[k], r.alpha[k]]).collect();
                let h = r.sample_period;
                let times = if r.is_uneven() {
                    segment.clone().map(|k| r.t[k] - r.t[0]).collect()
                } else {
                    Vec::new()
                };
                let speed = smoothed(&y, &times, h, HALF).1;
                let looked_at = state.looks_at();
                let counts: Vec<[f64; 2]> = (speed.iter())
                    .map(|v| [0, 1].map(|c| v[c].abs() * h / resolution[c]))
                    .collect();
                let weight = steady(&counts, (STEADY / h).round() as usize)
                    .map(|moved| {
                        std::array::from_fn(|c| {
                            if !looked_at[c] {
                                return 0.0;
                            }
                            moved[c].clamp(LEAST_WEIGHT, 1.0).sqrt()
                        })
                    })
                    .collect();
                let at_rest = y[..HALF]
                    .iter()
                    .all(|v| (0..2).all(|c| (v[c] - y[0][c]).abs() <= 1.5 * resolution[c]));
                runs.push(Run {
                    name: r.name.clone(),
                    recording: i,
                    h,
                    t0: r.t[segment.start] - r.t[0],
                    times,
                    u_before: if at_rest { 0.0 } else { r.u[segment.start] },
                    u: segment.clone().map(|k| r.u[k]).collect(),
                    y,
                    speed,
                    reversals: Reversals::default(),
                    weight,
                    state,
                });
            }
        }
        let stretches: Vec<Stretch<'_>> = (runs.iter())
            .map(|run: &Run| Stretch {
                y: &run.y,
                times: &run.times,
                h: run.h,
            })
            .collect();
        let noise: [f64; 2] = std::array::from_fn(|c| noise_floor(&stretches, c, resolution[c]));
        for run in &mut runs {
            let half = ((TURN / run.h).round() as usize).max(HALF);
            let angles = smoothed(&run.y, &run.times, run.h, half).0;
            run.reversals = Reversals::new(angles.iter().map(|y| y[0]).collect(), noise[0]);
        }
        Self {
            runs,
            noise,
            recordings: recordings.len(),
        }
    }

    /// Consecutive windows of about `seconds` over the runs that `wanted` keeps; a remainder shorter than half a window
    /// is left out.
    pub(crate) fn windows(&self, seconds: f64, wanted: impl Fn(&Run) -> bool) -> Vec<Window> {
        let mut windows = Vec::new();
        for (i, run) in self.runs.iter().enumerate().filter(|(_, r)| wanted(r)) {
            let last = run.y.len() - 1;
            let len = ((seconds / run.h).round() as usize).clamp(8, last);
            let mut start = run.unknown_before();
            while start + len / 2 < last {
                let len = len.min(last - start);
                windows.push(Window { run: i, start, len });
                start += len;
            }
        }
        windows
    }

    /// A first guess of the state at a window's start, from a polynomial over `half` samples either side.
    pub(crate) fn guess(&self, w: &Window, half: usize) -> State<f64> {
        let run = &self.runs[w.run];
        let (y, v) = local_fit(&run.y, &run.times, w.start, half, run.h);
        State::new(y[0], y[1], v[0], v[1])
    }
}

impl Run {
    /// Whether the samples are not evenly spaced.
    #[inline]
    pub(crate) fn is_uneven(&self) -> bool {
        !self.times.is_empty()
    }

    /// Time of sample `k`, s.
    #[inline]
    pub(crate) fn time(&self, k: usize) -> f64 {
        match self.times.get(k) {
            Some(t) => *t,
            None => self.t0 + k as f64 * self.h,
        }
    }

    /// From sample `k` to the next, s.
    #[inline]
    pub(crate) fn interval(&self, k: usize) -> f64 {
        match self.times.get(k..k + 2) {
            Some([t, next]) => next - t,
            _ => self.h,
        }
    }

    /// How many samples come nearest to `seconds`, at least one.
    pub(crate) fn samples_in(&self, seconds: f64) -> usize {
        ((seconds / self.h).round() as usize).max(1)
    }

    /// The last sample at or before the time `t` (s), of samples that are not evenly spaced; the first where all are
    /// later.
    pub(crate) fn sample_at(&self, t: f64) -> usize {
        self.times
            .partition_point(|time| *time <= t)
            .saturating_sub(1)
    }

    /// This many samples at the start are only led in: what the rig's memory (a lag, backlash in the drive) held before
    /// is not known, unless it hung at rest. Elsewhere a hand held it, or it moved.
    fn unknown_before(&self) -> usize {
        const LEAD: f64 = 0.2;
        const SHARE: f64 = 0.05;
        let from_hanging = (self.y[0][1] - PI).rem_euclid(TAU);
        if self.u_before == 0.0 && from_hanging.min(TAU - from_hanging) < HANGING {
            return 0;
        }
        let lead = (LEAD / self.h).round();
        lead.min(SHARE * self.y.len() as f64) as usize
    }

    /// Whether the pendulum never comes near upright, so that the plant is stable and can be predicted as a whole.
    pub(crate) fn hangs(&self) -> bool {
        hangs(self.y.iter().map(|y| y[1]))
    }

    /// The state at a sample as it is measured.
    pub(crate) fn seen(&self, k: usize) -> State<f64> {
        let (y, v) = (self.y[k], self.speed[k]);
        State::new(y[0], y[1], v[0], v[1])
    }

    /// The command that acts from sample `k` to the next, `late` samples late.
    #[inline]
    pub(crate) fn command(&self, k: usize, late: usize) -> f64 {
        k.checked_sub(late).map_or(self.u_before, |i| self.u[i])
    }

    /// The commands before sample `k`, `late` samples late, oldest first, at most `count`.
    pub(crate) fn past(&self, k: usize, late: usize, count: usize) -> Vec<f64> {
        let mut past: Vec<f64> = (k.saturating_sub(count)..k)
            .map(|i| self.command(i, late))
            .collect();
        if past.len() < count {
            past.insert(0, self.u_before);
        }
        past
    }
}

/// Value and slope of a least-squares cubic at sample `k`, over up to `half` samples either side; `times` is empty
/// where they are `h` apart.
fn local_fit(y: &[[f64; 2]], times: &[f64], k: usize, half: usize, h: f64) -> ([f64; 2], [f64; 2]) {
    let (low, high) = (k.saturating_sub(half), (k + half).min(y.len() - 1));
    let scale = half as f64;
    let mut normal = SMatrix::<f64, 4, 4>::zeros();
    let mut right = SMatrix::<f64, 4, 2>::zeros();
    for (i, y) in y.iter().enumerate().take(high + 1).skip(low) {
        let s = match times.get(i) {
            Some(t) => (t - times[k]) / (scale * h),
            None => (i as f64 - k as f64) / scale,
        };
        let row = SVector::<f64, 4>::new(1.0, s, s * s, s * s * s);
        normal += row * row.transpose();
        right += row * SMatrix::<f64, 1, 2>::new(y[0], y[1]);
    }
    match normal.cholesky() {
        Some(c) => {
            let fit = c.solve(&right);
            let slope = 1.0 / (scale * h);
            (
                [fit[(0, 0)], fit[(0, 1)]],
                [fit[(1, 0)] * slope, fit[(1, 1)] * slope],
            )
        }
        None => (y[k], [0.0; 2]),
    }
}

/// Angles and speeds.
fn smoothed(y: &[[f64; 2]], times: &[f64], h: f64, half: usize) -> (Vec<[f64; 2]>, Vec<[f64; 2]>) {
    (0..y.len())
        .map(|k| local_fit(y, times, k, half, h))
        .unzip()
}

/// How fast either angle moves, in counts a sample: on average over [`COUNTS`], or over `most` samples on either side.
fn steady(counts: &[[f64; 2]], most: usize) -> impl Iterator<Item = [f64; 2]> {
    let mut ways = vec![[0.0; 2]];
    for (k, moved) in counts.iter().enumerate() {
        let so_far: [f64; 2] = ways[k];
        ways.push([0, 1].map(|c| so_far[c] + moved[c]));
    }
    (0..counts.len()).map(move |k| {
        [0, 1].map(|c| {
            let over = |half: usize| {
                let (low, high) = (k.saturating_sub(half), (k + half + 1).min(ways.len() - 1));
                (ways[high][c] - ways[low][c], (high - low) as f64)
            };
            let half = (0..most).find(|half| over(*half).0 >= COUNTS);
            let (way, samples) = over(half.unwrap_or(most));
            way / samples
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where the windows of a recording begin whose pendulum rests at an angle before it moves.
    fn first_window(alpha: f64) -> usize {
        let rig = Rig::builtin("qube-servo-2").expect("built in");
        let moves = |t: f64| (20.0 * (t - 0.05).max(0.0)).sin();
        let samples = (0..2000).map(|k| {
            let t = 0.002 * f64::from(k);
            [t, 0.0, 0.3 * moves(t), alpha + 0.1 * moves(t)]
        });
        let (recording, _) = Recording::from_samples("rests", samples).expect("a recording");
        Data::new(&[recording], &rig).windows(0.25, |_| true)[0].start
    }

    /// A hand that holds a pendulum leaves a drive's twist unknown, below the horizontal as above it.
    #[test]
    fn windows_begin_where_what_was_before_is_known() {
        assert_eq!(first_window(PI + 0.05), 0);
        assert_eq!(first_window(-PI), 0);
        // A fifth of a second, at most a twentieth of the recording.
        assert_eq!(first_window(1.7), 100);
        assert_eq!(first_window(0.3), 100);
    }
}
