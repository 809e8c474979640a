//! The same experiment on hundreds of wrong parameters.

use super::{Contender, Experiment, ExperimentError, Factors, Outcome};
use crate::closed_loop::Sample;
use furuta_model::signals::random::uniform;
use rayon::prelude::*;

/// One draw: what was off, and what came of it.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Draw {
    /// Factors on `l1`, `l2`, `m2`.
    pub factors: Factors,
    /// What came of it.
    pub outcome: Outcome,
}

/// All draws of one contender.
#[derive(Clone, Debug, PartialEq)]
pub struct Draws {
    /// Each draw, in the order of its number.
    pub draws: Vec<Draw>,
    /// Envelope of the tracking error `beta - beta_ref` of those that stayed up: time (s), lowest, highest (rad).
    pub envelope: Vec<(f64, f64, f64)>,
}

/// What the draws come to.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Summary {
    /// Share that stayed up.
    pub up: f64,
    /// Median of the bound of the tracking error, those that fell counted as infinite, rad.
    pub median: f64,
    /// Worst of those that stayed up, rad.
    pub worst: f64,
    /// Median of the RMS error, rad.
    pub rms: f64,
    /// Median of the command's total variation a second, V/s.
    pub chatter: f64,
}

/// The factors of a draw: each of the three uniform within `±spread`.
#[must_use]
pub fn factors(seed: u64, draw: u64, spread: f64) -> Factors {
    [0, 1, 2].map(|k| 1.0 + spread * (2.0 * uniform(seed, 3 * draw + k) - 1.0))
}

/// Samples of the envelope.
const ENVELOPE: usize = 500;

/// `count` draws of the experiment within `±spread`, on all cores. The same seed gives the same draws to every
/// contender; `progress` hears of each that is done.
///
/// # Errors
/// A setting that is not possible.
pub fn draws(
    experiment: &Experiment,
    contender: Contender,
    count: usize,
    spread: f64,
    seed: u64,
    progress: &(impl Fn() + Sync),
) -> Result<Draws, ExperimentError> {
    let tracker = experiment.controller(contender)?;
    let runs: Vec<(Draw, Vec<f64>)> = (0..count as u64)
        .into_par_iter()
        .map(|n| {
            let factors = factors(seed, n, spread);
            let samples = experiment.run(&tracker, factors)?;
            let outcome = experiment.outcome(&samples);
            progress();
            Ok((Draw { factors, outcome }, thinned(&samples)))
        })
        .collect::<Result<_, ExperimentError>>()?;
    let step = experiment.duration / ENVELOPE as f64;
    let standing = || runs.iter().filter(|r| r.0.outcome.up);
    let envelope = (0..=ENVELOPE)
        .filter_map(|k| {
            let errors = standing().filter_map(|r| r.1.get(k).copied());
            let (low, high) = errors.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), e| {
                (l.min(e), h.max(e))
            });
            (low <= high).then_some((k as f64 * step, low, high))
        })
        .collect();
    Ok(Draws {
        draws: runs.into_iter().map(|r| r.0).collect(),
        envelope,
    })
}

/// The tracking error in the paper's sign at the envelope's times.
fn thinned(samples: &[Sample]) -> Vec<f64> {
    let last = samples.len().saturating_sub(1);
    (0..=ENVELOPE)
        .filter_map(|k| samples.get(k * last / ENVELOPE))
        .map(|s| s.reference.alpha - s.x.alpha)
        .collect()
}

impl Draws {
    /// What they come to.
    #[must_use]
    pub fn summary(&self) -> Summary {
        let median = |value: fn(&Outcome) -> f64| {
            let mut values: Vec<f64> = self.draws.iter().map(|d| value(&d.outcome)).collect();
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
        };
        let standing = || self.draws.iter().filter(|d| d.outcome.up);
        Summary {
            up: standing().count() as f64 / self.draws.len().max(1) as f64,
            median: median(|o| o.bound),
            worst: standing().fold(0.0, |m, d| f64::max(m, d.outcome.bound)),
            rms: median(|o| o.rms),
            chatter: median(|o| o.chatter),
        }
    }
}
