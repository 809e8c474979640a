//! Which effects are missing: a best-first search over sets of effects.
//!
//! Every set that was fitted is kept with its best fit. The search takes the set with the best score that it has not
//! been through, and tries what is one step away: one effect more, one fewer, another one in the place of one. A
//! neighbour is fitted from where the set ended, so a fit that stopped short is found out by its neighbours. It ends
//! when no neighbour of the best set is better; what came near the best is a rival. It may begin with a subset of the
//! windows (`super::subset`) and go on with all (`onto`).

mod larger;
mod neighbours;
mod onto;
mod places;
mod searched;

use std::collections::BTreeMap;

use furuta_model::Spec;
use rayon::prelude::*;

use super::Fit;
use super::additions::{Asked, Instead, Trial};
use super::alike::is_simpler;
use super::criteria::CRITERIA;
use super::evidence::{FAR, possible};
use super::hypothesis::Hypothesis;
use super::savers::Savers;
use crate::shooting::{Effort, Problem};
pub(super) use searched::Searched;
use searched::{Set, set};

/// The most effects that are looked for together.
pub(super) const MOST_EFFECTS: usize = 4;
/// Sets that are gone through side by side, where the best is still further than `FAR` times the noise from the data:
/// alone, neither of a pair need be the best.
const BEAM: usize = 3;
/// Sets that are gone through at most.
const MOST_SETS: usize = 16;

/// What is known of a set.
struct Node {
    fit: Fit,
    /// Whether each of its effects convinces, as far as is known.
    eligible: bool,
    /// Whether one more effect was tried, and others in the place of each.
    grown: bool,
    exchanged: bool,
    /// Whether its fit was tried without each effect.
    reduced: bool,
    /// The cost towards which additions to it were followed, where they were.
    followed: Option<f64>,
}

impl Node {
    /// The same set with its fit to other windows.
    fn over(&self, fit: Fit) -> Self {
        Self {
            fit,
            reduced: false,
            ..*self
        }
    }
}

/// A law tried in the place of an effect.
struct Replaced {
    law: &'static Spec,
    /// The fit without that effect.
    without: Fit,
    /// A fit with the law, whose numbers for it are taken.
    known: Option<Fit>,
    /// The cost to which it must come down.
    limit: f64,
}

/// What could stand in the place of an effect.
pub(super) struct Rival {
    /// The effect.
    pub(super) spec: &'static Spec,
    /// The fit without it.
    pub(super) without: Fit,
    /// Others that explain the data nearly as well in its place.
    pub(super) near: Vec<Trial>,
}

/// A search over one problem.
pub(super) struct Search<'a> {
    problem: &'a Problem<'a>,
    known: BTreeMap<Set, Node>,
    /// Effects that stay.
    fixed: Hypothesis,
    /// Whether an addition may be taken up, beside its evidence.
    acceptable: &'a (dyn Fn(&Trial) -> bool + Sync),
    savers: &'static Savers,
    report: &'a (dyn Fn(&str) + Sync),
    /// How often a set may still be gone through.
    left: usize,
    /// What an earlier search has fitted to these windows.
    earlier: Searched,
    /// Where it began with a subset of the windows, what was found there.
    over_subset: Option<Searched>,
    /// What was added to the start.
    pub(super) first: Vec<Trial>,
}

impl<'a> Search<'a> {
    /// From `start`, whose effects stay.
    pub(super) fn new(
        problem: &'a Problem<'a>,
        start: Fit,
        acceptable: &'a (dyn Fn(&Trial) -> bool + Sync),
        savers: &'static Savers,
        report: &'a (dyn Fn(&str) + Sync),
    ) -> Self {
        let mut search = Self {
            problem,
            known: BTreeMap::new(),
            fixed: start.model.clone(),
            acceptable,
            savers,
            report,
            left: 2 * MOST_SETS,
            earlier: Searched::default(),
            over_subset: None,
            first: Vec::new(),
        };
        search.keep(start, true);
        search
    }

    /// The same search, which need not fit again what an earlier one has fitted to these windows.
    pub(super) fn knowing(self, earlier: Searched) -> Self {
        Self { earlier, ..self }
    }

    /// What was found over the windows with which it began.
    pub(super) fn at_first(&self) -> Searched {
        self.over_subset.clone().unwrap_or_else(|| self.so_far())
    }

    fn so_far(&self) -> Searched {
        let known = self.known.iter();
        Searched {
            fits: known
                .clone()
                .map(|(s, n)| (s.clone(), n.fit.clone()))
                .collect(),
            grown: known
                .filter(|(_, n)| n.grown)
                .map(|(s, _)| s.clone())
                .collect(),
            looked_for: self.fixed.sheet.looked_for.clone(),
        }
    }

    /// Goes through sets until no neighbour of the best is better; the best fit.
    pub(super) fn run(&mut self) -> Fit {
        self.run_while(|_| true);
        self.best()
    }

    /// Goes through sets until no neighbour of the best is better, as long as that is `wanted`.
    pub(super) fn run_while(&mut self, wanted: impl Fn(&Self) -> bool) {
        while !self.problem.stop.wanted() && !self.is_through() && wanted(self) {
            let Some(next) = self.next() else { break };
            match self.known[&next] {
                Node { reduced: false, .. } => {
                    self.reduce(&next);
                    continue;
                }
                Node { grown: false, .. } => self.grow(&next),
                _ => self.exchange(&next),
            }
            self.left -= 1;
        }
    }

    /// Whether each effect of the best set is known to convince beside the others.
    pub(super) fn is_settled(&self) -> bool {
        let is_known = |best: &&Set| self.known[*best].reduced || self.known[*best].grown;
        self.ranked().first().is_none_or(is_known)
    }

    /// Whether this is the problem it works on.
    pub(super) fn is_over(&self, problem: &Problem<'_>) -> bool {
        std::ptr::addr_eq(self.problem, problem)
    }

    /// Whether its best fit explains the data.
    pub(super) fn explains(&self) -> bool {
        self.problem.explains(&self.closest())
    }

    /// What it leaves out to save time.
    pub(super) fn savers(&self) -> &'static Savers {
        self.savers
    }

    /// Whether nothing is left to go through.
    pub(super) fn is_through(&self) -> bool {
        self.left == 0 || self.next().is_none()
    }

    /// Goes on with the same windows in a problem whose fits have more time.
    pub(super) fn calmly(&mut self, problem: &'a Problem<'a>) {
        debug_assert_eq!(self.problem.windows.len(), problem.windows.len());
        self.problem = problem;
    }

    /// Keeps the better fit of a set.
    fn keep(&mut self, fit: Fit, eligible: bool) {
        let node = self.known.entry(set(&fit.model)).or_insert_with(|| Node {
            fit: fit.clone(),
            eligible,
            grown: false,
            exchanged: false,
            reduced: false,
            followed: None,
        });
        node.eligible |= eligible && !node.grown;
        if fit.cost < node.fit.cost {
            node.fit = fit;
            node.reduced = false;
        }
    }

    /// The unit of all scores: what the closest fit leaves per sample.
    fn unit(&self) -> f64 {
        let costs = self.known.values().map(|n| self.problem.per_sample(&n.fit));
        costs.fold(f64::INFINITY, f64::min)
    }

    /// The eligible sets, the best score first.
    fn ranked(&self) -> Vec<&Set> {
        self.by_score(|node| node.eligible)
    }

    /// The sets that are `wanted`, the best score first.
    fn by_score(&self, wanted: impl Fn(&Node) -> bool) -> Vec<&Set> {
        let unit = self.unit();
        let score = |s: &Set| self.problem.score(&self.known[s].fit, unit);
        let mut sets: Vec<&Set> = self
            .known
            .keys()
            .filter(|s| wanted(&self.known[*s]))
            .collect();
        sets.sort_by(|a, b| score(a).total_cmp(&score(b)));
        sets
    }

    /// The eligible fit with the best score.
    pub(super) fn closest(&self) -> Fit {
        let closest = self
            .ranked()
            .first()
            .map_or_else(|| set(&self.fixed), |s| (*s).clone());
        self.known[&closest].fit.clone()
    }

    /// The cost below which another one in the place of what `smaller` lacks of `fit` is near it.
    fn near(&self, fit: &Fit, smaller: &Fit) -> f64 {
        fit.cost + (1.0 - self.savers.close) * (smaller.cost - fit.cost)
    }

    /// The best fit of those whose effects were each tried without, and, where the search was ended early, each in the
    /// place of another: who might stand in its place has to be known. The start where there is none.
    pub(super) fn best(&self) -> Fit {
        let early = self.problem.stop.wanted();
        let is_through = |s: &&&Set| {
            let node = &self.known[**s];
            node.grown && (node.exchanged || !early)
        };
        let start = set(&self.fixed);
        let best = self
            .ranked()
            .into_iter()
            .find(|s| is_through(&s))
            .unwrap_or(&start);
        self.known[best].fit.clone()
    }

    /// The set to go through next: the best one to its end; of those beside it each grows. Far from the data where no
    /// effect convinces alone, one of a pair may be among those that come nearest.
    fn next(&self) -> Option<Set> {
        let ranked = self.ranked();
        let best = ranked.first()?;
        let node = &self.known[*best];
        if !(node.reduced && node.grown && node.exchanged) {
            return Some((*best).clone());
        }
        let is_far = self.problem.chi(&node.fit) > FAR;
        let beam = if is_far { BEAM } else { 1 };
        let open = |s: &&&Set| !self.known[**s].grown;
        let none_convinces = is_far && **best == set(&self.fixed);
        let one = self.fixed.effects.len() + 1;
        let alone =
            none_convinces.then(|| self.by_score(|node| node.fit.model.effects.len() == one));
        let beside = ranked.iter().take(beam);
        let next = beside.chain(alone.iter().flatten().take(BEAM)).find(open);
        next.map(|s| (*s).clone())
    }

    /// Tries the set without each of its effects, and with a simpler look-alike in the place of each: one in which some
    /// do not convince is no answer, and more parameters must earn their place. A fit with an effect in a wrong place
    /// is replaced first.
    fn reduce(&mut self, here: &Set) {
        let fit = self.known[here].fit.clone();
        if let Some(better) = self.placed_elsewhere(&fit) {
            self.keep(better, false);
            return;
        }
        let mut convinces = true;
        let mut simpler = Vec::new();
        for (spec, smaller) in self.without_each(&fit) {
            convinces &= self.problem.evidence(&smaller, &fit).convinces();
            let like = self
                .problem
                .addable(&smaller)
                .filter(|c| is_simpler(c, spec));
            let limit = self.near(&fit, &smaller);
            simpler.extend(like.map(|law| {
                Replaced {
                    without: smaller.clone(),
                    known: self
                        .known
                        .get(&set(&smaller.model.with(law)))
                        .map(|n| n.fit.clone()),
                    law,
                    limit,
                }
            }));
            self.keep(smaller, true);
        }
        self.replace(&fit, simpler);
        if let Some(node) = self.known.get_mut(here) {
            node.eligible &= convinces;
            node.reduced = true;
        }
    }

    /// Fits other laws in the place of effects, from where a set ended, and keeps what comes down to its limit.
    fn replace(&mut self, here: &Fit, laws: Vec<Replaced>) {
        let fits: Vec<(Fit, bool)> = laws
            .into_par_iter()
            .filter_map(|r| {
                let (h, effort) = (r.without.model.with(r.law), Effort::FULL.towards(r.limit));
                let fit = self.problem.moved(here, &h, r.known.as_ref(), effort)?;
                let convinces = || self.problem.evidence(&r.without, &fit).convinces();
                (fit.cost <= r.limit)
                    .then(convinces)
                    .map(|eligible| (fit, eligible))
            })
            .collect();
        for (fit, eligible) in fits {
            self.keep(fit, eligible);
        }
    }

    /// Tries the set with one more effect, and a law that can do more in the place of each.
    fn grow(&mut self, here: &Set) {
        let Some(node) = self.known.get_mut(here) else {
            return;
        };
        node.grown = true;
        let fit = node.fit.clone();
        if fit.model.effects.len() < MOST_EFFECTS {
            self.add(&fit, None);
        }
        self.enlarge(&fit);
    }

    /// Adds one effect to a fit. `instead` is an effect that is known to bring the cost down to somewhat less than the
    /// number beside it: others that cannot are abandoned, and none is taken up that does not convince beside the rest.
    fn add(&mut self, from: &Fit, instead: Option<&Instead<'_>>) {
        let earlier = |spec| self.earlier.of(from, spec);
        let asked = Asked {
            instead,
            earlier: &earlier,
            savers: self.savers,
            report: self.report,
        };
        let trials = self.problem.additions(from, &asked);
        // Of a round that was broken off, the best may not have been looked at: no effect is named by it.
        if self.problem.stop.wanted() {
            return;
        }
        if let Some(node) = self.known.get_mut(&set(&from.model)) {
            let goal = instead.map_or(f64::INFINITY, |i| i.goal);
            node.followed = Some(node.followed.map_or(goal, |known| known.max(goal)));
        }
        if self.first.is_empty() && instead.is_none() {
            self.first.clone_from(&trials);
        }
        for t in trials {
            let eligible = t.evidence.convinces() && (self.acceptable)(&t);
            self.keep(t.fit, eligible);
        }
    }

    /// Tries others in the place of each effect of a set, and the set again from where they ended.
    fn exchange(&mut self, here: &Set) {
        let fit = self.known[here].fit.clone();
        let goal = fit.cost + self.problem.tolerance(&fit);
        for (spec, smaller) in self.without_each(&fit) {
            self.keep(smaller.clone(), true);
            // Costs that differ by less than what an effect must gain are one goal.
            let least = CRITERIA.effect * self.problem.per_sample(&fit);
            let followed = self.known[&set(&smaller.model)].followed;
            let looked_at = followed.is_some_and(|known| known + least >= goal);
            if !smaller.model.effects.is_empty() && !looked_at {
                let known = &fit;
                self.add(&smaller, Some(&Instead { spec, known, goal }));
            }
            if self.problem.stop.wanted() {
                return;
            }
            // Those that come near with values that can be are fitted from where this set ended.
            let limit = self.near(&fit, &smaller);
            let is_near = |fit: &Fit| fit.cost < limit && possible(&smaller.model, fit);
            let again: Vec<Hypothesis> = self
                .problem
                .addable(&smaller)
                .filter(|c| c.id != spec.id)
                .map(|c| smaller.model.with(c))
                .filter(|h| self.known.get(&set(h)).is_some_and(|n| is_near(&n.fit)))
                .collect();
            let fits: Vec<Fit> = again
                .into_par_iter()
                .flat_map_iter(|h| {
                    let known = self.known.get(&set(&h)).map(|n| &n.fit);
                    let effort = Effort::FULL.towards(goal);
                    let from_here = self.problem.moved(&fit, &h, known, effort);
                    from_here
                        .into_iter()
                        .chain(known.map(|k| self.finished(k, goal)))
                })
                .collect();
            for f in fits {
                let eligible = self.problem.evidence(&smaller, &f).convinces();
                self.keep(f, eligible);
            }
        }
        if let Some(node) = self.known.get_mut(here) {
            node.exchanged = true;
        }
    }

    /// A fit followed to its end, as long as it can come down to `goal`.
    fn finished(&self, fit: &Fit, goal: f64) -> Fit {
        let effort = Effort::FULL.towards(goal);
        self.problem
            .fit(&fit.model, fit.z.clone(), &fit.states, effort)
    }

    /// The set without each of its effects that need not stay: the better of what was known and what is found from
    /// where the set ended.
    fn without_each(&self, here: &Fit) -> Vec<(&'static Spec, Fit)> {
        let effects = here.model.effects.iter().copied();
        let movable: Vec<&'static Spec> = effects.filter(|e| !self.fixed.has(e.id)).collect();
        let is_known = |fit: &Fit| {
            self.known
                .get(&set(&here.model))
                .is_some_and(|n| n.reduced && n.fit.cost == fit.cost)
        };
        if is_known(here) {
            let smaller = |spec: &&'static Spec| {
                let known = self.known.get(&set(&here.model.without(spec.id)))?;
                Some((*spec, known.fit.clone()))
            };
            let all: Option<Vec<_>> = movable.iter().map(smaller).collect();
            if let Some(all) = all {
                return all;
            }
        }
        let effort = Effort::FULL.above(here.cost);
        movable
            .into_par_iter()
            .map(|spec| {
                let fit = self.problem.without(here, spec.id, effort);
                let fit = match self.known.get(&set(&fit.model)) {
                    Some(known) if known.fit.cost <= fit.cost => known.fit.clone(),
                    _ => fit,
                };
                if !self.problem.evidence(&fit, here).convinces() {
                    return (spec, fit);
                }
                let most = self.near(here, &fit);
                let chosen = self.problem.without_chosen(here, spec.id, most);
                (spec, chosen.unwrap_or(fit))
            })
            .collect()
    }

    /// For each effect of a fit, the fit without it and what came near in its place, the nearest first.
    pub(super) fn rivals(&self, here: &Fit) -> Vec<Rival> {
        let goal = here.cost + self.problem.tolerance(here);
        // Of a large rest, many take away as much as a small effect does: only what convinces is like it.
        let explained = self.problem.explains(here);
        self.without_each(here)
            .into_iter()
            .map(|(spec, without)| {
                let mut near: Vec<Trial> = self
                    .problem
                    .addable(&without)
                    .filter(|c| c.id != spec.id)
                    .filter_map(|c| {
                        let fit = &self.known.get(&set(&without.model.with(c)))?.fit;
                        if fit.cost >= goal {
                            return None;
                        }
                        let evidence = self.problem.evidence(&without, fit);
                        (explained || evidence.convinces()).then(|| Trial {
                            spec: c,
                            evidence,
                            fit: fit.clone(),
                        })
                    })
                    .collect();
                near.sort_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost));
                Rival {
                    spec,
                    without,
                    near,
                }
            })
            .collect()
    }
}
