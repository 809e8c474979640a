//! What a predictive controller remembers.

use super::active_set::{Outcome, WorkingSet};
use super::{LIMITED, MOVES, Mpc, PAST};
use crate::real::{Real, command};

/// Memory of an [`Mpc`].
#[derive(Copy, Clone, Debug)]
pub struct MpcState<T, const M: usize = MOVES> {
    pub(super) working: WorkingSet<T, M>,
    pub(super) report: Report,
    /// Commands so far, the last one first, V.
    pub(super) past: [T; PAST],
}

/// How the solver did.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Report {
    /// How the last sample's problem ended.
    pub outcome: Outcome,
    /// Changes of the active limits in the last sample.
    pub changes: usize,
    /// Active limits in the last sample.
    pub active: usize,
    /// Samples so far in which the bound of changes was reached.
    pub bounds: u32,
    /// Samples so far in which there was no solution: a state that is not finite, or numbers beyond reason.
    pub unsound: u32,
}

impl<T: Real, const M: usize> MpcState<T, M> {
    /// As if the command had always been `u` (V).
    pub(super) fn after(u: T) -> Self {
        Self {
            working: WorkingSet::new(),
            report: Report {
                outcome: Outcome::Regulator,
                changes: 0,
                active: 0,
                bounds: 0,
                unsound: 0,
            },
            past: [u; PAST],
        }
    }

    /// Remembers that `u` (V) is commanded from now on: for who solves [`Mpc::problem`] in another way.
    pub fn commanded(&mut self, u: T) {
        self.past.rotate_right(1);
        if let Some(last) = self.past.first_mut() {
            *last = u;
        }
    }

    /// The last command, V.
    pub fn last(&self) -> T {
        self.past.first().copied().unwrap_or(T::ZERO)
    }

    /// How the solver did in the last sample, and how often it had to give up until now.
    pub fn report(&self) -> Report {
        self.report
    }

    /// Scaled moves `w` of the last sample, in V.
    pub fn moves(&self) -> [T; M] {
        self.working.moves()
    }

    /// Multipliers of the last sample's limits, of command, pendulum, arm and the command's rate at each time: above 0
    /// at an upper limit, below 0 at a lower one.
    pub fn multipliers(&self, mpc: &Mpc<T, M>) -> [[T; M]; LIMITED] {
        self.working.all_multipliers(&mpc.rows)
    }
}

impl<T: Real, const M: usize> Mpc<T, M> {
    /// `wanted` (V) as near as the command limit and the last command allow; remembered. 0 where it is not a number.
    pub fn limited(&self, memory: &mut MpcState<T, M>, wanted: T) -> T {
        let mut u = command(wanted, self.command_limit);
        if self.step.value() < f64::INFINITY && !wanted.value().is_nan() {
            let last = memory.last();
            u = u.clamp(last - self.step, last + self.step);
        }
        memory.commanded(u);
        u
    }
}

impl Report {
    pub(super) fn ended(&mut self, outcome: Outcome, changes: usize, active: usize) {
        self.outcome = outcome;
        self.changes = changes;
        self.active = active;
        let count = match outcome {
            Outcome::Bound => &mut self.bounds,
            Outcome::Unsound => &mut self.unsound,
            Outcome::Regulator | Outcome::Solved => return,
        };
        *count = count.saturating_add(1);
    }
}
