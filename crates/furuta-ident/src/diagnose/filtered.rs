//! Angles that are not as the encoders read them: filtered, averaged or interpolated before they were written.
//!
//! A filter makes both angles late, as a delay, a lag or a flexible drive does, and no recording tells which it was.
//! But what an encoder reads steps by counts, and rounding to counts is white: of its eighth difference, which motion
//! hardly reaches, the variance is `C(16, 8)` times that of rounding. What was filtered has other steps and is
//! smoother: of a mean of `n` samples, five or more, it is `2 C(14, 7)/n²` times that of rounding. What was simulated
//! without encoders is smoother by orders of magnitude, unless the file rounds it.

use furuta_model::Spec;
use furuta_model::effects::Acts;

use crate::shooting::{Data, Run};

/// How often the samples are differenced, and the sum of the squares of the weights: `C(16, 8)`.
const ORDER: usize = 8;
const WEIGHTS: f64 = 12_870.0;
/// Median of what is normal, in standard deviations.
const MEDIAN: f64 = 0.6745;
/// A step is no whole number of counts where it is farther from one than this.
const OFF: f64 = 0.05;
/// At least this share of the steps of filtered angles is no whole number of counts.
const MOST: f64 = 0.5;
/// What is filtered has this share of the variance of rounding: a mean of two samples has an eighteenth, one of 70
/// samples a ten thousandth.
const SHARE: (f64, f64) = (1e-4, 0.25);
/// And this many times what rounding in the file leaves.
const ROUNDED: f64 = 4.0;
/// Fewer steps say nothing.
const LEAST: usize = 100;

/// Whether an effect makes the rig late, as a filter of its readings does.
pub(super) fn makes_late(spec: &Spec) -> bool {
    (spec.acts).touches(
        Acts::DELAY
            .and(Acts::LAG)
            .and(Acts::SENSOR_DELAY)
            .and(Acts::DRIVE),
    )
}

/// What is said of the recordings whose angles were filtered; `None` where all are as encoders of this resolution (rad)
/// read.
pub(super) fn filtered(data: &Data, resolution: [f64; 2]) -> Option<String> {
    let shows = |run: &Run, c: usize| {
        let looked_at = run.weight.iter().any(|w| w[c] > 0.0);
        let y: Vec<f64> = run.y.iter().map(|y| y[c]).collect();
        !run.is_uneven() && looked_at && is_filtered(&y, resolution[c])
    };
    let mut files: Vec<&str> = Vec::new();
    let mut angles = [false; 2];
    for run in &data.runs {
        let here = [0, 1].map(|c| shows(run, c));
        if here != [false; 2] && !files.contains(&run.name.as_str()) {
            files.push(&run.name);
        }
        angles = [0, 1].map(|c| angles[c] || here[c]);
    }
    let (columns, step) = match angles {
        [false, false] => return None,
        [true, false] => ("theta", "does"),
        [false, true] => ("alpha", "does"),
        [true, true] => ("theta and alpha", "do"),
    };
    Some(format!(
        "{}: {columns} {step} not step by the counts of the rig file's encoders: filtered, averaged or interpolated, \
         or read by finer sensors. A filter makes angles late, as a delay, a lag or a flexible drive does, so none of \
         these is named: record the counts as they are, or write the sensors' own counts into the rig file",
        files.join(", ")
    ))
}

/// Whether angles are smoother than counts, and not as smooth as motion.
fn is_filtered(y: &[f64], count: f64) -> bool {
    let steps: Vec<f64> = (y.windows(2).map(|w| ((w[1] - w[0]) / count).abs()))
        .filter(|step| *step > 1e-6)
        .collect();
    let off = steps.iter().filter(|s| (**s - s.round()).abs() > OFF);
    if steps.len() < LEAST || (off.count() as f64) < MOST * steps.len() as f64 {
        return false;
    }
    let mut differences = y.to_vec();
    for _ in 0..ORDER {
        differences = differences.windows(2).map(|w| w[1] - w[0]).collect();
    }
    let mut sizes: Vec<f64> = (differences.iter().map(|d| d.abs()))
        .filter(|d| *d > 0.0)
        .collect();
    if sizes.is_empty() {
        return false;
    }
    sizes.sort_by(f64::total_cmp);
    let rounding = count * (WEIGHTS / 12.0).sqrt();
    let share = (sizes[sizes.len() / 2] / (MEDIAN * rounding)).powi(2);
    let by_file = ROUNDED * (last_place(y) / count).powi(2);
    share > SHARE.0.max(by_file) && share < SHARE.1
}

/// The last decimal place in which all angles are written, rad; none: 0.
fn last_place(y: &[f64]) -> f64 {
    let in_whole = |place: f64| {
        let rest = |y: &f64| (y / place - (y / place).round()).abs();
        y.iter().all(|y| rest(y) < 1e-4)
    };
    let places = (0..9).map(|k| 0.1_f64.powi(k));
    places.into_iter().find(|p| in_whole(*p)).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const COUNT: f64 = std::f64::consts::TAU / 2048.0;

    fn swing(k: usize) -> f64 {
        let t = 0.002 * k as f64;
        0.7 * (9.0 * t).sin() + 0.3 * (31.0 * t + 0.4).sin()
    }

    fn counts() -> Vec<f64> {
        let read = |y: f64| (y / COUNT).round() * COUNT;
        (0..3000).map(|k| read(swing(k))).collect()
    }

    fn mean(y: &[f64], n: usize) -> Vec<f64> {
        let of = |w: &[f64]| w.iter().sum::<f64>() / n as f64;
        y.windows(n).map(of).collect()
    }

    #[test]
    fn what_was_averaged_is_told_from_counts_and_from_what_was_never_rounded() {
        let read = counts();
        assert!(!is_filtered(&read, COUNT));
        for n in [2, 3, 5, 9, 20] {
            assert!(is_filtered(&mean(&read, n), COUNT), "{n}");
        }
        let exact: Vec<f64> = (0..3000).map(swing).collect();
        assert!(!is_filtered(&exact, COUNT));
        for places in [1e3, 1e4, 1e6] {
            let written: Vec<f64> = exact
                .iter()
                .map(|y| (y * places).round() / places)
                .collect();
            assert!(!is_filtered(&written, COUNT), "{places}");
        }
        // Half the samples, each held for two.
        let held: Vec<f64> = (0..3000).map(|k| read[k / 2 * 2]).collect();
        assert!(!is_filtered(&held, COUNT));
    }

    #[test]
    fn a_low_pass_shows() {
        let mut y = 0.0;
        let low: Vec<f64> = (counts().iter())
            .map(|read| {
                y += 0.3 * (read - y);
                y
            })
            .collect();
        assert!(is_filtered(&low, COUNT));
    }
}
