//! A part of the windows. Where a model is far from the data nearly everywhere, what is missing is seen in a few
//! seconds of it as well as in all, and a search takes as much less time.

use super::Fit;
use crate::shooting::{Effort, Problem, Window};

/// A fit is far from the data where half of the windows leave more than this many times the noise.
pub(super) const FAR: f64 = 3.0;
/// Windows that are taken together: a drive's twist is carried from one to the next.
const TOGETHER: usize = 4;
/// What lasts gains in a part at least this share of what the part's samples would have of its gain in all windows.
const EVEN: f64 = 0.5;
/// The cost of two fits that differ by D has a standard deviation of 2 sqrt(D), in units of what is left per sample. Of
/// a gain of this size, a fifth is three deviations of itself: what lacks more in the part lacks it in all windows.
const TOLD: f64 = 180.0;

impl<'a> Problem<'a> {
    /// Whether a fit is far from the data in more than half of the windows. A kick is not: the others are near.
    pub(super) fn is_far(&self, fit: &Fit) -> bool {
        let squares = |(w, cost): (&Window, &f64)| cost / self.data.floor(w);
        let mut squares: Vec<f64> = self.windows.iter().zip(&fit.costs).map(squares).collect();
        squares.sort_by(f64::total_cmp);
        squares
            .get(squares.len() / 2)
            .is_some_and(|m| *m > FAR * FAR)
    }

    /// A part in which what `known` gains over `from` shows as it does in all windows; `None` where all are needed.
    pub(super) fn part_showing(&self, from: &Fit, known: &Fit, most: usize) -> Option<Part<'a>> {
        let part = self.part(from, most)?;
        let gain = part.start.cost - part.of(known).cost;
        let share = part.problem.floor() / self.floor();
        let shows = gain > EVEN * share * (from.cost - known.cost);
        (shows && gain > TOLD * self.per_sample(known)).then_some(part)
    }

    /// About `most` windows of every recording's whole length, and the fit to them from where `fit` ended; `None` where
    /// there are no more.
    pub(super) fn part(&self, fit: &Fit, most: usize) -> Option<Part<'a>> {
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
        Some(Part {
            problem,
            start,
            kept,
        })
    }
}

/// A part of a problem.
pub(super) struct Part<'a> {
    pub(super) problem: Problem<'a>,
    /// What was fitted to the whole, fitted to the part.
    pub(super) start: Fit,
    /// Which windows of the whole it has.
    kept: Vec<bool>,
}

impl Part<'_> {
    /// A fit to the whole, seen in the part.
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
