//! Judging by data that were not fitted: each part is predicted by a model fitted to the others.

use super::criteria::CRITERIA;
use super::predict::{self, Predictor, rms};
use super::result::{Best, HeldOut};
use super::{Fit, LONG, REPORT, SEARCH};
use crate::shooting::{Data, Effort, Model, Problem, Run, Window};
use crate::stop::Stop;

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

    /// What predicts a part that `fitted` has not seen. A recording that was kept apart comes with data of its own: its
    /// encoders' zeros are fitted to it from where the full fit has them, like the initial states of its windows.
    fn apart(
        &self,
        data: &Data,
        part: usize,
        (full, fitted): (&Fit, &Fit),
    ) -> (Option<Data>, Predictor) {
        if !self.comes_apart(fitted) {
            return (None, fitted.into());
        }
        let mut apart = data.clone();
        apart.runs.retain(|run| run.recording == part);
        apart.recordings = 1;
        for run in &mut apart.runs {
            run.recording = 0;
        }
        let (hypothesis, mut z) = fitted.model.for_others(&fitted.z, &apart);
        let (all, own) = (full.model.layout(), hypothesis.layout());
        for i in 0..own.zeros {
            z[own.zero(0, i)] = full.z[all.zero(part, i)];
        }
        let windows = apart.windows(REPORT, |_| true);
        let z = Problem::new(&apart, windows).with_zeros(&hypothesis, &z);
        (Some(apart), Predictor { hypothesis, z })
    }

    fn comes_apart(&self, fitted: &Fit) -> bool {
        matches!(self, Self::Recordings(_)) && fitted.model.sheet.own_zeros
    }

    /// The index of a part's recording in the data that [`Self::apart`] gives.
    fn index_apart(&self, part: usize, fitted: &Fit) -> usize {
        if self.comes_apart(fitted) { 0 } else { part }
    }

    /// Whether a window of the data that [`Self::apart`] gives belongs to the part.
    fn part_apart(&self, data: &Data, w: &Window, part: usize) -> bool {
        // Data of its own holds nothing else.
        let alone = data.recordings == 1;
        (alone && matches!(self, Self::Recordings(_))) || self.part(data, w) == part
    }
}

/// What a model leaves on data that its parameters were not fitted to.
#[derive(Clone, Debug, Default)]
pub(super) struct Unseen {
    /// Errors over windows of [`REPORT`], rad.
    pub(super) errors: Vec<[f64; 2]>,
    /// The sum of their squares in units of the noise: what is told of each name.
    pub(super) squared: f64,
    /// Geometric means over windows of the mean squared error in units of the noise: over windows of [`SEARCH`] and of
    /// [`REPORT`] and, where the pendulum hangs, of [`LONG`] and over whole runs; not a number where there are none.
    /// One window that ends beside its best initial state, as one in sixty does where something sticks, does not decide
    /// them.
    pub(super) horizons: [f64; 4],
}

/// The largest of three models that predicts no worse than the smaller ones: a window of a quarter of a second does not
/// see what half a second shows upright, so that no horizon stands for another. One of the two fitted models whose
/// numbers cannot be (`possible`) is none of them.
pub(super) fn best(
    given: &Unseen,
    [refitted, repaired]: [&Unseen; 2],
    possible: [bool; 2],
) -> Best {
    let refit = possible[0] && refitted.is_no_worse_than(given);
    if possible[1]
        && repaired.is_no_worse_than(given)
        && (!refit || repaired.is_no_worse_than(refitted))
    {
        Best::Repaired
    } else if refit {
        Best::Refitted
    } else {
        Best::Given
    }
}

/// The least mean square that counts, in units of the noise: a window at rest leaves less than any model can take
/// credit for.
const LEAST: f64 = 1e-2;

impl Unseen {
    /// Whether this model predicts better over short windows, over most of them and all in all, and no worse over long
    /// ones.
    pub(super) fn is_better_than(&self, other: &Self) -> bool {
        self.removes_of(other) > 0.0 && self.is_mostly_better_than(other)
    }

    /// Share of the squared error of a smaller model that this one removes.
    pub(super) fn removes_of(&self, smaller: &Self) -> f64 {
        1.0 - self.squared / smaller.squared
    }

    /// Whether this model predicts most short windows better, and long ones no worse.
    pub(super) fn is_mostly_better_than(&self, other: &Self) -> bool {
        let [search, report, long, whole] =
            std::array::from_fn(|i| self.horizons[i] / other.horizons[i]);
        let no_worse = |ratio: f64| ratio.is_nan() || ratio < CRITERIA.no_worse;
        search < 1.0 && report < 1.0 && no_worse(long) && no_worse(whole)
    }

    /// Whether this model predicts no worse at any horizon, as far as errors on data kept apart are known.
    pub(super) fn is_no_worse_than(&self, other: &Self) -> bool {
        let most = [
            CRITERIA.alike,
            CRITERIA.alike,
            CRITERIA.no_worse,
            CRITERIA.no_worse,
        ];
        (0..most.len()).all(|i| {
            let ratio = self.horizons[i] / other.horizons[i];
            ratio.is_nan() || ratio < most[i]
        })
    }

    /// Mean of the logarithms of the horizons that there are: the lower, the better the model predicts all in all.
    pub(super) fn level(&self) -> f64 {
        let known: Vec<f64> = self
            .horizons
            .iter()
            .filter(|e| e.is_finite())
            .map(|e| e.ln())
            .collect();
        known.iter().sum::<f64>() / known.len().max(1) as f64
    }
}

/// Errors over windows of [`REPORT`] on one part, and for each horizon the sum of the windows' logarithms with their
/// number.
type OfPart = (Vec<[f64; 2]>, [(f64, usize); 4]);

/// What is asked of a model.
#[derive(Clone, Copy, Debug)]
pub(super) struct Asked {
    /// Whether its parameters are fitted to the other parts, or taken as they are.
    pub(super) refit: bool,
    /// Whether the horizons are wanted, beside the errors.
    pub(super) horizons: bool,
}

impl Asked {
    /// Errors and horizons of a model whose parameters are fitted to the other parts.
    pub(super) const ALL: Self = Self {
        refit: true,
        horizons: true,
    };
    /// Its errors alone.
    pub(super) const ERRORS: Self = Self {
        refit: true,
        horizons: false,
    };
    /// Errors and horizons of a model taken as it is.
    pub(super) const AS_IT_IS: Self = Self {
        refit: false,
        horizons: true,
    };

    /// Whether what is asked here tells what `other` asks.
    pub(super) const fn includes(self, other: Self) -> bool {
        self.refit == other.refit && (self.horizons || !other.horizons)
    }
}

/// What a model leaves on every part. Where `stop` is wanted, fits end where they are: what is left then says nothing.
pub(super) fn unseen(
    data: &Data,
    folds: &Folds,
    fit: &Fit,
    asked: Asked,
    stop: Stop<'_>,
) -> Unseen {
    let parts: Vec<OfPart> = (0..folds.count())
        .into_par_iter()
        .map(|part| of_part(data, folds, part, (fit, asked), stop))
        .collect();
    let horizons = std::array::from_fn(|h| {
        let (sum, count) = parts
            .iter()
            .fold((0.0, 0), |(s, n), (_, sums)| (s + sums[h].0, n + sums[h].1));
        (sum / count as f64).exp()
    });
    let errors: Vec<_> = parts.into_iter().flat_map(|(errors, _)| errors).collect();
    Unseen {
        squared: squared(data, &errors),
        errors,
        horizons,
    }
}

fn of_part(
    data: &Data,
    folds: &Folds,
    part: usize,
    (fit, asked): (&Fit, Asked),
    stop: Stop<'_>,
) -> OfPart {
    // The states of the full fit belong to the same windows.
    let (kept, states): (Vec<_>, Vec<_>) = data
        .windows(SEARCH, |_| true)
        .into_iter()
        .zip(&fit.states)
        .filter(|(w, _)| folds.part(data, w) != part)
        .unzip();
    if kept.is_empty() {
        return (Vec::new(), [(0.0, 0); 4]);
    }
    let fitted = if asked.refit {
        let problem = Problem::new(data, kept).until(stop);
        problem.fit(&fit.model, fit.z.clone(), &states, Effort::APART)
    } else {
        fit.clone()
    };
    let (apart, predictor) = folds.apart(data, part, (fit, &fitted));
    let data = apart.as_ref().unwrap_or(data);
    // Logarithms of mean squares, at least the noise's, and how many.
    let of = |windows: &[Vec<[f64; 2]>]| -> (f64, usize) {
        let mean = |errors: &Vec<[f64; 2]>| {
            let squared = errors
                .iter()
                .flat_map(|e| [e[0] / data.noise[0], e[1] / data.noise[1]])
                .map(|e| e * e);
            squared.sum::<f64>() / (2 * errors.len()).max(1) as f64
        };
        let logarithms = windows.iter().map(|w| mean(w).max(LEAST).ln());
        (logarithms.sum(), windows.len())
    };
    let windowed = |seconds: f64, wanted: &dyn Fn(&Run) -> bool| {
        let mut windows = data.windows(seconds, wanted);
        windows.retain(|w| folds.part_apart(data, w, part));
        let problem = Problem::new(data, windows);
        let predictions = predict::windowed(&problem, &predictor);
        predict::errors(&problem, &predictions)
    };
    let errors = windowed(REPORT, &|_| true);
    if !asked.horizons {
        return (errors.concat(), [(0.0, 0); 4]);
    }
    let whole: Vec<Vec<[f64; 2]>> = match folds {
        Folds::Blocks => Vec::new(),
        Folds::Recordings(_) => (data.runs.iter().enumerate())
            .filter(|(_, run)| run.recording == folds.index_apart(part, &fitted) && run.hangs())
            .map(|(i, run)| {
                let series = predict::whole(data, i, &predictor);
                let error = |k: usize, c: usize| predict::finite(series[c][k] - run.y[k][c]);
                (0..run.y.len())
                    .map(|k| [error(k, 0), error(k, 1)])
                    .collect()
            })
            .collect(),
    };
    let sums = [
        of(&windowed(SEARCH, &|_| true)),
        of(&errors),
        of(&windowed(LONG, &Run::hangs)),
        of(&whole),
    ];
    (errors.concat(), sums)
}

/// Root mean square of the errors of both models; `None` where nothing could be kept apart.
pub(super) fn compared(data: &Data, before: &[[f64; 2]], after: &[[f64; 2]]) -> Option<HeldOut> {
    (!before.is_empty()).then(|| HeldOut {
        recalibrated: rms(before.iter()).into(),
        augmented: rms(after.iter()).into(),
        noise_floor: data.noise.into(),
    })
}

/// The sum of squared errors in units of the noise.
fn squared(data: &Data, errors: &[[f64; 2]]) -> f64 {
    let of = |e: &[f64; 2]| (e[0] / data.noise[0]).powi(2) + (e[1] / data.noise[1]).powi(2);
    errors.iter().map(of).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(horizons: [f64; 4]) -> Unseen {
        Unseen {
            errors: Vec::new(),
            squared: 0.0,
            horizons,
        }
    }

    /// A name that makes most windows a little better and some much worse is none: what is told of it would deny it.
    #[test]
    fn better_over_most_windows_is_not_enough() {
        let none = f64::NAN;
        let left = |level, squared| Unseen {
            squared,
            ..at([level, level, none, none])
        };
        let without = left(4.0, 400.0);
        assert!(left(3.0, 300.0).is_better_than(&without));
        assert!(left(3.0, 410.0).is_mostly_better_than(&without));
        assert!(!left(3.0, 410.0).is_better_than(&without));
        assert!(!left(4.1, 300.0).is_better_than(&without));
    }

    /// A model whose numbers cannot be is never written, however well it predicts.
    #[test]
    fn the_best_model_is_one_that_can_be() {
        let none = f64::NAN;
        let [given, refitted, repaired] = [9.0, 3.0, 1.5].map(|left| at([left, left, none, none]));
        let written = |possible| best(&given, [&refitted, &repaired], possible);
        assert_eq!(written([true, false]), Best::Refitted);
        assert_eq!(written([false, true]), Best::Repaired);
        assert_eq!(written([false, false]), Best::Given);
        // Better than the sheet as given, and worse than a refit that cannot be.
        let between = best(&given, [&repaired, &refitted], [false, true]);
        assert_eq!(between, Best::Repaired);
    }

    /// A refit that wins over a quarter of a second and loses over half a second, as upright in closed loop, is not
    /// written; nor is a repair that loses over whole runs alone.
    #[test]
    fn the_best_model_is_no_worse_at_any_horizon() {
        let none = f64::NAN;
        let given = at([9.0, 64.0, none, none]);
        let refitted = at([1.0, 130.0, none, none]);
        assert_eq!(best(&given, [&refitted; 2], [true; 2]), Best::Given);
        let given = at([9.0, 64.0, 400.0, 900.0]);
        let refitted = at([3.0, 20.0, 100.0, 300.0]);
        let repaired = at([1.5, 5.0, 50.0, 280.0]);
        assert_eq!(
            best(&given, [&refitted, &repaired], [true; 2]),
            Best::Repaired
        );
        let worse = at([1.5, 5.0, 50.0, 600.0]);
        assert_eq!(best(&given, [&refitted, &worse], [true; 2]), Best::Refitted);
        assert_eq!(best(&given, [&given; 2], [true; 2]), Best::Repaired);
    }
}
