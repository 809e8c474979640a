//! The missing torque over time: the most likely course under a prior that it is smooth over some hundredths of a
//! second.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
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

/// One window's quadratic `G`, `g` in the torques of its slices, the arm's before the pendulum's.
struct Slices {
    t: Vec<f64>,
    /// Root `R` of what slices have in common by their distance in time.
    root: DMatrix<f64>,
    /// `R' G R` and `R' g`, for each axis.
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
    /// Sum of the diagonal of `G` over each axis.
    clearness: [f64; 2],
}

impl Slices {
    fn of(response: &Response) -> Option<Self> {
        let n = response.blocks.len().div_ceil(TOGETHER);
        let t: Vec<f64> = response
            .blocks
            .chunks(TOGETHER)
            .map(|c| c.iter().map(|b| b.t).sum::<f64>() / c.len() as f64)
            .collect();
        let normal = TorqueNormal::of(response, n, |k, _| [(k / TOGETHER, 1.0), (0, 0.0)])
            .holding(&std::array::from_fn::<_, FOLLOW, _>(|i| 2 * n + i));
        let alike = DMatrix::from_fn(n, n, |i, j| {
            let alike = (-(t[i] - t[j]).abs() / MEMORY).exp();
            if i == j { alike + 1e-9 } else { alike }
        });
        let root = alike.cholesky()?.unpack();
        let mut matrix = DMatrix::zeros(2 * n, 2 * n);
        let mut gradient = DVector::zeros(2 * n);
        for a in [0, n] {
            let part = root.tr_mul(&normal.gradient.rows(a, n));
            gradient.rows_mut(a, n).copy_from(&part);
            for b in [0, n] {
                let part = root.tr_mul(&(normal.matrix.view((a, b), (n, n)) * &root));
                matrix.view_mut((a, b), (n, n)).copy_from(&part);
            }
        }
        let clearness = [0, n].map(|a| normal.matrix.view((a, a), (n, n)).trace());
        Some(Self {
            t,
            root,
            matrix,
            gradient,
            clearness,
        })
    }

    /// With these standard deviations `S` of the two axes' torques: `B = I + S R'G R S`, and `S R' g`.
    fn scaled(&self, size: [f64; 2]) -> Option<(Cholesky<f64, Dyn>, DVector<f64>)> {
        let n = self.t.len();
        let size = |i: usize| size[i / n];
        let inner = DMatrix::from_fn(2 * n, 2 * n, |i, j| {
            let one = if i == j { 1.0 } else { 0.0 };
            one + size(i) * self.matrix[(i, j)] * size(j)
        });
        let gradient = DVector::from_fn(2 * n, |i, _| size(i) * self.gradient[i]);
        Some((inner.cholesky()?, gradient))
    }

    /// Twice the logarithm of the evidence, but for a constant.
    fn evidence(&self, size: [f64; 2]) -> Option<f64> {
        let (inner, gradient) = self.scaled(size)?;
        let factor = inner.l_dirty();
        let log_det: f64 = factor.diagonal().iter().map(|d| 2.0 * d.ln()).sum();
        let evidence = factor.solve_lower_triangular(&gradient)?.norm_squared() - log_det;
        evidence.is_finite().then_some(evidence)
    }

    /// The posterior's mean and standard deviations: its covariance is `R S B⁻¹ S R'`.
    fn posterior(&self, size: [f64; 2]) -> Option<(DVector<f64>, DVector<f64>)> {
        let n = self.t.len();
        let (inner, gradient) = self.scaled(size)?;
        let mut root = DMatrix::zeros(2 * n, 2 * n);
        for (c, a) in [0, n].into_iter().enumerate() {
            let part = &self.root * size[c];
            root.view_mut((a, a), (n, n)).copy_from(&part);
        }
        let mean = &root * inner.solve(&gradient);
        let half = inner.l_dirty().solve_lower_triangular(&root.transpose())?;
        let std = DVector::from_fn(2 * n, |i, _| half.column(i).norm());
        let finite = mean.iter().chain(std.iter()).all(|v| v.is_finite());
        finite.then_some((mean, std))
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
/// them, that is `NaN`, and on an axis that no torque moves.
pub(in super::super) fn in_time(
    problem: &Problem<'_>,
    before: &Responses,
    after: &Responses,
) -> Vec<TorqueInTime> {
    let moved = before.moved;
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
        for (c, moved) in moved.into_iter().enumerate() {
            let (now, later) = match moved {
                true => (Some(&course), later),
                false => (None, None),
            };
            out.recalibrated[c].extend(now.map_or(&unknown, |n| &n.torque[c]));
            out.recalibrated_std[c].extend(now.map_or(&unknown, |n| &n.std[c]));
            out.augmented[c].extend(later.map_or(&unknown, |l| &l.torque[c]));
            out.augmented_std[c].extend(later.map_or(&unknown, |l| &l.std[c]));
        }
        out.t.extend(course.t);
    }
    runs
}

fn courses(responses: &Responses) -> Vec<Course> {
    let slices: Vec<(usize, Slices)> = (responses.by_window.par_iter())
        .filter_map(|response| Some((response.window, Slices::of(response)?)))
        .collect();
    let size = likely(&slices, responses.moved);
    (slices.into_par_iter())
        .filter_map(|(window, slices)| {
            let (mean, std) = slices.posterior(size)?;
            let n = slices.t.len();
            let of = |value: &dyn Fn(usize) -> f64| {
                [0, n].map(|first| (first..first + n).map(value).collect())
            };
            Some(Course {
                window,
                torque: of(&|i| mean[i]),
                std: of(&|i| std[i]),
                t: slices.t,
            })
        })
        .collect()
}

/// The sizes of the two axes' torques under which the residuals are the most likely.
fn likely(slices: &[(usize, Slices)], moved: [bool; 2]) -> [f64; 2] {
    // A torque of this size everywhere would just be seen in one window.
    let least: [f64; 2] = std::array::from_fn(|c| {
        if !moved[c] {
            return 0.0;
        }
        let clearest = slices
            .iter()
            .map(|(_, s)| s.clearness[c])
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
                .map(|(_, s)| s.evidence(trial).unwrap_or(0.0))
                .collect();
            let evidence: f64 = parts.iter().sum();
            if evidence > best {
                (best, size) = (evidence, trial);
            }
        }
    }
    size
}
