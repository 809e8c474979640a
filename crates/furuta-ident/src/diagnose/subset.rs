//! A subset of the windows. Where a model is far from the data nearly everywhere, what is missing is seen in a few
//! seconds of it as well as in all, and a search takes as much less time.

use super::Fit;
use crate::shooting::{Effort, Problem, Window};

/// Windows that are taken together: a drive's twist is carried from one to the next.
const TOGETHER: usize = 4;
/// What lasts gains in a subset at least this share of what its samples would have of its gain in all windows.
const EVEN: f64 = 0.5;
/// The cost of two fits that differ by D has a standard deviation of 2 sqrt(D), in units of what is left per sample. Of
/// a gain of this size, a fifth is three deviations of itself: what lacks more in the subset lacks it in all windows.
const TOLD: f64 = 180.0;

impl<'a> Problem<'a> {
    /// A subset in which what `known` gains over `from` shows as it does in all windows; `None` where all are needed.
    pub(super) fn subset_showing(
        &self,
        from: &Fit,
        known: &Fit,
        most: usize,
    ) -> Option<Subset<'a>> {
        let subset = self.subset(from, most)?;
        let gain = subset.start.cost - subset.of(known).cost;
        let share = subset.problem.floor() / self.floor();
        let shows = gain > EVEN * share * (from.cost - known.cost);
        (shows && gain > TOLD * self.per_sample(known)).then_some(subset)
    }

    /// About `most` windows of every recording's whole length, and the fit to them from where `fit` ended; `None` where
    /// there are no more.
    pub(super) fn subset(&self, fit: &Fit, most: usize) -> Option<Subset<'a>> {
        let every = self.windows.len() / most;
        if every < 2 {
            return None;
        }
        let blocks = |w: &Window| w.start / (w.len * TOGETHER);
        let last = |run: usize| {
            let of_run = self.windows.iter().filter(|w| w.run == run);
            of_run.map(blocks).max().unwrap_or(0)
        };
        let is_kept = |w: &Window| blocks(w) % every == (every / 2).min(last(w.run));
        let kept: Vec<bool> = self.windows.iter().map(is_kept).collect();
        let windows = only(&kept, &self.windows).copied().collect();
        let states: Vec<_> = only(&kept, &fit.states).copied().collect();
        let problem = Problem::new(self.data, windows).until(self.stop);
        let start = problem.fit(&fit.model, fit.z.clone(), &states, Effort::FULL);
        Some(Subset {
            problem,
            start,
            kept,
        })
    }
}

/// A subset of a problem's windows.
pub(super) struct Subset<'a> {
    pub(super) problem: Problem<'a>,
    /// What was fitted to the whole, fitted to the subset.
    pub(super) start: Fit,
    /// Which windows of the whole it has.
    kept: Vec<bool>,
}

impl Subset<'_> {
    /// A fit to the whole, seen in the subset.
    pub(super) fn of(&self, fit: &Fit) -> Fit {
        fit.in_windows(&self.kept)
    }
}

/// The elements that are kept.
fn only<'a, T>(kept: &'a [bool], all: &'a [T]) -> impl Iterator<Item = &'a T> {
    all.iter()
        .zip(kept)
        .filter(|(_, kept)| **kept)
        .map(|(x, _)| x)
}
