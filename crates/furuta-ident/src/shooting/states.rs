//! The windows' initial states: solved for at given parameters, and followed through a step of them; and what a window
//! says about the start of the next where a drive gives way.

use nalgebra::DVector;
use rayon::prelude::*;

use super::eliminate::Reduced;
use super::fit::{FOLLOWING, Fit, Problem};
use super::model::Model;
use super::slopes::Along;
use super::start::{Rotor, Start};
use super::window::Windows;

/// A step that throws more than this share of the windows far off is a bad step: its windows are not looked after one
/// by one.
const THROWN_OFF: f64 = 0.2;
/// Steps with which a window that was thrown off is tried again.
pub(super) const RESCUE: usize = 5;

/// A flexible coupling that takes more steps of the integrator a sample than this, four a radian, rings (or creeps)
/// faster than half the sampling rate. It shows no more than a rigid one, and a fit that has no use for a coupling
/// would make it stiffer and stiffer, and every simulation longer.
const MOST_STEPS: usize = 13;

impl Problem<'_> {
    /// Solves for the initial states alone, the parameters held.
    pub(crate) fn solve_states<M: Model>(
        &self,
        model: &M,
        z: &[f64],
        known: Option<&[Start]>,
    ) -> Fit<M> {
        let windows = Windows::new(model, z);
        let (states, costs): (Vec<_>, Vec<_>) = self
            .windows
            .par_iter()
            .enumerate()
            .map(|(i, w)| windows.search(self.data, w, known.map(|k| &k[i])))
            .unzip();
        let mut fit = Fit {
            model: model.clone(),
            z: z.to_vec(),
            in_vain: vec![f64::INFINITY; states.len()],
            states,
            costs,
            priors: Vec::new(),
            cost: 0.0,
            widened: 1.0,
            std: vec![f64::NAN; z.len()],
            std_by_itself: vec![f64::NAN; z.len()],
            past: vec![0.0; z.len()],
        };
        if windows.infers_rotor() {
            self.solve_states_behind(&windows, &mut fit);
        }
        fit.add_up(self.floor());
        fit
    }

    /// The windows' starts for a fit of another model from where this one ended, each such that the encoders read the
    /// same there: an offset of a reading beside zeros that follow it moves the angles that states are counted in.
    pub(crate) fn read_alike<M: Model>(&self, here: &Fit<M>, to: &M, z: &[f64]) -> Vec<Start> {
        let before = Windows::new(&here.model, &here.z);
        let after = Windows::new(to, z);
        (self.windows.iter().zip(&here.states))
            .map(|(w, start)| {
                let read = before.reading(self.data, w, &start.x);
                Start {
                    x: after.where_read(self.data, w, &start.x, read),
                    ..*start
                }
            })
            .collect()
    }

    /// Solves for the initial states again with what the windows before say, where that is better: a window that went
    /// astray misleads the next.
    fn solve_states_behind<M>(&self, windows: &Windows, fit: &mut Fit<M>) {
        let mut led = fit.states.clone();
        self.lead_in(windows, &mut led);
        let again: Vec<(Start, f64)> = self
            .windows
            .par_iter()
            .zip(&led)
            .map(|(w, start)| windows.search(self.data, w, Some(start)))
            .collect();
        for (i, (start, cost)) in again.into_iter().enumerate() {
            if cost < fit.costs[i] {
                (fit.states[i], fit.costs[i]) = (start, cost);
            }
        }
    }

    /// Sets every window to where a fit enters it, for [`Self::refine`]; nothing, and an infinite cost, where a
    /// coupling is stiffer than samples follow.
    pub(super) fn entered<M: Model>(&self, f: &mut Fit<M>) -> Option<Windows> {
        let windows = Windows::new(&f.model, &f.z);
        let plant = &windows.plain().plant;
        let period = self.data.runs.first().map_or(0.0, |r| r.h);
        if plant.has_drive() && plant.substeps(period) > MOST_STEPS {
            f.costs = vec![f64::INFINITY; f.states.len()];
            f.add_up(self.floor());
            return None;
        }
        self.lead_in(&windows, &mut f.states);
        Some(windows)
    }

    /// Brings every window's initial state to its optimum, by the slopes in `r` where these lead to it; what each
    /// window says there by them.
    pub(super) fn refine<M: Model>(
        &self,
        f: &mut Fit<M>,
        windows: &Windows,
        r: &Reduced,
    ) -> Vec<Option<Along>> {
        let (refined, along): (Vec<(Start, f64)>, Vec<Option<Along>>) = (self.windows.par_iter())
            .zip(&f.states)
            .zip(&r.windows)
            .map(|((w, start), response)| {
                let followed = match response.linear() {
                    Some(linear) => Along::solved(windows.plain(), self.data, w, start, linear),
                    None => Err(*start),
                };
                match followed {
                    Ok(along) => ((along.start, along.cost), Some(along)),
                    Err(start) => (windows.solve(self.data, w, &start, FOLLOWING), None),
                }
            })
            .unzip();
        (f.states, f.costs) = refined.into_iter().unzip();
        f.add_up(self.floor());
        along
    }

    /// Where a drive gives way: tells each window how the one before says that the rig stood. Those that none comes
    /// before stay as they are.
    fn lead_in(&self, windows: &Windows, states: &mut [Start]) {
        if !windows.infers_rotor() {
            return;
        }
        let led: Vec<Rotor> = (0..states.len())
            .into_par_iter()
            .map(|i| match self.before(i) {
                Some(last) => {
                    let from = (&self.windows[last], &states[last]);
                    windows.before(self.data, from, &self.windows[i])
                }
                None => states[i].rotor,
            })
            .collect();
        for (state, rotor) in states.iter_mut().zip(led) {
            state.rotor = rotor;
        }
    }

    /// The window that ends where the `i`-th begins.
    pub(super) fn before(&self, i: usize) -> Option<usize> {
        let last = i.checked_sub(1)?;
        let (previous, w) = (&self.windows[last], &self.windows[i]);
        (previous.run == w.run && previous.start + previous.len == w.start).then_some(last)
    }

    /// Where the step leads, the initial states following; what each window says there by its slopes in `r`.
    pub(super) fn follow<M: Model>(
        &self,
        here: &Fit<M>,
        r: &Reduced,
        step: &DVector<f64>,
    ) -> (Fit<M>, Vec<Option<Along>>) {
        let layout = here.model.layout();
        let mut trial = here.clone();
        trial.z = here.z.iter().zip(step.iter()).map(|(z, s)| z - s).collect();
        for ((x, w), response) in trial.states.iter_mut().zip(&self.windows).zip(&r.windows) {
            *x = response.follow(x, &layout, self.data.runs[w.run].recording, step);
        }
        let moved = trial.states.clone();
        let Some(windows) = self.entered(&mut trial) else {
            return (trial, Vec::new());
        };
        let along = self.refine(&mut trial, &windows, r);
        if !trial.cost.is_finite() {
            return (trial, along);
        }
        // A window that the step threw far off is tried from where it was as well.
        let off: Vec<usize> = (0..moved.len())
            .filter(|&i| trial.costs[i] > 2.0 * here.costs[i] + 20.0 && moved[i] != here.states[i])
            .collect();
        if off.len() as f64 <= THROWN_OFF * moved.len() as f64 {
            let again: Vec<(Start, f64)> = off
                .par_iter()
                .map(|&i| windows.solve(self.data, &self.windows[i], &here.states[i], RESCUE))
                .collect();
            for (i, (state, cost)) in off.into_iter().zip(again) {
                if cost < trial.costs[i] {
                    trial.states[i] = state;
                    trial.costs[i] = cost;
                }
            }
        }
        trial.add_up(self.floor());
        (trial, along)
    }
}
