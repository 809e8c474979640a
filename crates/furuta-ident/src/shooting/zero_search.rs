//! Where the encoders' zeros of a recording are, everything else held.
//!
//! What repeats with the arm's angle (a tilt, a motor's cogging, an encoder's eccentric disc) is alike at several
//! angles: the cost has a valley beside each, and a fit ends in the one where it began. Places all around the turn are
//! tried, recording by recording.

use std::f64::consts::{PI, TAU};

use furuta_model::Jet;
use rayon::prelude::*;

use super::data::{Data, Window};
use super::fit::{Effort, FOLLOWING, Fit, Problem};
use super::model::{Layout, Model, Observed, Pass, Prior};
use super::window::Windows;
use super::zeros::UNIT;

/// Places that are tried in a turn: a valley is half a period wide, and what repeats up to twelve times in a turn has a
/// place in each of its valleys.
const PLACES: usize = 24;
/// Windows of a recording that say which place is its own.
const TELLING: usize = 12;

/// The `k`-th of them, rad.
fn place(k: usize) -> f64 {
    TAU * k as f64 / PLACES as f64 - PI
}

/// A plant of which nothing but the zeros of the recordings is free.
#[derive(Clone)]
struct OnlyZeros {
    seen: Observed<f64>,
    layout: Layout,
    bounds: Vec<(f64, f64)>,
    priors: Vec<Option<Prior>>,
}

impl OnlyZeros {
    fn of<M: Model>(model: &M, z: &[f64]) -> Self {
        let layout = model.layout();
        Self {
            seen: model.observed::<4>(z, Pass::FIRST).plain(),
            layout: Layout {
                shared: 0,
                lead: 0,
                ..layout
            },
            bounds: model.bounds(z).split_off(layout.shared),
            priors: model.priors().split_off(layout.shared),
        }
    }

    /// The recordings whose zero of theta is free.
    fn open(&self) -> impl Iterator<Item = usize> {
        let is_open = |r: &usize| {
            let (low, high) = self.bounds[self.layout.zero(*r, 0)];
            low < high
        };
        let recordings = if self.layout.zeros > 0 {
            self.layout.recordings
        } else {
            0
        };
        (0..recordings).filter(is_open)
    }
}

impl Model for OnlyZeros {
    fn layout(&self) -> Layout {
        self.layout
    }

    fn observed<const N: usize>(&self, z: &[f64], pass: Pass) -> Observed<Jet<f64, N>> {
        let mut seen = self.seen.cast();
        seen.free_zeros(&self.layout, z, pass);
        seen
    }

    fn bounds(&self, _: &[f64]) -> Vec<(f64, f64)> {
        self.bounds.clone()
    }

    fn priors(&self) -> Vec<Option<Prior>> {
        self.priors.clone()
    }
}

/// Of two places, the one where a fit ended stays unless the other leaves less by this share.
const LESS: f64 = 1e-2;

impl Problem<'_> {
    /// A fit in the valley that suits each recording best, everything fitted from there; `None` where that is no
    /// better. In the first recording, from whose zero angles are counted, it is the number at `phase` that is looked
    /// for: where and in which unit (rad) an effect says at what angle it acts.
    pub(crate) fn turned<M: Model>(
        &self,
        fit: &Fit<M>,
        phase: Option<(usize, f64)>,
        effort: Effort,
    ) -> Option<Fit<M>> {
        let shared = fit.model.layout().shared;
        let kept = self.telling();
        let windows = (0..kept.len()).filter(|&i| kept[i]);
        let few = Problem::new(self.data, windows.map(|i| self.windows[i]).collect());
        let few = few.until(self.stop);
        let here = fit.in_windows(&kept);
        let zeros_at = |z: &[f64]| {
            let only = OnlyZeros::of(&fit.model, z);
            let here = few.solve_states(&only, &z[shared..], Some(&here.states));
            few.around_the_turn(&here)
        };
        let moved = |z: &[f64], zeros: Vec<f64>| [&z[..shared], &zeros].concat();
        let beside = zeros_at(&fit.z).map(|zeros| moved(&fit.z, zeros));
        let other = phase.and_then(|phase| few.at_another_phase(&here, phase));
        let other = other.map(|z| match zeros_at(&z) {
            Some(zeros) => moved(&z, zeros),
            None => z,
        });
        let starts = beside.into_iter().chain(other);
        let fits = starts.map(|z| self.fit(&fit.model, z, &fit.states, effort));
        let best = fits.min_by(|a, b| a.cost.total_cmp(&b.cost))?;
        (best.cost < fit.cost).then_some(best)
    }

    /// The vector with the number at `phase` where it suits the first recording best, if that is better than here.
    fn at_another_phase<M: Model>(
        &self,
        here: &Fit<M>,
        (phase, unit): (usize, f64),
    ) -> Option<Vec<f64>> {
        let at = |place: f64| {
            let mut z = here.z.clone();
            z[phase] = place / unit;
            z
        };
        let first = |z: &[f64]| self.solved_again(&here.model, z, here)[0];
        let tried: Vec<f64> = (0..PLACES)
            .into_par_iter()
            .map(|k| first(&at(place(k))))
            .collect();
        let best = (0..PLACES).min_by(|a, b| tried[*a].total_cmp(&tried[*b]))?;
        (tried[best] < (1.0 - LESS) * first(&here.z)).then(|| at(place(best)))
    }

    /// The vector with the zeros that suit all windows, everything else held.
    pub(crate) fn with_zeros<M: Model>(&self, model: &M, z: &[f64]) -> Vec<f64> {
        let layout = model.layout();
        if layout.zeros == 0 {
            return z.to_vec();
        }
        let (only, (shared, zeros)) = (OnlyZeros::of(model, z), z.split_at(layout.shared));
        let solved = self.solve_states(&only, zeros, None);
        let found = self.fit(&only, solved.z, &solved.states, Effort::FULL);
        let zeros = self.around_the_turn(&found).unwrap_or(found.z);
        [shared, &zeros].concat()
    }

    /// What each recording costs with other numbers, the initial states following from those of a fit.
    fn solved_again<M: Model>(&self, model: &M, z: &[f64], from: &Fit<M>) -> Vec<f64> {
        let windows = Windows::new(model, z);
        let starts = self.windows.iter().zip(&from.states);
        let costs = starts.map(|(w, x)| windows.solve(self.data, w, x, FOLLOWING).1);
        self.by_recording(costs)
    }

    /// Which windows say where in the turn the zero of their recording is: some of each, over its whole length.
    fn telling(&self) -> Vec<bool> {
        let recording = |w: &Window| self.data.runs[w.run].recording;
        let mut all = vec![0; self.data.recordings];
        for w in &self.windows {
            all[recording(w)] += 1;
        }
        let mut seen = vec![0; self.data.recordings];
        // Evenly: each adds its share of what is wanted, and a whole one is kept.
        let is_kept = |w: &Window| {
            let (seen, all) = (&mut seen[recording(w)], all[recording(w)]);
            *seen += TELLING.min(all);
            let kept = *seen >= all;
            *seen -= if kept { all } else { 0 };
            kept
        };
        self.windows.iter().map(is_kept).collect()
    }

    /// The zeros with theta's in the valley that suits its recording best; `None` where each is in it.
    fn around_the_turn(&self, here: &Fit<OnlyZeros>) -> Option<Vec<f64>> {
        let (only, layout) = (&here.model, here.model.layout);
        only.open().next()?;
        let tried: Vec<Vec<f64>> = (0..PLACES)
            .into_par_iter()
            .map(|k| {
                let mut z = here.z.clone();
                only.open()
                    .for_each(|r| z[layout.zero(r, 0)] = place(k) / UNIT[0]);
                self.solved_again(only, &z, here)
            })
            .collect();
        let mut z = here.z.clone();
        for r in only.open() {
            let best = (0..PLACES).min_by(|a, b| tried[*a][r].total_cmp(&tried[*b][r]));
            z[layout.zero(r, 0)] = place(best?) / UNIT[0];
        }
        let there = self.fit(only, z, &here.states, Effort::FULL);
        let by = |fit: &Fit<OnlyZeros>| self.by_recording(fit.costs.iter().copied());
        let (before, after) = (by(here), by(&there));
        let mut zeros = here.z.clone();
        let mut moved = false;
        for r in only.open().filter(|&r| after[r] < (1.0 - LESS) * before[r]) {
            let own = layout.zero(r, 0)..layout.zero(r, layout.zeros);
            zeros[own.clone()].copy_from_slice(&there.z[own]);
            moved = true;
        }
        moved.then_some(zeros)
    }

    /// Costs of the windows, added up for each recording.
    fn by_recording(&self, costs: impl Iterator<Item = f64>) -> Vec<f64> {
        let mut sums = vec![0.0; self.data.recordings];
        for (w, cost) in self.windows.iter().zip(costs) {
            sums[self.data.runs[w.run].recording] += cost;
        }
        sums
    }
}

/// Zeros are found in the first part of a recording of this length, s, over windows of the second.
const FIRST: f64 = 3.0;
const WINDOW: f64 = 0.5;

/// The vector with the zeros that suit the first seconds of each recording, everything else held.
pub(crate) fn with_zeros_found<M: Model>(data: &Data, model: &M, z: &[f64]) -> Vec<f64> {
    let early = |w: &Window| (w.start as f64) * data.runs[w.run].h < FIRST;
    let mut windows = data.windows(WINDOW, |_| true);
    windows.retain(early);
    Problem::new(data, windows).with_zeros(model, z)
}
