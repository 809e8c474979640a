//! The acceleration that an arm must have had, from the angles that its encoder read.
//!
//! The model is that of a command: held from sample to sample. From one sample to the next it changes by a random
//! amount, in proportion to the root of the time between them (a Wiener process), and each reading is off by noise:
//!
//! ```text
//! theta(k+1) = theta(k) + h theta'(k) + h²/2 a(k)      theta'(k+1) = theta'(k) + h a(k)
//! a(k+1) = a(k) + sqrt(q h) w(k)                       reading(k) = theta(k) + noise
//! ```
//!
//! A Kalman filter and a fixed-interval smoother (Durbin and Koopman, *Time Series Analysis by State Space Methods*,
//! 2012, 4.4) give the most likely course. How fast the acceleration changes against the noise is what makes the
//! readings most likely.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};

/// Variance of speed and acceleration before any reading, in units of the noise's variance and of the mean sample
/// period: ten thousand deviations of the noise from one sample to the next, more than any arm moves.
const UNKNOWN: f64 = 1e8;
/// Readings that determine the state at first; the likelihood is that of the others.
const FIRST: usize = 3;
/// Powers of ten between which the ratio `q / noise variance` lies, in units of the mean sample period. Its sixth root
/// is the rate up to which the smoother follows: from one that averages over a hundred samples to one whose
/// acceleration is another at each.
const POWERS: [f64; 2] = [-12.0, 3.0];
/// Powers of ten between two ratios that are tried first.
const COARSE: f64 = 1.0;
/// How closely the most likely power is found: a tenth of a decade changes the rate that is followed by 4 %.
const FINE: f64 = 0.1;
/// Inverse of the golden ratio.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// What a filter keeps of one reading.
struct Step {
    /// The state as it was predicted, and its covariance in units of the noise's variance.
    state: Vector3<f64>,
    covariance: Matrix3<f64>,
    /// How the state goes on to the next reading.
    onward: Matrix3<f64>,
    gain: Vector3<f64>,
    /// The reading less its prediction, and the variance of that.
    innovation: f64,
    variance: f64,
}

/// Readings of one stretch without a gap, at times in units of the mean sample period.
struct Stretch<'a> {
    theta: &'a [f64],
    times: Vec<f64>,
}

/// The acceleration of the arm from each sample until the next, rad/s²; zero outside the `segments`.
///
/// `period`: the mean sample period, s.
pub(crate) fn acceleration(
    t: &[f64],
    theta: &[f64],
    segments: &[Range<usize>],
    period: f64,
) -> Vec<f64> {
    let stretches: Vec<Stretch<'_>> = (segments.iter())
        .map(|segment| Stretch {
            theta: &theta[segment.clone()],
            times: t[segment.clone()].iter().map(|t| t / period).collect(),
        })
        .collect();
    let ratio = 10f64.powf(most_likely(&stretches));
    let mut acceleration = vec![0.0; theta.len()];
    for (segment, stretch) in segments.iter().zip(&stretches) {
        for (to, a) in acceleration[segment.clone()]
            .iter_mut()
            .zip(stretch.smoothed(ratio))
        {
            *to = a / (period * period);
        }
    }
    acceleration
}

/// The power of ten of the most likely ratio: the best of a grid, then golden sections about it.
fn most_likely(stretches: &[Stretch<'_>]) -> f64 {
    let unlikely = |power: f64| unlikelihood(stretches, 10f64.powf(power));
    let [low, high] = POWERS;
    let grid = (0..)
        .map(|i| low + COARSE * f64::from(i))
        .take_while(|p| *p <= high);
    let best = grid
        .map(|p| (unlikely(p), p))
        .min_by(|a, b| a.0.total_cmp(&b.0));
    let middle = best.map_or(low, |(_, p)| p);
    let [mut from, mut to] = [middle - COARSE, middle + COARSE];
    let inner = |from: f64, to: f64| [to - GOLDEN * (to - from), from + GOLDEN * (to - from)];
    let [a, b] = inner(from, to);
    let mut tried = [(a, unlikely(a)), (b, unlikely(b))];
    while to - from > FINE {
        if tried[0].1 < tried[1].1 {
            to = tried[1].0;
            let a = inner(from, to)[0];
            tried = [(a, unlikely(a)), tried[0]];
        } else {
            from = tried[0].0;
            let b = inner(from, to)[1];
            tried = [tried[1], (b, unlikely(b))];
        }
    }
    0.5 * (from + to)
}

/// Minus twice the logarithm of the readings' likelihood but for a constant, the noise's variance being the most
/// likely.
fn unlikelihood(stretches: &[Stretch<'_>], ratio: f64) -> f64 {
    let (mut squares, mut logarithms, mut count) = (0.0, 0.0, 0.0);
    for stretch in stretches {
        stretch.filter(ratio, |k, step| {
            if k >= FIRST {
                squares += step.innovation * step.innovation / step.variance;
                logarithms += step.variance.ln();
                count += 1.0;
            }
        });
    }
    // An arm that stands still has no noise: all is equally likely.
    if squares > 0.0 {
        count * (squares / count).ln() + logarithms
    } else {
        0.0
    }
}

impl Stretch<'_> {
    /// The Kalman filter, one reading after the other.
    fn filter(&self, ratio: f64, mut each: impl FnMut(usize, Step)) {
        let Some(first) = self.theta.first() else {
            return;
        };
        let mut state = Vector3::new(*first, 0.0, 0.0);
        let mut covariance = Matrix3::from_diagonal(&Vector3::new(1.0, UNKNOWN, UNKNOWN));
        for (k, reading) in self.theta.iter().enumerate() {
            let h = self
                .times
                .get(k + 1)
                .map_or(1.0, |next| next - self.times[k]);
            #[rustfmt::skip]
            let onward = Matrix3::new(
                1.0, h, 0.5 * h * h,
                0.0, 1.0, h,
                0.0, 0.0, 1.0,
            );
            let innovation = reading - state[0];
            let variance = covariance[(0, 0)] + 1.0;
            let gain = onward * covariance.column(0) / variance;
            // Joseph's form: what is left is positive whatever is rounded.
            let mut rest = onward;
            rest.column_mut(0).axpy(-1.0, &gain, 1.0);
            let mut next = rest * covariance * rest.transpose() + gain * gain.transpose();
            next[(2, 2)] += ratio * h;
            let step = Step {
                state,
                covariance,
                onward,
                gain,
                innovation,
                variance,
            };
            state = onward * state + gain * innovation;
            covariance = next;
            each(k, step);
        }
    }

    /// The most likely acceleration from each reading until the next.
    fn smoothed(&self, ratio: f64) -> Vec<f64> {
        let mut steps = Vec::with_capacity(self.theta.len());
        self.filter(ratio, |_, step| steps.push(step));
        let mut later: Vector3<f64> = Vector3::zeros();
        let mut smoothed: Vec<f64> = (steps.iter().rev())
            .map(|step| {
                let mut here = step.onward.transpose() * later;
                here[0] += step.innovation / step.variance - step.gain.dot(&later);
                later = here;
                (step.state + step.covariance * later)[2]
            })
            .collect();
        smoothed.reverse();
        smoothed
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    /// Readings of `counts` a turn of an arm that swings as a sum of two sines, at even or jittering moments.
    fn read(counts: f64, jitter: f64) -> (Vec<f64>, Vec<f64>) {
        let count = TAU / counts;
        (0..2000)
            .map(|k| {
                let moved = (f64::from(k) * 12.9898).sin() * jitter;
                let t = 0.002 * (f64::from(k) + moved);
                (t, (course(t)[0] / count).round() * count)
            })
            .unzip()
    }

    /// Angle and acceleration.
    fn course(t: f64) -> [f64; 2] {
        let sine = |a: f64, w: f64| [a * (w * t).sin(), -a * w * w * (w * t).sin()];
        let (slow, fast) = (sine(0.8, 4.0), sine(0.05, 30.0));
        [slow[0] + fast[0], slow[1] + fast[1]]
    }

    /// The acceleration is the true one within a tenth, where a count between two samples is ten times the largest.
    #[test]
    fn the_acceleration_is_that_of_the_arm() {
        for jitter in [0.0, 0.3] {
            let (t, theta) = read(2048.0, jitter);
            let found = acceleration(&t, &theta, std::slice::from_ref(&(0..2000)), 0.002);
            let inner = 100..1900;
            let error: f64 = (inner.clone())
                .map(|k| (found[k] - course(0.5 * (t[k] + t[k + 1]))[1]).powi(2))
                .sum();
            let size: f64 = inner.map(|k| course(t[k])[1].powi(2)).sum();
            assert!((error / size).sqrt() < 0.1, "{}", (error / size).sqrt());
        }
    }

    /// An arm that stands has none, and what lies between the segments is not looked at.
    #[test]
    fn an_arm_that_stands_has_no_acceleration() {
        let t: Vec<f64> = (0..100).map(|k| 0.01 * f64::from(k)).collect();
        let mut theta = vec![0.3; 100];
        theta[50] = 7.0;
        let found = acceleration(&t, &theta, &[0..50, 51..100], 0.01);
        assert!(found.iter().all(|a| a.abs() < 1e-9), "{found:?}");
    }
}
