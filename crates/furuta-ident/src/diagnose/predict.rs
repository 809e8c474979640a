//! Predictions made for people: errors over windows and whole runs, curves for the report.

use super::Fit;
use super::hypothesis::Hypothesis;
use super::result::RunCurves;
use crate::shooting::{Data, Problem, Run, Window, Windows};

/// The error put in place of a prediction that diverged, rad.
const DIVERGED: f64 = 1e3;
/// The state at the start of a whole run is estimated from its first quarter of a second.
const FIRST: f64 = 0.25;

/// A model that predicts: a hypothesis and its numbers.
#[derive(Clone)]
pub(super) struct Predictor {
    pub(super) hypothesis: Hypothesis,
    pub(super) z: Vec<f64>,
}

impl From<&Fit> for Predictor {
    fn from(f: &Fit) -> Self {
        Self {
            hypothesis: f.model.clone(),
            z: f.z.clone(),
        }
    }
}

/// What each of the three models says, computed side by side.
pub(super) fn of_each<T: Send>(
    models: &[Predictor; 3],
    f: impl Fn(&Predictor) -> T + Sync,
) -> [T; 3] {
    let [a, b, c] = models;
    let (x, (y, z)) = rayon::join(|| f(a), || rayon::join(|| f(b), || f(c)));
    [x, y, z]
}

/// Predictions over the problem's windows, each from its own best initial state.
pub(super) fn windowed(problem: &Problem<'_>, model: &Predictor) -> Vec<Vec<[f64; 2]>> {
    let solved = problem.solve_states(&model.hypothesis, &model.z, None);
    let windows = Windows::new(&model.hypothesis, &model.z);
    problem
        .windows
        .iter()
        .zip(&solved.states)
        .map(|(w, x)| windows.predictions(problem.data, w, x))
        .collect()
}

/// Errors of such predictions, window by window.
pub(super) fn errors(problem: &Problem<'_>, predictions: &[Vec<[f64; 2]>]) -> Vec<Vec<[f64; 2]>> {
    problem
        .windows
        .iter()
        .zip(predictions)
        .map(|(w, predicted)| {
            let y = &problem.data.runs[w.run].y[w.start + 1..];
            predicted
                .iter()
                .zip(y)
                .map(|(p, y)| std::array::from_fn(|c| finite(p[c] - y[c])))
                .collect()
        })
        .collect()
}

/// The windows of one run joined to `[theta, alpha]` series as long as the run; samples outside all windows as
/// measured.
pub(super) fn joined(
    problem: &Problem<'_>,
    run: usize,
    predictions: &[Vec<[f64; 2]>],
) -> [Vec<f64>; 2] {
    let y = &problem.data.runs[run].y;
    let mut series: [Vec<f64>; 2] = std::array::from_fn(|c| y.iter().map(|y| y[c]).collect());
    for (w, values) in problem
        .windows
        .iter()
        .zip(predictions)
        .filter(|(w, _)| w.run == run)
    {
        for (k, value) in values.iter().enumerate() {
            for c in 0..2 {
                series[c][w.start + 1 + k] = value[c];
            }
        }
    }
    series
}

/// An error that is a number, whatever a diverging prediction was.
pub(super) fn finite(error: f64) -> f64 {
    if error.is_finite() {
        error.clamp(-DIVERGED, DIVERGED)
    } else {
        DIVERGED
    }
}

/// Root mean square over all samples.
pub(super) fn rms<'a>(errors: impl Iterator<Item = &'a [f64; 2]>) -> [f64; 2] {
    let (mut sum, mut count) = ([0.0; 2], 0_usize);
    for e in errors {
        sum = [sum[0] + e[0] * e[0], sum[1] + e[1] * e[1]];
        count += 1;
    }
    sum.map(|s| (s / count.max(1) as f64).sqrt())
}

/// The measured series and the predictions of the three models, for the report.
pub(super) fn curves(
    run: &Run,
    unit: &str,
    [as_given, refitted, repaired]: [[Vec<f64>; 2]; 3],
) -> RunCurves {
    RunCurves {
        name: run.name.clone(),
        t: (0..run.y.len()).map(|k| run.time(k)).collect(),
        u: run.u.clone(),
        unit: unit.to_owned(),
        measured: std::array::from_fn(|c| run.y.iter().map(|y| y[c]).collect()),
        nominal: as_given,
        recalibrated: refitted,
        augmented: repaired,
        ..RunCurves::default()
    }
}

/// A run predicted as a whole from its first quarter of a second, `[theta, alpha]` for every sample.
pub(super) fn whole(data: &Data, run: usize, model: &Predictor) -> [Vec<f64>; 2] {
    let r = &data.runs[run];
    let last = r.y.len() - 1;
    let first = Window {
        run,
        start: 0,
        len: ((FIRST / r.h).round() as usize).clamp(1, last),
    };
    let windows = Windows::new(&model.hypothesis, &model.z);
    let (x0, _) = windows.search(data, &first, None);
    let all = Window {
        run,
        start: 0,
        len: last,
    };
    let predicted = windows.predictions(data, &all, &x0);
    std::array::from_fn(|c| {
        std::iter::once(r.y[0][c])
            .chain(predicted.iter().map(|p| p[c]))
            .collect()
    })
}

/// Mean squared error of the runs that hang, predicted as a whole, in units of the noise.
pub(super) fn open_loop(data: &Data, fit: &Fit) -> f64 {
    let (mut sum, mut count) = (0.0, 0_usize);
    for (i, run) in data.runs.iter().enumerate().filter(|(_, r)| r.hangs()) {
        let predicted = whole(data, i, &fit.into());
        for (k, y) in run.y.iter().enumerate() {
            for c in 0..2 {
                sum += (finite(predicted[c][k] - y[c]) / data.noise[c]).powi(2);
            }
        }
        count += run.y.len();
    }
    sum / count.max(1) as f64
}
