//! Judging by data that were not fitted: each part is predicted by a model fitted to the others.

use super::predict::{self, Predictor, rms};
use super::result::HeldOut;
use super::{Fit, REPORT, SEARCH};
use crate::shooting::{Data, Effort, Model, Problem, Window, with_zeros_found};

use rayon::prelude::*;

/// Length of the blocks that are kept apart in turn where there are fewer than three recordings, s.
const BLOCK: f64 = 1.0;

/// How the data are divided into parts.
pub(super) enum Folds {
    /// A part is a recording.
    Recordings(usize),
    /// Even and odd blocks.
    Blocks,
}

/// Whole recordings are kept apart where there are at least three.
pub(super) fn folds(data: &Data) -> Folds {
    let recordings = data.runs.iter().map(|r| r.recording + 1).max().unwrap_or(0);
    if recordings >= 3 {
        Folds::Recordings(recordings)
    } else {
        Folds::Blocks
    }
}

impl Folds {
    pub(super) fn count(&self) -> usize {
        match self {
            Self::Recordings(n) => *n,
            Self::Blocks => 2,
        }
    }

    /// The part to which a window belongs.
    pub(super) fn part(&self, data: &Data, w: &Window) -> usize {
        let run = &data.runs[w.run];
        match self {
            Self::Recordings(_) => run.recording,
            Self::Blocks => ((w.start as f64 + 0.5) * run.h / BLOCK) as usize % 2,
        }
    }
}

impl Folds {
    /// What predicts a part that a fit has not seen. A recording that was kept apart comes with data of its own, since its encoders' zeros are found in its
    /// first seconds.
    fn apart(&self, data: &Data, part: usize, fitted: &Fit) -> (Option<Data>, Predictor) {
        if matches!(self, Self::Blocks) || !fitted.model.nominal.own_zeros {
            return (None, fitted.into());
        }
        let mut apart = data.clone();
        apart.recordings = 2;
        for run in &mut apart.runs {
            // The others are not looked at.
            run.recording = usize::from(run.recording == part);
        }
        let hypothesis = fitted.model.for_others(&apart);
        let mut z = fitted.z[..hypothesis.shared()].to_vec();
        z.resize(hypothesis.layout().len(), 0.0);
        let z = with_zeros_found(&apart, |run| run.recording == 1, &hypothesis, &z);
        (Some(apart), Predictor { hypothesis, z })
    }
}

/// Prediction errors on every part by a model fitted to the others.
pub(super) fn errors(data: &Data, folds: &Folds, fit: &Fit) -> Vec<[f64; 2]> {
    (0..folds.count())
        .into_par_iter()
        .map(|part| {
            let mut seen = data.windows(SEARCH, |_| true);
            let mut unseen = data.windows(REPORT, |_| true);
            // The states of the full fit belong to the same windows.
            let (kept, states): (Vec<_>, Vec<_>) = seen
                .drain(..)
                .zip(&fit.states)
                .filter(|(w, _)| folds.part(data, w) != part)
                .unzip();
            unseen.retain(|w| folds.part(data, w) == part);
            if kept.is_empty() || unseen.is_empty() {
                return Vec::new();
            }
            let fitted = Problem::new(data, kept).fit(
                &fit.model,
                fit.z.clone(),
                &states,
                Effort::FULL,
            );
            let (apart, predictor) = folds.apart(data, part, &fitted);
            let problem = Problem::new(apart.as_ref().unwrap_or(data), unseen);
            let predictions = predict::windowed(&problem, &predictor);
            predict::errors(&problem, &predictions).concat()
        })
        .flatten()
        .collect()
}

/// Root mean square of the errors of both models; `None` where nothing could be kept apart.
pub(super) fn compared(data: &Data, before: &[[f64; 2]], after: &[[f64; 2]]) -> Option<HeldOut> {
    (!before.is_empty()).then(|| HeldOut {
        recalibrated: rms(before.iter()).into(),
        augmented: rms(after.iter()).into(),
        noise_floor: data.noise.into(),
    })
}

/// Share of the smaller model's squared error (in units of the noise) that the larger one removes.
pub(super) fn removed(data: &Data, smaller: &[[f64; 2]], larger: &[[f64; 2]]) -> f64 {
    let sum = |errors: &[[f64; 2]]| -> f64 {
        errors
            .iter()
            .map(|e| (e[0] / data.noise[0]).powi(2) + (e[1] / data.noise[1]).powi(2))
            .sum()
    };
    1.0 - sum(larger) / sum(smaller)
}
