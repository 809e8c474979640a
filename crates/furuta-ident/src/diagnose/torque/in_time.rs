//! The missing torque over time: the most likely course under a prior that it is smooth over some hundredths of a
//! second.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::super::result::TorqueInTime;
use super::{FOLLOW, Response, Responses, TorqueNormal};
use crate::shooting::Problem;

/// Blocks with the same torque.
const TOGETHER: usize = 3;
/// Torques so far apart are alike to 1/e, s.
const MEMORY: f64 = 0.06;
/// Sizes tried for the prior, as multiples of the smallest that could be seen, and how often for each axis in turn.
const SIZES: usize = 12;
const STEP: f64 = 3.0;
const ROUNDS: usize = 3;

/// One window's quadratic, and where its torques stand.
struct Slices {
    normal: TorqueNormal,
    t: Vec<f64>,
    alike: DMatrix<f64>,
}

impl Slices {
    fn of(response: &Response) -> Self {
        let n = response.blocks.len().div_ceil(TOGETHER);
        let t: Vec<f64> = response
            .blocks
            .chunks(TOGETHER)
            .map(|c| c.iter().map(|b| b.t).sum::<f64>() / c.len() as f64)
            .collect();
        Self {
            normal: TorqueNormal::of(response, n, |k, _| [(k / TOGETHER, 1.0), (0, 0.0)])
                .holding(&std::array::from_fn::<_, FOLLOW, _>(|i| 2 * n + i)),
            alike: DMatrix::from_fn(n, n, |i, j| (-(t[i] - t[j]).abs() / MEMORY).exp()),
            t,
        }
    }

    /// The prior's covariance with these standard deviations of the two axes' torques.
    fn prior(&self, size: [f64; 2]) -> DMatrix<f64> {
        let n = self.t.len();
        DMatrix::from_fn(2 * n, 2 * n, |i, j| {
            if i / n == j / n {
                size[i / n].powi(2) * self.alike[(i % n, j % n)]
            } else {
                0.0
            }
        })
    }

    /// Twice the logarithm of the evidence, but for a constant, and the posterior: mean and covariance. With the
    /// prior's root `L` and `B = I + L'GL`, the covariance is `L B⁻¹ L'`.
    fn posterior(&self, size: [f64; 2]) -> Option<(f64, DVector<f64>, DMatrix<f64>)> {
        let mut prior = self.prior(size);
        for i in 0..prior.nrows() {
            prior[(i, i)] *= 1.0 + 1e-9;
        }
        let root = prior.cholesky()?.unpack();
        let mut inner = root.tr_mul(&(&self.normal.matrix * &root));
        for i in 0..inner.nrows() {
            inner[(i, i)] += 1.0;
        }
        let inner = inner.cholesky()?;
        let half = inner.l_dirty().solve_lower_triangular(&root.transpose())?;
        let covariance = half.tr_mul(&half);
        let mean = &covariance * &self.normal.gradient;
        let log_det: f64 = inner
            .l_dirty()
            .diagonal()
            .iter()
            .map(|d| 2.0 * d.ln())
            .sum();
        let evidence = mean.dot(&self.normal.gradient) - log_det;
        evidence.is_finite().then_some((evidence, mean, covariance))
    }
}

/// The most likely torques of one window.
struct Course {
    window: usize,
    t: Vec<f64>,
    torque: [Vec<f64>; 2],
    std: [Vec<f64>; 2],
}

/// The torques missing in every run, before and after the effects. Where a window says nothing about the model with
/// them, that is `NaN`.
pub(in super::super) fn in_time(
    problem: &Problem<'_>,
    before: &Responses,
    after: &Responses,
) -> Vec<TorqueInTime> {
    let (before, after) = rayon::join(|| courses(before), || courses(after));
    let mut runs: Vec<TorqueInTime> = problem
        .data
        .runs
        .iter()
        .map(|r| TorqueInTime {
            run: r.name.clone(),
            ..TorqueInTime::default()
        })
        .collect();
    for course in before {
        let out = &mut runs[problem.windows[course.window].run];
        // Both are in the order of the windows.
        let later = after
            .binary_search_by_key(&course.window, |c| c.window)
            .ok()
            .map(|i| &after[i])
            .filter(|c| c.t.len() == course.t.len());
        let unknown = vec![f64::NAN; course.t.len()];
        for c in 0..2 {
            out.recalibrated[c].extend(&course.torque[c]);
            out.recalibrated_std[c].extend(&course.std[c]);
            out.augmented[c].extend(later.map_or(&unknown, |l| &l.torque[c]));
            out.augmented_std[c].extend(later.map_or(&unknown, |l| &l.std[c]));
        }
        out.t.extend(course.t);
    }
    runs
}

fn courses(responses: &Responses) -> Vec<Course> {
    let slices: Vec<Slices> = responses.by_window.par_iter().map(Slices::of).collect();
    let size = likely(&slices);
    (responses.by_window.par_iter().zip(slices))
        .filter_map(|(response, slices)| {
            let (_, mean, covariance) = slices.posterior(size)?;
            let n = slices.t.len();
            let of = |value: &dyn Fn(usize) -> f64| {
                [0, n].map(|first| (first..first + n).map(value).collect())
            };
            Some(Course {
                window: response.window,
                torque: of(&|i| mean[i]),
                std: of(&|i| covariance[(i, i)].sqrt()),
                t: slices.t,
            })
        })
        .collect()
}

/// The sizes of the two axes' torques under which the residuals are the most likely.
fn likely(slices: &[Slices]) -> [f64; 2] {
    // A torque of this size everywhere would just be seen in one window.
    let least: [f64; 2] = std::array::from_fn(|c| {
        let clearest = slices
            .iter()
            .map(|s| {
                let n = s.t.len();
                s.normal.matrix.view((c * n, c * n), (n, n)).trace()
            })
            .fold(0.0, f64::max);
        if clearest > 0.0 {
            clearest.sqrt().recip()
        } else {
            1.0
        }
    });
    let mut size = least;
    let mut best = f64::NEG_INFINITY;
    for round in 0..ROUNDS {
        let c = round % 2;
        for k in 0..SIZES {
            let mut trial = size;
            trial[c] = 0.1 * least[c] * STEP.powi(k as i32);
            let parts: Vec<f64> = slices
                .par_iter()
                .map(|s| s.posterior(trial).map_or(0.0, |p| p.0))
                .collect();
            let evidence: f64 = parts.iter().sum();
            if evidence > best {
                (best, size) = (evidence, trial);
            }
        }
    }
    size
}
