//! What to measure next: the test signal that would tell two explanations apart, and how clearly.
//!
//! Both explanations are made into rigs, each rig is driven by every signal of a family, as hard as its limits allow
//! and more gently, and read by the encoders that the data had. To each such recording both explanations are fitted as
//! `diagnose` would fit them. What the wrong one leaves more than the right one, whichever of the two is right, is the
//! evidence to expect.

use std::sync::Arc;

use furuta_model::Rig;
use furuta_model::signals::Excitation;
use rayon::prelude::*;

use super::hypothesis::{Hypothesis, Sheet, TIMING};
use super::repair;
use super::result::PlannedExperiment;
use super::search::Rival;
use super::{Fit, SEARCH};
use crate::experiment::{FAMILY, HALVED, LEVELS, SECONDS, Shape, record, rms, two_digits};
use crate::pendulum::Pendulum;
use crate::shooting::{Data, Effort, Problem, is_late};
use crate::stop::Stop;

/// This many rivals of each named effect are looked at, the nearest first.
const RIVALS: usize = 2;
/// Rows kept for each pair.
const ROWS: usize = 5;

/// An explanation, and the rig that it makes of the data sheet's.
struct Explanation<'a> {
    fit: &'a Fit,
    rig: Rig,
}

impl<'a> Explanation<'a> {
    fn new(fit: &'a Fit, sheet: &Rig) -> Self {
        Self {
            fit,
            rig: repair::repaired(sheet, fit),
        }
    }

    /// What the encoders would read of this rig.
    fn record(&self, shape: Shape, excitation: &Excitation, like: &Data) -> Option<Data> {
        record(&self.rig, shape, excitation, like.runs[0].h, like.noise)
    }
}

/// By how much the Bayesian information criterion of `wrong` would be above that of `right`, both fitted to what the
/// latter's rig would show.
fn evidence(right: &Explanation<'_>, wrong: &Explanation<'_>, rig: &Rig, data: &Data) -> f64 {
    // As in a diagnosis: the new recording's encoders have zeros of their own.
    let own_zeros = right.fit.model.sheet.own_zeros;
    let sheet = Arc::new(Sheet::new(rig, data, own_zeros, Pendulum::Swings));
    let problem = Problem::new(data, data.windows(SEARCH, |_| true));
    let fitted = |e: &Explanation<'_>| {
        let h = Hypothesis {
            effects: e.fit.model.effects.clone(),
            sheet: Arc::clone(&sheet),
        };
        let mut z = e.fit.z[..h.shared()].to_vec();
        z.resize(h.len(), 0.0);
        // The simulated samples come on time.
        z[TIMING] = 0.0;
        let start = problem.solve_states(&h, &z, None);
        problem.fit(&h, z, &start.states, Effort::FULL)
    };
    let (right, wrong) = (fitted(right), fitted(wrong));
    let parameters = wrong.model.free() as f64 - right.model.free() as f64;
    (wrong.cost - right.cost) / problem.per_sample(&right) + parameters * problem.samples().ln()
}

/// The strongest that both rigs bear, in two digits (V), and what they then show.
fn strongest(shape: Shape, pair: [&Explanation<'_>; 2], like: &Data) -> Option<f64> {
    let limit = pair[0].rig.params.motor.command_limit;
    let mut amplitude = shape.most() * if limit.is_finite() { limit } else { 10.0 };
    for _ in 0..HALVED {
        amplitude = two_digits(amplitude);
        let excitation = shape.excitation(amplitude, limit).ok()?;
        if pair
            .iter()
            .all(|e| e.record(shape, &excitation, like).is_some())
        {
            return Some(amplitude);
        }
        amplitude *= 0.5;
    }
    None
}

/// A row: one signal at one level for one pair.
fn row(
    (words, shape): (&str, Shape),
    level: f64,
    pair: [&Explanation<'_>; 2],
    separates: [&str; 2],
    sheet: &Rig,
    like: &Data,
) -> Option<PlannedExperiment> {
    let limit = pair[0].rig.params.motor.command_limit;
    let amplitude = two_digits(level * strongest(shape, pair, like)?);
    let excitation = shape.excitation(amplitude, limit).ok()?;
    let [a, b] = pair;
    let [of_a, of_b] = [
        a.record(shape, &excitation, like)?,
        b.record(shape, &excitation, like)?,
    ];
    let if_true = [evidence(a, b, sheet, &of_a), evidence(b, a, sheet, &of_b)];
    let volts = of_a.runs[0].u.iter().fold(0.0, |m: f64, u| m.max(u.abs()));
    Some(PlannedExperiment {
        excitation: words.into(),
        arguments: shape.arguments(amplitude),
        seconds: SECONDS,
        volts,
        volts_rms: rms(&of_a.runs[0].u),
        separates: separates.map(str::to_owned),
        expected_evidence: if_true[0].min(if_true[1]),
        if_true,
    })
}

/// The best experiments for each pair that the data leave open, the clearest first.
pub(super) fn plan(
    sheet: &Rig,
    data: &Data,
    named: &Fit,
    rivals: &[Rival],
    stop: Stop<'_>,
) -> Vec<PlannedExperiment> {
    let truth = Explanation::new(named, sheet);
    let mut plan = Vec::new();
    for rival in rivals {
        // A delay of the command and one of the encoders are the same in every recording.
        let near = rival
            .near
            .iter()
            .filter(|t| !(is_late(t.spec) && is_late(rival.spec)))
            .filter(|t| !t.fit.model.is_transient() && !named.model.is_transient());
        for trial in near.take(RIVALS) {
            let other = Explanation::new(&trial.fit, sheet);
            let jobs: Vec<_> = FAMILY
                .iter()
                .flat_map(|one| LEVELS.map(|level| (*one, level)))
                // Letting go is letting go.
                .filter(|((_, shape), level)| !matches!(shape, Shape::Decay) || *level == 1.0)
                .collect();
            let mut rows: Vec<PlannedExperiment> = jobs
                .into_par_iter()
                .filter(|_| !stop.wanted())
                .filter_map(|(one, level)| {
                    let separates = [rival.spec.id, trial.spec.id];
                    row(one, level, [&truth, &other], separates, sheet, data)
                })
                // One that would leave the wrong one the better of the two tells nothing.
                .filter(|row| row.if_true.iter().all(|e| e.is_finite() && *e > 0.0))
                .collect();
            rows.sort_by(|a, b| b.expected_evidence.total_cmp(&a.expected_evidence));
            rows.truncate(ROWS);
            plan.extend(rows);
        }
    }
    plan
}
