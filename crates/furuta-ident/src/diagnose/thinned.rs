//! A part of the windows. Where a model is far from the data nearly everywhere, what is missing is seen in a few
//! seconds of it as well as in all, and a search takes as much less time.

use super::Fit;
use crate::shooting::{Effort, Problem, Window};

/// A fit is far from the data where half of the windows leave more than this many times the noise.
pub(super) const FAR: f64 = 3.0;
/// Windows that are taken together: a drive's twist is carried from one to the next.
const TOGETHER: usize = 4;

impl<'a> Problem<'a> {
    /// Whether a fit is far from the data in more than half of the windows. A kick is not: the others are near.
    pub(super) fn is_far(&self, fit: &Fit) -> bool {
        let floor = |w: &Window| (self.data.samples(w) - self.data.initial(w)).max(1.0);
        let squares = |(w, cost): (&Window, &f64)| cost / floor(w);
        let mut squares: Vec<f64> = self.windows.iter().zip(&fit.costs).map(squares).collect();
        squares.sort_by(f64::total_cmp);
        squares
            .get(squares.len() / 2)
            .is_some_and(|m| *m > FAR * FAR)
    }

    /// The problem with about `most` windows of every recording's whole length, and the fit to them from where `fit`
    /// ended; `None` where it has no more, or where all may be needed.
    pub(super) fn thinned(&self, fit: &Fit, most: usize) -> Option<(Problem<'a>, Fit)> {
        let every = self.windows.len() / most;
        if every < 2 || !self.is_far(fit) {
            return None;
        }
        let blocks = |w: &Window| w.start / (w.len * TOGETHER);
        let last = |run: usize| {
            let of_run = self.windows.iter().filter(|w| w.run == run);
            of_run.map(blocks).max().unwrap_or(0)
        };
        let is_kept = |w: &Window| blocks(w) % every == (every / 2).min(last(w.run));
        let (windows, states) = (self.windows.iter().zip(&fit.states))
            .filter(|(w, _)| is_kept(w))
            .map(|(w, x)| (*w, *x))
            .unzip::<_, _, Vec<_>, Vec<_>>();
        let part = Problem::new(self.data, windows).until(self.stop);
        let fit = part.fit(&fit.model, fit.z.clone(), &states, Effort::FULL);
        Some((part, fit))
    }
}
