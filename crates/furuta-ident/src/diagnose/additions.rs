//! One more effect: where each candidate of the catalogue may start, which are fitted, and what the fits say.

use furuta_model::effects::{Acts, Kind, OF_ACCELERATION, Offered};
use furuta_model::{CATALOGUE, MAX_OWN_STATES, Spec};
use rayon::prelude::*;

use super::Fit;
use super::criteria::CRITERIA;
use super::evidence::Evidence;
use super::hypothesis::{FIRST_EFFECT, Hypothesis};
use super::savers::Savers;
use super::screen::{self, Screen};
use super::thinned::Part;
use crate::shooting::{Effort, MAX_FREE, Model, Problem, is_late};

/// Strength (in units of the typical one) of an effect that changes nothing and still has a slope.
const NEXT_TO_NOTHING: f64 = 1e-3;
/// Strength (in units of the typical one) at which a candidate that starts from none is tried.
pub(super) const TOUCH: f64 = 0.3;
/// Below this (in units of the noise) what is left is small, and effects of about the strength that the score test
/// says.
const SMALL: f64 = 1.5;
/// No start is stronger than this, in units of the typical strength.
const STRONGEST: f64 = 3.0;

/// A candidate compared with the hypothesis it extends.
#[derive(Clone, Debug)]
pub(super) struct Trial {
    pub(super) spec: &'static Spec,
    pub(super) fit: Fit,
    pub(super) evidence: Evidence,
}

/// The catalogue's entries that are looked for from the outset, those of one kind of rig included. Late encoders are
/// the same as a late command on recorded input and output, which stands for both; others are looked for where these
/// leave something, or on request ([`super::Options::candidates`]).
pub fn candidates() -> impl Iterator<Item = &'static Spec> {
    CATALOGUE
        .iter()
        .chain(OF_ACCELERATION)
        .copied()
        .filter(|s| s.offered.is_always() && !s.acts.includes(Acts::SENSOR_DELAY))
}

/// The entries that no recording of input and output tells apart from `spec`.
pub(super) fn same_class(spec: &'static Spec) -> impl Iterator<Item = &'static Spec> {
    CATALOGUE
        .iter()
        .copied()
        .filter(move |s| s.id != spec.id && is_late(s) && is_late(spec))
}

/// Whether hypothesis and rig file have as many laws with a state, or with a memory of the arm's way, as a plant can
/// hold, and this is one more.
pub(super) fn lacks_room(h: &Hypothesis, spec: &Spec) -> bool {
    let full = |kind: Acts, most: usize| {
        let present = h.sheet.present.iter().map(|e| e.spec());
        let others = present.chain(h.effects.iter().copied());
        spec.acts.includes(kind) && others.filter(|s| s.acts.includes(kind)).count() >= most
    };
    full(Acts::STATE, MAX_OWN_STATES) || full(Acts::MEMORY, 1)
}

/// Whether an effect can act on the rig and show in its recordings, is neither in the hypothesis nor in the rig file,
/// and plant and fit can still hold it.
pub(super) fn can_hold(h: &Hypothesis, spec: &Spec) -> bool {
    let numbers = h.layout().local() + spec.parameters.len();
    let present = h.sheet.present.iter().map(|e| e.spec());
    !h.has(spec.id)
        && !matches!(spec.offered, Offered::Never(_))
        && numbers <= MAX_FREE
        && !lacks_room(h, spec)
        && spec.acts.not_on(h.sheet.params.motor.actuation).is_none()
        && spec.acts.shows_in(h.sheet.tells)
        && present
            .into_iter()
            .all(|e| e.id != spec.id && !(is_late(e) && is_late(spec)))
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

/// A start, and its score statistic.
struct FitStart {
    /// By how much the score test says that the cost will fall.
    statistic: f64,
    spec: &'static Spec,
    /// How often per turn a friction changes: the statistic does not tell one order from another, a fit does.
    order: Option<f64>,
    z: Vec<f64>,
}

impl Problem<'_> {
    /// Where the base parameters of a fit with one more effect may start. Those refitted without the effect may be far
    /// off: where the gap is large, the data sheet is a better start.
    fn bases(&self, from: &Fit) -> Vec<[f64; FIRST_EFFECT]> {
        let refitted = std::array::from_fn(|i| from.z[i]);
        let far = !self.explains(from) && from.model.effects.is_empty();
        if far {
            vec![[0.0; FIRST_EFFECT], refitted]
        } else {
            vec![refitted]
        }
    }

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

    /// A fit in which a part of these windows placed what no fit moves, with the places looked for in all of them.
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

    /// The entries looked for that are neither in `from` nor in the rig file, and whose parameters a fit can still
    /// hold.
    pub(super) fn addable(&self, from: &Fit) -> impl Iterator<Item = &'static Spec> {
        let entries = from.model.sheet.looked_for.iter().copied();
        entries.filter(|s| can_hold(&from.model, s))
    }

    /// Fits every candidate added to `from`, the best first. Where `from` is far from the data, a part of the windows
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
        let part = instead.and_then(|i| {
            let part = self.part_showing(from, i.known, savers.windows)?;
            Some((i, part))
        });
        let mut fits = match part {
            Some((instead, part)) => {
                known.par_extend(self.near_in_part(from, &new, (instead, &part), asked));
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
                    self.fit(&fit.model.clone(), fit.z.clone(), &fit.states, effort)
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
        trials.sort_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost));
        trials
    }

    /// Fits of candidates in the place of an effect: those that come near in a part of the windows, and, where with
    /// that effect nothing is left, as near as what is like it does.
    fn near_in_part(
        &self,
        from: &Fit,
        new: &[&'static Spec],
        (instead, part): (&Instead<'_>, &Part<'_>),
        asked: &Asked<'_>,
    ) -> impl ParallelIterator<Item = (&'static Spec, Fit)> {
        let here = part.of(instead.known);
        // What that effect leaves above the noise, another one may not.
        let above = (here.cost - part.problem.floor()).max(0.0);
        let goal = here.cost + above + (instead.goal - instead.known.cost);
        let there = (part.problem).quickly(&part.start, (new, Vec::new()), Some(goal), asked);
        let least = part.start.cost - asked.savers.close * (part.start.cost - goal);
        let explained = self.explains(instead.known);
        let ended = move |fit: Fit| {
            if !explained || fit.cost <= goal {
                return Some(fit);
            }
            let effort = Effort::FULL.towards(goal);
            let ended = (part.problem).fit(&fit.model, fit.z.clone(), &fit.states, effort);
            if ended.cost <= goal {
                return Some(ended);
            }
            let moved = (part.problem).moved(&here, &fit.model, Some(&ended), effort)?;
            (moved.cost <= goal).then_some(moved)
        };
        there
            .into_par_iter()
            .filter(move |(_, fit)| fit.cost <= least)
            .filter_map(move |(spec, fit)| {
                let there = ended(fit)?;
                let states = if explained {
                    &instead.known.states
                } else {
                    &from.states
                };
                let effort = Effort::QUICK.towards(instead.goal);
                Some((spec, self.fit(&there.model, there.z, states, effort)))
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
        let per_sample = self.per_sample(from);
        let mut goal = from.cost - savers.least_share_scanned * CRITERIA.effect * per_sample;
        goal = goal.min(reaches.unwrap_or(f64::INFINITY));
        keep_scored(self.per_sample(from), from.cost - goal, savers, &mut starts);
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

    /// A score test for each start of each candidate, with one simulation; the largest statistic first.
    fn scored(
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
        let bases = self.bases(from);
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
                bases.iter().map(move |base| {
                    let z = with_base(&z, base);
                    FitStart {
                        statistic: scored.unwrap_or_else(|| self.fall(from, spec, &z)),
                        spec,
                        order,
                        z,
                    }
                })
            })
            .collect();
        starts.sort_by(|a, b| b.statistic.total_cmp(&a.statistic));
        starts
    }

    /// The score statistic of one start. Where what is missing is small, so is the effect, if it is the one: `z` takes
    /// the strength that the score says.
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
        let statistic = score.map_or(f64::INFINITY, |s| s.statistic(one_way));
        if self.chi(from) < SMALL && screen::looks(spec).is_none() && statistic > 0.0 {
            let factor = score.map_or(1.0, |s| s.product / s.square);
            for i in strengths {
                z[i] = if spec.acts.includes(Acts::BACKWARDS) {
                    (here[i] / factor).max(1.0 / STRONGEST)
                } else {
                    (here[i] * factor).clamp(-STRONGEST, STRONGEST)
                };
            }
        }
        statistic
    }

    /// By how much the cost falls at a start itself, the windows' initial states solved for. A stiff stop is far from
    /// being in proportion to its strength: a score test says nothing of it.
    fn fall(&self, from: &Fit, spec: &'static Spec, z: &[f64]) -> f64 {
        let there = self.solve_states(&from.model.with(spec), z, Some(&from.states));
        (from.cost - there.cost).max(0.0)
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
                    let fit = self.fit(&h, z, &from.states, Effort::QUICK.towards(goal));
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

/// A vector with these base parameters.
fn with_base(z: &[f64], base: &[f64; FIRST_EFFECT]) -> Vec<f64> {
    let mut z = z.to_vec();
    z[..FIRST_EFFECT].copy_from_slice(base);
    z
}

/// Where a friction has its order among its parameters.
fn order(spec: &Spec) -> Option<usize> {
    let orders = spec.parameters.iter().position(|p| p.kind == Kind::Whole);
    orders.filter(|_| spec.acts.includes(Acts::DRY_FRICTION))
}

/// Whether a start is the first of its effect, asked of one after the other.
fn news() -> impl FnMut(&FitStart) -> bool {
    let mut seen: Vec<&'static str> = Vec::new();
    move |start| {
        let new = !seen.contains(&start.spec.id);
        seen.push(start.spec.id);
        new
    }
}

fn lowest(fits: &[(&'static Spec, Fit)], from: f64) -> f64 {
    fits.iter().map(|(_, f)| f.cost).fold(from, f64::min)
}

/// The cost to which a fit must come down to be near the best of `fits`.
fn close(from: &Fit, fits: &[(&'static Spec, Fit)], savers: &Savers) -> f64 {
    from.cost - savers.close * (from.cost - lowest(fits, from.cost))
}

/// Keeps the starts to be fitted: of those whose score statistic could convince (and could gain `wanted`), the few with
/// a statistic near the best. A kick gains much in one window, and says nothing of what gains a little in all of them:
/// it does not count as the best.
fn keep_scored(per_sample: f64, wanted: f64, savers: &Savers, starts: &mut Vec<FitStart>) {
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
            || start.statistic < least_share * CRITERIA.least(spec) * per_sample
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
