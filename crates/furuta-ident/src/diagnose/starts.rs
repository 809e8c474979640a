//! Where the fit of one more effect may start, and what a score test says of each start.

use furuta_model::Spec;
use furuta_model::effects::{Acts, Kind};
use rayon::prelude::*;

use super::Fit;
use super::hypothesis::FIRST_EFFECT;
use super::savers::Savers;
use super::screen::{self, Screen, TOUCH};
use crate::shooting::{Model, Problem};

/// Below this (in units of the noise) what is left is small, and effects of about the strength that the score test
/// says.
const SMALL: f64 = 1.5;
/// No start is stronger than this, in units of the typical strength.
const STRONGEST: f64 = 3.0;

/// A start, and its score statistic.
pub(super) struct FitStart {
    /// By how much the score test says that the cost will fall.
    pub(super) statistic: f64,
    pub(super) spec: &'static Spec,
    /// How often per turn a friction changes: the statistic does not tell one order from another, a fit does.
    order: Option<f64>,
    pub(super) z: Vec<f64>,
}

impl Problem<'_> {
    /// Where `spec` may start in a fit that adds it to `from`, everything else as it is there.
    pub(super) fn shapes(&self, from: &Fit, spec: &'static Spec, screen: &Screen) -> Vec<Vec<f64>> {
        let typical: Vec<f64> = spec
            .parameters
            .iter()
            .map(|p| p.typical(&from.model.sheet.params))
            .collect();
        // In units of the vector, with where the zeros of theta go.
        let places: Vec<(Vec<f64>, Option<Vec<f64>>)> = if screen::looks(spec).is_some() {
            let in_units = |values: &[f64]| {
                let values = values.iter().zip(spec.parameters).zip(&typical);
                values.map(|((v, p), scale)| (v - p.off) / scale).collect()
            };
            screen
                .places(spec, &typical)
                .into_iter()
                .map(|place| (in_units(&place.values), Some(place.zeros)))
                .collect()
        } else {
            // Every combination of the parameters' starts.
            let mut all: Vec<Vec<f64>> = vec![Vec::new()];
            for p in spec.parameters {
                all = all
                    .iter()
                    .flat_map(|values| {
                        p.starts.iter().map(|s| {
                            let mut values = values.clone();
                            values.push(*s);
                            values
                        })
                    })
                    .collect();
            }
            all.into_iter().map(|values| (values, None)).collect()
        };
        let h = from.model.with(spec);
        let layout = h.layout();
        places
            .iter()
            .map(|(values, zeros)| {
                let mut z = from.model.extended(&from.z, values);
                if let (Some(zeros), true) = (zeros, layout.zeros > 0) {
                    for (r, zero) in zeros.iter().enumerate().skip(1) {
                        z[layout.zero(r, 0)] += zero;
                    }
                }
                z
            })
            .collect()
    }

    /// A score test for each start of each candidate, with one simulation; the largest statistic first.
    pub(super) fn scored(
        &self,
        from: &Fit,
        specs: &[&'static Spec],
        screen: &Screen,
        report: &(dyn Fn(&str) + Sync),
    ) -> Vec<FitStart> {
        let jobs: Vec<(&'static Spec, Vec<f64>)> = specs
            .iter()
            .copied()
            .flat_map(|s| {
                self.shapes(from, s, screen)
                    .into_iter()
                    .map(move |z| (s, z))
            })
            .collect();
        // Base parameters refitted without the effect may be far off: where the gap is large, the data sheet is a
        // better start.
        let far = !self.explains(from) && from.model.effects.is_empty();
        let mut starts: Vec<FitStart> = jobs
            .into_par_iter()
            .flat_map_iter(|(spec, mut z)| {
                let scored = if self.stop.wanted() {
                    Some(f64::NEG_INFINITY)
                } else if spec.acts.includes(Acts::CONTACT) {
                    None
                } else {
                    Some(self.scored_at(from, spec, &mut z, screen))
                };
                report(spec.id);
                let order = order(spec).map(|i| z[from.model.shared() + i]);
                let sheet = far.then(|| with_sheet(&z));
                sheet.into_iter().chain([z]).map(move |z| FitStart {
                    statistic: scored.unwrap_or_else(|| self.fall(from, spec, &z)),
                    spec,
                    order,
                    z,
                })
            })
            .collect();
        starts.sort_by(|a, b| b.statistic.total_cmp(&a.statistic));
        starts
    }

    /// The score statistic of one start. Where what is missing is small, so is the effect, if it is the one: `z` takes
    /// the strength that the score says, and the other numbers go where they fit best beside it.
    fn scored_at(&self, from: &Fit, spec: &'static Spec, z: &mut [f64], screen: &Screen) -> f64 {
        let h = from.model.with(spec);
        let first = from.model.shared();
        let strengths = first..first + spec.strengths;
        let mut here = z.to_vec();
        // A start at no strength at all says nothing about what the effect changes.
        if here[strengths.clone()].iter().all(|s| *s == 0.0) {
            here[strengths.clone()].fill(TOUCH);
        }
        let one_way = spec.parameters[0].min >= spec.parameters[0].off;
        let score = screen.score(self, from, &h, &here);
        let Some(score) = score else {
            return f64::INFINITY;
        };
        let statistic = score.statistic(one_way);
        if self.chi(from) >= SMALL || statistic <= 0.0 {
            return statistic;
        }
        // What the grid screen places has its strength, and so has a limit: of half of what it cuts off there is none.
        let mut share = 1.0;
        if screen::looks(spec).is_none() && !spec.acts.includes(Acts::LIMIT) {
            let backwards = spec.acts.includes(Acts::BACKWARDS);
            let size = |s: &f64| if backwards { 1.0 / s } else { s.abs() };
            let most = STRONGEST / here[strengths.clone()].iter().map(size).fold(0.0, f64::max);
            share = (score.product / score.square).clamp(-most, most);
            for i in strengths {
                z[i] = if backwards {
                    here[i] / share
                } else {
                    here[i] * share
                };
            }
        }
        screen.follow(&h, z, &score, share);
        statistic
    }

    /// By how much the cost falls at a start itself, the windows' initial states solved for. A stiff stop is far from
    /// being in proportion to its strength: a score test says nothing of it.
    fn fall(&self, from: &Fit, spec: &'static Spec, z: &[f64]) -> f64 {
        let there = self.solve_states(&from.model.with(spec), z, Some(&from.states));
        (from.cost - there.cost).max(0.0)
    }

    /// Keeps the starts to be fitted: of those whose score statistic could convince (and could gain `wanted`), the few
    /// with a statistic near the best. A kick gains much in one window, and says nothing of what gains a little in all
    /// of them: it does not count as the best.
    pub(super) fn keep_scored(
        &self,
        from: &Fit,
        wanted: f64,
        savers: &Savers,
        starts: &mut Vec<FitStart>,
    ) {
        let per_sample = self.per_sample(from);
        let lasting = starts.iter().find(|s| !s.spec.acts_once());
        let best = lasting.map_or(0.0, |s| s.statistic);
        let mut kept: Vec<(&'static str, Option<f64>)> = Vec::new();
        let mut effects = 0;
        starts.retain(|start| {
            let spec = start.spec;
            let least_share = if screen::is_scanned(spec) {
                savers.least_share_scanned
            } else {
                savers.least_share
            };
            if start.statistic < savers.least_share * best
                || start.statistic < least_share * self.least(&from.model, spec) * per_sample
                || start.statistic < savers.least_share * wanted
            {
                return false;
            }
            let this = (spec.id, start.order);
            let is_kept = if kept.iter().any(|(id, _)| *id == spec.id) {
                kept.iter().filter(|k| **k == this).count() < savers.starts
            } else {
                effects += 1;
                effects <= savers.followed
            };
            kept.extend(is_kept.then_some(this));
            is_kept
        });
    }
}

/// A vector with the base parameters of the data sheet.
fn with_sheet(z: &[f64]) -> Vec<f64> {
    let mut z = z.to_vec();
    z[..FIRST_EFFECT].fill(0.0);
    z
}

/// Where a friction has its order among its parameters.
fn order(spec: &Spec) -> Option<usize> {
    let orders = spec.parameters.iter().position(|p| p.kind == Kind::Whole);
    orders.filter(|_| spec.acts.includes(Acts::DRY_FRICTION))
}

/// Whether a start is the first of its effect, asked of one after the other.
pub(super) fn news() -> impl FnMut(&FitStart) -> bool {
    let mut seen: Vec<&'static str> = Vec::new();
    move |start| {
        let new = !seen.contains(&start.spec.id);
        seen.push(start.spec.id);
        new
    }
}

#[cfg(test)]
mod tests {
    use furuta_model::{Effect, Rig, effects};

    use super::*;
    use crate::diagnose::sweep::{Recorded, sweep};
    use crate::shooting::{Effort, bounded_step};

    /// Much of what an effect changes the base parameters and the zeros can follow: an offset of alpha differs from the
    /// recordings' own zeros by their prior alone. A fit begins where all of them fit beside a small effect, and not
    /// with the effect beside what mimics it.
    #[test]
    fn a_small_effect_starts_where_the_other_numbers_fit_beside_it() {
        let rig = Rig::builtin("qube-servo-2").expect("built in");
        let count = rig.sensors.resolution()[1];
        for (id, value) in [
            ("sensor.alpha.offset", 4.0 * count),
            ("pendulum.quadratic", 5e-7),
        ] {
            let hidden = Effect::new(id, &[value]).expect("valid");
            let recordings = [("first", -0.6), ("second", 0.9)]
                .map(|(name, zero)| sweep(name, &rig, &[hidden], zero * count));
            let mut sheet = rig.clone();
            sheet.params.arm.length *= 1.01;
            let recorded = Recorded::new(&recordings, &sheet);
            let problem = recorded.problem();
            let without = recorded.refitted(&problem);
            assert!(problem.chi(&without) < SMALL);

            let spec = effects::spec(id).expect("an entry");
            let screen = Screen::new(&problem, &without);
            let starts = problem.scored(&without, &[spec], &screen, &|_| ());
            let h = without.model.with(spec);
            let start = problem.solve_states(&h, &starts[0].z, Some(&without.states));
            let with = problem.fit(&h, start.z.clone(), &start.states, Effort::FULL);
            // What is left to gain is what a linear step misses.
            let gain = (without.cost - start.cost) / (without.cost - with.cost);
            assert!(gain > 0.5, "{id}: {gain}");
            // The last steps of a fit are made by older slopes: where it ends, new ones do not lead on.
            let (r, bounds) = (problem.linearise(&with), h.bounds(&with.z));
            let step = bounded_step(&with.z, &r, &bounds, 0.0).expect("determined");
            let left = 2.0 * r.gradient.dot(&step) - (&r.matrix * &step).dot(&step);
            assert!(left < Effort::FULL.tolerance * with.cost, "{id}: {left}");
        }
    }
}
