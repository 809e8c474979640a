//! One more effect: which candidates of the catalogue are fitted, from which starts, and what the fits say.

use furuta_model::Spec;
use furuta_model::effects::Acts;
use rayon::prelude::*;

use super::Fit;
use super::alike::contains;
use super::candidates::can_hold;
use super::criteria::CRITERIA;
use super::evidence::Evidence;
use super::savers::Savers;
use super::screen::{self, Screen};
use super::starts::{FitStart, news};
use super::subset::Subset;
use crate::shooting::{Effort, Problem};

/// Strength (in units of the typical one) of an effect that changes nothing and still has a slope.
const NEXT_TO_NOTHING: f64 = 1e-3;

/// A candidate compared with the hypothesis it extends.
#[derive(Clone, Debug)]
pub(super) struct Trial {
    pub(super) spec: &'static Spec,
    pub(super) fit: Fit,
    pub(super) evidence: Evidence,
}

/// An effect in whose place others are tried.
pub(super) struct Instead<'a> {
    pub(super) spec: &'static Spec,
    /// The fit that has it.
    pub(super) known: &'a Fit,
    /// The cost that others must reach: somewhat more than that fit's.
    pub(super) goal: f64,
}

/// What an earlier search says of an effect added to a fit over the same windows.
pub(super) enum Earlier {
    /// It did not look for it.
    New,
    /// It did not follow it.
    Left,
    Fitted(Box<Fit>),
}

/// What is asked of additions.
pub(super) struct Asked<'a> {
    /// An effect that is known to bring the cost down to somewhat less than a goal: others that cannot are given up.
    pub(super) instead: Option<&'a Instead<'a>>,
    /// What an earlier search says of each effect.
    pub(super) earlier: &'a dyn Fn(&'static Spec) -> Earlier,
    pub(super) savers: &'a Savers,
    /// Told of each candidate.
    pub(super) report: &'a (dyn Fn(&str) + Sync),
}

impl Problem<'_> {
    /// A fit in which a subset of these windows placed what no fit moves, with the places looked for in all of them.
    pub(super) fn placed_again(&self, mut here: Fit) -> Fit {
        let effects = here.model.effects.clone();
        for spec in effects.into_iter().filter(|e| screen::stays_placed(e)) {
            let without = self.without(&here, spec.id, Effort::QUICK);
            let screen = Screen::new(self, &without);
            let h = without.model.with(spec);
            for z in self.shapes(&without, spec, &screen) {
                let there = self.fit(&h, z, &without.states, Effort::FULL);
                if there.cost < here.cost {
                    here = there;
                }
            }
        }
        here
    }

    /// A fit to other windows, fitted to these: their starts are first solved for with its numbers, as those that fit
    /// `start` may be far from them, and lead a fit astray.
    pub(super) fn transferred(&self, start: &Fit, fit: &Fit, effort: Effort) -> Fit {
        let (model, z) = (fit.model.on_sheet_of(&start.model), fit.z.clone());
        let states = self.read_alike(start, &model, &z);
        let there = self.solve_states(&model, &z, Some(&states));
        self.placed_again(self.fit(&model, z, &there.states, effort))
    }

    /// The entries looked for that are neither in `from` nor in the rig file, and whose parameters a fit can still
    /// hold.
    pub(super) fn addable(&self, from: &Fit) -> impl Iterator<Item = &'static Spec> {
        let entries = from.model.sheet.looked_for.iter().copied();
        entries.filter(|s| can_hold(&from.model, s))
    }

    /// Fits every candidate added to `from`, the best first. Where `from` is far from the data, a subset of the windows
    /// says which cannot stand in the place of another.
    pub(super) fn additions(&self, from: &Fit, asked: &Asked<'_>) -> Vec<Trial> {
        let (instead, savers) = (asked.instead, asked.savers);
        let mut known = Vec::new();
        let mut new = Vec::new();
        for spec in self.addable(from) {
            match (asked.earlier)(spec) {
                _ if instead.is_some_and(|i| i.spec.id == spec.id) => {}
                Earlier::New => new.push(spec),
                Earlier::Left => {}
                Earlier::Fitted(fit) => known.push((spec, *fit)),
            }
        }
        let subset = instead.and_then(|i| {
            let subset = self.subset_showing(from, i.known, savers.windows)?;
            Some((i, subset))
        });
        let mut fits = match subset {
            Some((instead, subset)) => {
                known.par_extend(self.near_in_subset(from, &new, (instead, &subset), asked));
                known
            }
            None => {
                let goal = instead.map(|i| i.goal);
                self.quickly(from, (&new, known), goal, asked)
            }
        };
        fits.sort_by(|a, b| a.1.cost.total_cmp(&b.1.cost));
        let gain = from.cost - lowest(&fits, from.cost);
        let near = close(from, &fits, savers);
        let known = instead.map_or(f64::INFINITY, |i| i.goal);
        let mut trials: Vec<Trial> = fits
            .into_par_iter()
            .enumerate()
            .map(|(rank, (spec, fit))| {
                let listed = rank < savers.short_list;
                let fit = if listed && fit.cost > from.cost {
                    self.started_from_smaller(from, fit, savers)
                } else if listed && fit.cost <= near {
                    let beside_best = from.cost - (1.0 - 0.5 * (1.0 - savers.close)) * gain;
                    let goal = known.min(if rank == 0 {
                        f64::INFINITY
                    } else {
                        beside_best
                    });
                    let effort = Effort::FULL.within(savers.full_steps).towards(goal);
                    let fit = self.fit(&fit.model, fit.z.clone(), &fit.states, effort);
                    self.in_its_valley(fit, effort)
                } else {
                    fit
                };
                let evidence = self.evidence(from, &fit);
                Trial {
                    spec,
                    fit,
                    evidence,
                }
            })
            .collect();
        let found: Vec<(usize, Trial)> = (0..trials.len())
            .into_par_iter()
            .filter_map(|i| Some((i, self.led_by_simpler(from, &trials, i, savers)?)))
            .collect();
        for (i, trial) in found {
            trials[i] = trial;
        }
        trials.sort_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost));
        trials
    }

    /// The `i`-th trial from the best of those that it contains, where that is nearer to the data and leaves something:
    /// a law that can do all that a simpler one does has lost its way where it does less.
    fn led_by_simpler(
        &self,
        from: &Fit,
        trials: &[Trial],
        i: usize,
        savers: &Savers,
    ) -> Option<Trial> {
        let lost = &trials[i];
        let simple = (trials.iter())
            .filter(|t| contains(lost.spec, t.spec) && t.fit.cost < lost.fit.cost)
            .min_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost))
            .filter(|t| !self.explains(&t.fit))?;
        // What more numbers do not earn is not looked for.
        let goal = simple.fit.cost - CRITERIA.effect * self.per_sample(&simple.fit);
        let effort = Effort::FULL.within(savers.full_steps).towards(goal);
        let fit = self.moved(&simple.fit, &lost.fit.model, None, effort)?;
        (fit.cost < lost.fit.cost).then(|| Trial {
            spec: lost.spec,
            evidence: self.evidence(from, &fit),
            fit,
        })
    }

    /// What repeats with the arm's angle is alike at several angles: where the last effect leaves something, it may be
    /// for the wrong one of them in some recording.
    fn in_its_valley(&self, fit: Fit, effort: Effort) -> Fit {
        let h = &fit.model;
        let Some(spec) = h
            .effects
            .last()
            .filter(|_| h.sees_angle() && !self.explains(&fit))
        else {
            return fit;
        };
        let phase = spec.origin().filter(|_| spec.sees_angle()).map(|i| {
            let unit = spec.parameters[i].typical(&h.sheet.params);
            (h.offset(h.effects.len() - 1) + i, unit)
        });
        self.turned(&fit, phase, effort).unwrap_or(fit)
    }

    /// Fits of candidates in the place of an effect: those that come near in a subset of the windows, and, where with
    /// that effect nothing is left, as near as what is like it does.
    fn near_in_subset(
        &self,
        from: &Fit,
        new: &[&'static Spec],
        (instead, subset): (&Instead<'_>, &Subset<'_>),
        asked: &Asked<'_>,
    ) -> impl ParallelIterator<Item = (&'static Spec, Fit)> {
        let here = subset.of(instead.known);
        // What that effect leaves above the noise, another one may not.
        let above = (here.cost - subset.problem.floor()).max(0.0);
        let goal = here.cost + above + (instead.goal - instead.known.cost);
        let there = (subset.problem).quickly(&subset.start, (new, Vec::new()), Some(goal), asked);
        let least = subset.start.cost - asked.savers.close * (subset.start.cost - goal);
        let explained = self.explains(instead.known);
        let ended = move |fit: Fit| {
            if !explained || fit.cost <= goal {
                return Some(fit);
            }
            let effort = Effort::FULL.towards(goal);
            let ended = (subset.problem).fit(&fit.model, fit.z.clone(), &fit.states, effort);
            if ended.cost <= goal {
                return Some(ended);
            }
            let moved = (subset.problem).moved(&here, &fit.model, Some(&ended), effort)?;
            (moved.cost <= goal).then_some(moved)
        };
        there
            .into_par_iter()
            .filter(move |(_, fit)| fit.cost <= least)
            .filter_map(move |(spec, fit)| {
                let there = ended(fit)?;
                let near = if explained { instead.known } else { from };
                let states = self.read_alike(near, &there.model, &there.z);
                let effort = Effort::QUICK.towards(instead.goal);
                Some((spec, self.fit(&there.model, there.z, &states, effort)))
            })
    }

    /// A larger model that fits worse than the smaller one has lost its way: it is fitted from there, with next to
    /// nothing of what was added, so that all numbers move together.
    fn started_from_smaller(&self, from: &Fit, lost: Fit, savers: &Savers) -> Fit {
        let h = lost.model.clone();
        let Some(spec) = h.effects.last() else {
            return lost;
        };
        let mut values = lost.z[from.model.shared()..h.shared()].to_vec();
        let backwards = spec.acts.includes(Acts::BACKWARDS);
        for strength in &mut values[..spec.strengths] {
            let size = if backwards {
                1.0 / NEXT_TO_NOTHING
            } else {
                NEXT_TO_NOTHING
            };
            *strength = size.copysign(*strength);
        }
        let z = from.model.extended(&from.z, &values);
        let effort = Effort::FULL.within(savers.full_steps);
        let found = self.fit(&h, z, &from.states, effort);
        if found.cost < lost.cost { found } else { lost }
    }

    /// Quick fits of the new candidates that the screen leaves, beside those known already; none of those that cannot
    /// reach a cost, if one is given.
    pub(super) fn quickly(
        &self,
        from: &Fit,
        (new, mut fits): (&[&'static Spec], Vec<(&'static Spec, Fit)>),
        reaches: Option<f64>,
        asked: &Asked<'_>,
    ) -> Vec<(&'static Spec, Fit)> {
        let (savers, report) = (asked.savers, asked.report);
        if new.is_empty() {
            return fits;
        }
        let screen = Screen::new(self, from);
        let mut starts = self.scored(from, new, &screen, report);
        let least = new.iter().map(|spec| self.least(&from.model, spec));
        let least = least.fold(CRITERIA.effect, f64::min) * self.per_sample(from);
        let mut goal = from.cost - savers.least_share_scanned * least;
        goal = goal.min(reaches.unwrap_or(f64::INFINITY));
        self.keep_scored(from, from.cost - goal, savers, &mut starts);
        let best_statistic = starts.first().map_or(0.0, |s| s.statistic);
        let mut favourites: Vec<&str> = Vec::new();
        for s in &starts {
            if favourites.len() < savers.favourites && !favourites.contains(&s.spec.id) {
                favourites.push(s.spec.id);
            }
        }
        let (first, mut others): (Vec<FitStart>, Vec<FitStart>) = starts
            .into_iter()
            .partition(|s| favourites.contains(&s.spec.id));
        goal = goal.min(close(from, &fits, savers));
        fits.extend(self.quick(from, first, goal, savers, report));
        let goal = goal.min(close(from, &fits, savers));
        if self.is_answered(from, &fits) {
            // The answer is there: what is left is to see which others come near. Beside other effects that is asked
            // once more, of each of them.
            let asked_again = reaches.is_none() && !from.model.effects.is_empty();
            let blows = fits.iter().any(|(_, f)| f.model.has_blows());
            let mut is_new = news();
            others.retain(|s| {
                is_new(s)
                    && s.statistic >= savers.least_share_beside * best_statistic
                    && (blows || !asked_again)
            });
        }
        fits.extend(self.quick(from, others, goal, savers, report));
        fits
    }

    /// Whether one of the fits explains what `from` does not.
    fn is_answered(&self, from: &Fit, fits: &[(&'static Spec, Fit)]) -> bool {
        !self.explains(from) && fits.iter().any(|(_, f)| self.explains(f))
    }

    /// Quick fits; of each effect the best. Of an effect with several starts the others wait for the first: where one
    /// fit explains the data, they are not needed, and elsewhere they have to come near the best.
    fn quick(
        &self,
        from: &Fit,
        starts: Vec<FitStart>,
        goal: f64,
        savers: &Savers,
        report: &(dyn Fn(&str) + Sync),
    ) -> Vec<(&'static Spec, Fit)> {
        let mut is_new = news();
        let (first, others): (Vec<FitStart>, Vec<FitStart>) =
            starts.into_iter().partition(|s| is_new(s));
        let each = |starts: Vec<FitStart>, goal: f64| -> Vec<(&'static Spec, Fit)> {
            starts
                .into_par_iter()
                .filter(|_| !self.stop.wanted())
                .map(|FitStart { spec, z, .. }| {
                    let h = from.model.with(spec);
                    let states = self.read_alike(from, &h, &z);
                    let fit = self.fit(&h, z, &states, Effort::QUICK.towards(goal));
                    report(spec.id);
                    (spec, fit)
                })
                .collect()
        };
        let mut best = each(first, goal);
        if self.is_answered(from, &best) {
            return best;
        }
        let goal = goal.min(close(from, &best, savers));
        for (spec, fit) in each(others, goal) {
            match best.iter_mut().find(|(s, _)| s.id == spec.id) {
                Some((_, known)) if fit.cost < known.cost => *known = fit,
                Some(_) => {}
                None => best.push((spec, fit)),
            }
        }
        best
    }
}

fn lowest(fits: &[(&'static Spec, Fit)], from: f64) -> f64 {
    fits.iter().map(|(_, f)| f.cost).fold(from, f64::min)
}

/// The cost to which a fit must come down to be near the best of `fits`.
fn close(from: &Fit, fits: &[(&'static Spec, Fit)], savers: &Savers) -> f64 {
    from.cost - savers.close * (from.cost - lowest(fits, from.cost))
}

#[cfg(test)]
mod tests {
    use furuta_model::effects;

    use super::super::savers::USUAL;
    use super::super::sweep::{extended, sticking};
    use super::*;

    /// Stribeck's friction that ends further from the data than Coulomb's does.
    #[test]
    fn a_law_that_lost_its_way_is_led_by_a_simpler_one() {
        let recorded = sticking();
        let problem = recorded.problem();
        let from = recorded.refitted(&problem);
        let trial = |id: &str, values: &[f64], effort: Effort| {
            let fit = extended(&problem, &from, id, values, effort);
            Trial {
                spec: effects::spec(id).expect("an entry"),
                evidence: problem.evidence(&from, &fit),
                fit,
            }
        };
        let simple = trial("arm.coulomb", &[1e-3], Effort::FULL);
        let lost = trial("arm.stribeck", &[1e-5, 1e-5, 1.0], Effort::FULL.within(0));
        assert!(simple.fit.cost < lost.fit.cost && !problem.explains(&simple.fit));

        let trials = [simple, lost];
        let led = problem
            .led_by_simpler(&from, &trials, 1, &USUAL)
            .expect("the way");
        assert!(problem.explains(&led.fit), "{}", problem.chi(&led.fit));
        assert!(problem.led_by_simpler(&from, &trials, 0, &USUAL).is_none());
    }
}
