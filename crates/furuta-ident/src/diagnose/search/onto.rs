//! How a search over a subset of the windows goes on with all of them.

use rayon::prelude::*;

use super::super::Fit;
use super::super::evidence::possible;
use super::super::hypothesis::Hypothesis;
use super::searched::{Set, set};
use super::{Node, Search};
use crate::shooting::{Effort, Problem};

impl<'a> Search<'a> {
    /// The search over a subset of the windows goes on with all of them: the best set, and what came near it with
    /// values that can be in the place of one of its effects, are fitted again, and what no fit moves is placed again.
    /// Where even the best is still far from the data, the rest of the windows says no more.
    pub(in super::super) fn onto(self, problem: &'a Problem<'a>, start: Fit) -> Self {
        let ended = self.is_through();
        let best = set(&self.closest().model);
        let fitted = |fit: &Fit, effort: Effort| problem.transferred(&start, fit, effort);
        let closest = match best == set(&self.fixed) {
            true => start.clone(),
            false => fitted(&self.known[&best].fit, Effort::FULL),
        };
        // Where with the best nothing is left, what comes as near is looked for.
        let effort = match problem.explains(&closest) {
            true => Effort::FULL.towards(closest.cost + problem.tolerance(&closest)),
            false => Effort::FULL,
        };
        let mut again: Vec<(Set, Node)> = (self.beside_best().into_par_iter())
            .map(|(s, node)| (s, node.over(fitted(&node.fit, effort))))
            .collect();
        again.push((best.clone(), self.known[&best].over(closest)));
        let over_subset = Some(self.so_far());
        let mut search = Self::new(problem, start, self.acceptable, self.savers, self.report);
        search.first = self.first;
        search.over_subset = over_subset;
        search.known.extend(again);
        if problem.is_far(&search.closest()) || problem.stop.wanted() {
            search.left = if ended { 0 } else { search.left };
        } else {
            for node in search.known.values_mut() {
                (node.grown, node.exchanged, node.followed) = (false, false, None);
            }
        }
        search
    }

    /// The sets that are near the best one, with another effect in the place of one of its own.
    fn beside_best(&self) -> Vec<(Set, &Node)> {
        let best = self.closest();
        let here = set(&best.model);
        let limits: Vec<(&Hypothesis, f64)> = (best.model.effects.iter())
            .filter_map(|e| self.known.get(&set(&best.model.without(e.id))))
            .map(|node| (&node.fit.model, self.near(&best, &node.fit)))
            .collect();
        let is_near = |fit: &Fit| {
            let beside = |smaller: &Hypothesis| smaller.effects.iter().all(|e| fit.model.has(e.id));
            limits.iter().any(|(smaller, limit)| {
                fit.cost < *limit && beside(smaller) && possible(smaller, fit)
            })
        };
        (self.known.iter())
            .filter(|(s, node)| **s != here && s.len() == here.len() && is_near(&node.fit))
            .map(|(s, node)| (s.clone(), node))
            .collect()
    }
}
