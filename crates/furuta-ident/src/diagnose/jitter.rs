//! Samples that are not taken when their time stamps say, though the stamps are even.
//!
//! A sample that is read `e` too late shows angles that are wrong by `e` times their speeds. No fit can follow random
//! moments, yet both angles are wrong by the same `e`: with what is left of both behind a high-pass, `r = P (e v)`,
//!
//! ```text
//! E[r_theta . r_alpha] = spread² sum_k P_kk v_theta,k v_alpha,k
//! ```
//!
//! whatever their own noise is, for rounding and noise of two encoders have nothing in common. The high-pass is what a
//! quintic leaves of 13 samples; motion hardly reaches there.

use nalgebra::{SMatrix, SVector};

use super::result::Jitter;
use crate::shooting::{Data, Run};

/// Samples of a stretch, and coefficients of its polynomial.
const SPAN: usize = 13;
const ORDER: usize = 6;
/// The middle of a stretch.
const HALF: f64 = 6.0;
/// The least number of stretches in which both encoders count: the sum's deviation comes from their scatter.
const LEAST: usize = 20;
/// A spread is there above this many of its standard deviations. In 94 recordings of
/// MuJoCo plants without jitter they scattered as normal numbers do (mean -0.04, deviation 1.07:
/// `py/tests/jitter_study.py`), of which one in 30,000 is so large.
const SHOWS: f64 = 4.0;
/// And where it moves readings by this many times the encoders' noise: less is rounding, of recordings without
/// encoders.
const MOVES: f64 = 0.1;
/// What a quintic leaves of 13 samples has this many degrees of freedom.
const FREEDOM: f64 = 7.0;

/// The spread of the moments at which samples are taken, where it shows.
pub(super) fn jitter(data: &Data, resolution: [f64; 2]) -> Option<Jitter> {
    let at = |k: usize| (k as f64 - HALF) / HALF;
    let basis = SMatrix::<f64, SPAN, ORDER>::from_fn(|k, j| at(k).powi(j as i32));
    let slope = SMatrix::<f64, SPAN, ORDER>::from_fn(|k, j| {
        if j == 0 {
            0.0
        } else {
            j as f64 * at(k).powi(j as i32 - 1)
        }
    });
    let fit = (basis.transpose() * basis).try_inverse()? * basis.transpose();
    let left = SMatrix::<f64, SPAN, SPAN>::identity() - basis * fit;
    let speed = slope * fit;
    // Of each stretch what both angles leave in common, and what a spread of one second would.
    let mut pairs: Vec<[f64; 2]> = Vec::new();
    let stamped_evenly = |run: &&Run| run.state.is_whole() && !run.is_uneven();
    for run in data.runs.iter().filter(stamped_evenly) {
        for stretch in run.y.chunks_exact(SPAN) {
            let angles: [SVector<f64, SPAN>; 2] =
                std::array::from_fn(|c| SVector::from_fn(|k, _| stretch[k][c]));
            let counts = |c: usize| {
                let steps = stretch.windows(2).map(|s| (s[1][c] - s[0][c]).abs());
                steps.sum::<f64>() / resolution[c]
            };
            if counts(0).min(counts(1)) < SPAN as f64 {
                continue;
            }
            let [theta, alpha] = angles.map(|y| left * y);
            let [w, v] = angles.map(|y| speed * y / (HALF * run.h));
            let unit = (0..SPAN).map(|k| left[(k, k)] * w[k] * v[k]).sum();
            pairs.push([theta.dot(&alpha), unit]);
        }
    }
    if pairs.len() < LEAST {
        return None;
    }
    let sum = |f: &dyn Fn(f64, f64) -> f64| pairs.iter().map(|p| f(p[0], p[1])).sum::<f64>();
    let information = sum(&|_, unit| unit * unit);
    let square = sum(&|common, unit| common * unit) / information;
    // Against none; about what was found.
    let none = sum(&|common, unit| (common * unit).powi(2)).sqrt() / information;
    let about = sum(&|common, unit| ((common - square * unit) * unit).powi(2)).sqrt() / information;
    let deviations = square / none;
    // By how much it moves a reading, beside the encoders' noise: both as the geometric mean of the two angles.
    let speeds = sum(&|_, unit| unit.abs()) / (pairs.len() as f64 * FREEDOM);
    let moves = (square.max(0.0) * speeds).sqrt() / (data.noise[0] * data.noise[1]).sqrt();
    (deviations > SHOWS && moves > MOVES).then(|| Jitter {
        spread: square.sqrt(),
        std: 0.5 * about / square.sqrt(),
        deviations,
    })
}
