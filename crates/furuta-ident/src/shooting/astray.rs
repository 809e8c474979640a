//! Windows whose initial states went astray: told by what they leave, and solved for again from other starts.

use furuta_model::State;
use rayon::prelude::*;

use super::data::Window;
use super::fit::{Fit, NEAR, Problem};
use super::model::Model;
use super::start::Start;
use super::states::RESCUE;
use super::window::Windows;

/// A window fits far worse than the others where it leaves this many times as much for its samples as they do.
const FAR_WORSE: f64 = 8.0;
/// Near the noise it fits worse where it leaves more than they do by this many standard deviations of what noise alone
/// leaves: some three windows of a thousand that are not astray do.
const DEVIATIONS: f64 = 3.0;
/// At most this share of all windows is looked at: where more fit badly, it is the model that is wrong.
const AT_MOST: f64 = 0.1;
/// A rotor that rested is looked for at the arm's angle and at this many either side, as far as the arm moves, and near
/// the best of them at half their distance, this often: to a 128th of the arm's way.
const TURNED: i32 = 4;
const HALVED: u32 = 5;
/// A window whose cost has changed by this share since it was started again in vain is tried once more.
const MOVED: f64 = 0.1;

impl<M> Fit<M> {
    /// Whether a window was started again in vain at about this cost.
    fn was_in_vain(&self, window: usize) -> bool {
        let cost = self.costs[window];
        (cost - self.in_vain[window]).abs() <= MOVED * cost
    }
}

impl Problem<'_> {
    /// Between two steps of a fit: starts windows that fit far worse than the others again, but for those that were
    /// started in vain.
    pub(super) fn restart_far_worse<M: Model>(&self, fit: &mut Fit<M>) {
        let worse = self.worse(fit, |_, _| FAR_WORSE);
        let worse = worse.into_iter().filter(|i| !fit.was_in_vain(*i)).collect();
        self.restart(fit, worse);
    }

    /// Before a fit ends: starts all windows that fit far worse again, and near the noise those that clearly fit worse.
    pub(super) fn restart_worse<M: Model>(&self, fit: &mut Fit<M>) {
        let clearly = |window: usize| {
            let samples = self.data.floor(&self.windows[window]);
            1.0 + DEVIATIONS * (2.0 / samples).sqrt()
        };
        let worse = self.worse(fit, |median, window| {
            if median < NEAR {
                clearly(window)
            } else {
                FAR_WORSE
            }
        });
        self.restart(fit, worse);
    }

    /// The windows that leave more for their samples than the median window by a factor, which may depend on that
    /// median and on the window.
    fn worse<M>(&self, fit: &Fit<M>, factor: impl Fn(f64, usize) -> f64) -> Vec<usize> {
        let left = self.left_in_windows(fit);
        let mut sorted = left.clone();
        sorted.sort_by(f64::total_cmp);
        let share = |share: f64| sorted.get((sorted.len() as f64 * share) as usize);
        let (Some(median), Some(most)) = (share(0.5), share(1.0 - AT_MOST)) else {
            return Vec::new();
        };
        let is_worse = |i: &usize| left[*i] > (median * factor(*median, *i)).max(*most);
        (0..left.len()).filter(is_worse).collect()
    }

    /// Solves for windows again from other starts: where the window before ends, at rest, and smoothed.
    fn restart<M: Model>(&self, fit: &mut Fit<M>, windows: Vec<usize>) {
        if windows.is_empty() {
            return;
        }
        let solver = Windows::new(&fit.model, &fit.z);
        let again: Vec<(usize, Start, f64)> = (windows.into_par_iter())
            .map(|i| {
                let mut best = (fit.states[i], fit.costs[i]);
                for start in self.other_starts(&solver, fit, i) {
                    let found = solver.solve(self.data, &self.windows[i], &start, RESCUE);
                    if found.1 < best.1 {
                        best = found;
                    }
                }
                if solver.infers_rotor() && self.before(i).is_none() {
                    best = self.turned_against(&solver, &self.windows[i], best);
                }
                (i, best.0, best.1)
            })
            .collect();
        for (i, start, cost) in again {
            if cost == fit.costs[i] {
                fit.in_vain[i] = cost;
            }
            (fit.states[i], fit.costs[i]) = (start, cost);
        }
        fit.add_up(self.floor());
    }

    /// The best start of a window that none comes before, with a rotor that rested before it: friction may hold it
    /// anywhere, as far from the arm as the arm then moves, and nothing else shows where.
    fn turned_against(&self, solver: &Windows, w: &Window, mut best: (Start, f64)) -> (Start, f64) {
        let theta = (self.data.runs[w.run].y[w.start..=w.start + w.len].iter()).map(|y| y[0]);
        let (low, high) = theta.fold((f64::INFINITY, -f64::INFINITY), |(low, high), y| {
            (low.min(y), high.max(y))
        });
        let (mut angle, mut step) = (0.0, (high - low) / f64::from(TURNED));
        for round in 0..=HALVED {
            let most = if round == 0 { TURNED } else { 1 };
            let middle = angle;
            for k in (-most..=most).filter(|k| round == 0 || *k != 0) {
                let turned = middle + f64::from(k) * step;
                let rotor = solver.resting(self.data, w, turned);
                let found = solver.solve(self.data, w, &Start { rotor, ..best.0 }, RESCUE);
                if found.1 < best.1 {
                    (best, angle) = (found, turned);
                }
            }
            step *= 0.5;
        }
        best
    }

    /// Starts that a window may have instead of the one that it has.
    fn other_starts<M>(&self, solver: &Windows, fit: &Fit<M>, window: usize) -> Vec<Start> {
        let Start { x, rotor } = fit.states[window];
        let mut states = Vec::new();
        if let Some(last) = self.before(window) {
            states.push(solver.end(self.data, &self.windows[last], &fit.states[last]));
        }
        let with_arm_at_rest = |x: State<f64>| State::new(x.theta, x.alpha, 0.0, x.alpha_dot);
        states.push(with_arm_at_rest(x));
        for half in [4, 10] {
            let guess = self.data.guess(&self.windows[window], half);
            states.extend([guess, with_arm_at_rest(guess)]);
        }
        states.into_iter().map(|x| Start { x, rotor }).collect()
    }
}

#[cfg(test)]
mod tests {
    use furuta_model::{Effect, Rig, State, Twist};

    use super::*;
    use crate::recording::Recording;
    use crate::shooting::falls::{SECONDS, as_given, falls};
    use crate::shooting::{Data, Effort};

    /// A model without a free number, whose fits take no step, and one window that falls the other way: steps of its
    /// start alone do not turn it.
    #[test]
    fn a_window_that_went_astray_is_solved_for_again() {
        let rig = Rig::builtin("qube-servo-2").expect("built in");
        let data = Data::new(&falls(&rig), &rig);
        let problem = Problem::new(&data, data.windows(SECONDS, |_| true));
        let model = as_given(&rig);
        let z = vec![0.0; model.layout().len()];
        let solved = problem.solve_states(&model, &z, None);
        assert!(
            problem.chi(&solved).powi(2) < 1.5,
            "{}",
            problem.chi(&solved)
        );
        let mut starts = solved.states.clone();
        starts[3].x.alpha = -starts[3].x.alpha;
        let fit = problem.fit(&model, z, &starts, Effort::FULL);
        assert!(
            fit.cost < 1.01 * solved.cost,
            "{} where {} is the best: {:?}",
            fit.cost,
            solved.cost,
            fit.costs
        );
    }

    /// A rotor that friction holds, turned against the arm by what no encoder shows, while the arm swings on the spring
    /// between them.
    #[test]
    fn a_rotor_that_rests_turned_against_the_arm_is_found() {
        let mut rig = Rig::builtin("qube-servo-2").expect("built in");
        let effect = |id: &str, values: &[f64]| Effect::new(id, values).expect("valid");
        rig.effects = vec![
            effect("drive.compliance", &[0.1, 1e-4, 0.4, 0.0]),
            effect("arm.coulomb", &[0.02]),
        ];
        let plant = rig.plant::<f64>();
        let mut s = plant.rest(State::new(0.0, 1.8, 0.0, 0.0));
        let angle = 0.1;
        plant.set_twist(&mut s, Twist { angle, speed: 0.0 });
        let samples = (0..1500).map(|k| {
            let [theta, alpha] = rig.sensors.quantised(plant.measure(&s));
            plant.step(&mut s, 0.0, 0.002);
            [0.002 * f64::from(k), 0.0, theta, alpha]
        });
        let (recording, _) = Recording::from_samples("let go", samples).expect("a recording");
        let data = Data::new(&[recording], &rig);
        let problem = Problem::new(&data, data.windows(0.25, |_| true));
        let model = as_given(&rig);
        let z = vec![0.0; model.layout().len()];
        let unknown = problem.solve_states(&model, &z, None);
        let (w, begun) = (&problem.windows[0], (unknown.states[0], unknown.costs[0]));
        let solver = Windows::new(&model, &z);
        let (_, cost) = problem.turned_against(&solver, w, begun);
        // What the noise leaves, and what angles a 128th of the arm's way apart may add.
        let floor = problem.data.floor(w);
        assert!(
            begun.1 > 10.0 * floor && cost < 2.0 * floor,
            "{} {cost} {floor}",
            begun.1
        );
    }
}
