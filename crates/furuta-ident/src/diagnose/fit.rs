//! Levenberg-Marquardt on the parameters, with every window's initial state solved for at each trial.

use furuta_model::effects::Acts;
use furuta_model::{Spec, State};
use nalgebra::DVector;
use rayon::prelude::*;

use super::data::{Data, Window};
use super::hypothesis::{Hypothesis, Nominal};
use super::shooting::{Inner, Reduced, reduced};
use super::stop::Stop;

/// What is being fitted to what.
pub(super) struct Problem<'a> {
    pub(super) data: &'a Data,
    pub(super) nominal: &'a Nominal,
    pub(super) windows: Vec<Window>,
    /// When it is wanted, fits end where they are and searches claim nothing further.
    pub(super) stop: Stop<'a>,
}

/// A fitted hypothesis.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    pub(super) hypothesis: Hypothesis,
    /// Parameters in units of [`Hypothesis::scales`].
    pub(super) z: Vec<f64>,
    /// Initial state of each window.
    pub(super) states: Vec<State<f64>>,
    /// Cost of each window.
    pub(super) costs: Vec<f64>,
    /// Sum of the windows' costs: squared residuals in units of the noise.
    pub(super) cost: f64,
    /// Standard deviations of `z`, robust against errors that are correlated within a window.
    pub(super) std: Vec<f64>,
}

impl Fit {
    /// The hypothesis without `spec`, and the parameters of what is left.
    pub(super) fn without(&self, spec: &Spec) -> (Hypothesis, Vec<f64>) {
        let h = &self.hypothesis;
        let mut z = self.z.clone();
        if let Some(i) = h.effects.iter().position(|e| e.id == spec.id) {
            let offset = h.offset(i);
            z.drain(offset..offset + spec.parameters.len());
        }
        (h.without(spec.id), z)
    }
}

/// How long a fit may go on.
#[derive(Copy, Clone, Debug)]
pub(super) struct Effort {
    pub(super) iterations: usize,
    /// Stop when a step gains less than this share of the cost.
    pub(super) tolerance: f64,
    /// Give up when the cost is not going to come down to this.
    pub(super) bar: f64,
    /// Stop when a step gains less than [`FINE`] of what the cost is above this.
    pub(super) reference: f64,
}

/// To so much of itself a difference of two fits is known well enough.
const FINE: f64 = 1e-2;

impl Effort {
    pub(super) const QUICK: Self = Self {
        iterations: 8,
        tolerance: 1e-2,
        bar: f64::INFINITY,
        reference: f64::INFINITY,
    };
    /// As [`Self::FULL`], cut short where a fit creeps along a valley, as two effects do that stand for one.
    pub(super) const TRIAL: Self = Self {
        iterations: 20,
        ..Self::FULL
    };
    pub(super) const FULL: Self = Self {
        iterations: 40,
        tolerance: 1e-4,
        bar: f64::INFINITY,
        reference: f64::INFINITY,
    };

    /// The same, ended when what the cost is above `reference` is known to some hundredths.
    pub(super) const fn above(self, reference: f64) -> Self {
        Self { reference, ..self }
    }

    /// The same, given up when the cost cannot come down to `bar`.
    pub(super) const fn towards(self, bar: f64) -> Self {
        Self { bar, ..self }
    }
}

/// What is still missing after a step may be so many times what the step has gained: at first, and less and less with each so many steps.
const HOPE: f64 = 8.0;
const HOPE_LASTS: usize = 5;
/// Far from the noise the first steps may gain little: so many are made before a fit is given up. A chi² per sample of less is not far.
const PATIENCE: usize = 3;
const NEAR: f64 = 2.0;
/// A step that throws more than this share of the windows far off is a bad step: nobody looks after them one by one.
const THROWN_OFF: f64 = 0.2;

/// A flexible coupling that takes more steps of the integrator a sample than this rings, or creeps, faster than samples follow. It shows no more than a
/// rigid one, and a fit that has no use for a coupling would make it stiffer and stiffer, and every simulation longer.
const MOST_STEPS: usize = 24;

impl<'a> Problem<'a> {
    pub(super) fn new(data: &'a Data, nominal: &'a Nominal, windows: Vec<Window>) -> Self {
        Self {
            data,
            nominal,
            windows,
            stop: Stop::NEVER,
        }
    }

    /// The same problem, to be given up when `stop` says so.
    pub(super) fn until(self, stop: Stop<'a>) -> Self {
        Self { stop, ..self }
    }

    /// Sum of the weights of all samples: the cost that noise alone leaves, but for the degrees of freedom.
    pub(super) fn samples(&self) -> f64 {
        self.windows.iter().map(|w| self.window_samples(w)).sum()
    }

    /// The same for one window.
    pub(super) fn window_samples(&self, w: &Window) -> f64 {
        let run = &self.data.runs[w.run];
        run.weight[w.start + 1..=w.start + w.len]
            .iter()
            .map(|w| w[0] * w[0] + w[1] * w[1])
            .sum()
    }

    /// Solves for the initial states alone, the parameters held.
    pub(super) fn settle(&self, h: &Hypothesis, z: &[f64], known: Option<&[State<f64>]>) -> Fit {
        let inner = Inner::<4>::new(h, z, self.nominal);
        let (states, costs): (Vec<_>, Vec<_>) = self
            .windows
            .par_iter()
            .enumerate()
            .map(|(i, w)| inner.search(self.data, w, known.map(|k| k[i])))
            .unzip();
        Fit {
            hypothesis: h.clone(),
            z: z.to_vec(),
            cost: costs.iter().sum(),
            states,
            costs,
            std: vec![f64::NAN; z.len()],
        }
    }

    /// The model as given, and with its parameters refitted.
    pub(super) fn recalibrated(&self) -> (Fit, Fit) {
        let h = Hypothesis::base();
        let given = self.settle(&h, &vec![0.0; h.len()], None);
        let refitted = self.fit(&h, given.z.clone(), &given.states, Effort::FULL);
        (given, refitted)
    }

    /// Fits `h` from the parameters and states given.
    pub(super) fn fit(
        &self,
        h: &Hypothesis,
        z: Vec<f64>,
        states: &[State<f64>],
        effort: Effort,
    ) -> Fit {
        let bounds = h.bounds(self.nominal, &z);
        let z = z
            .iter()
            .zip(&bounds)
            .map(|(z, (low, high))| z.clamp(*low, *high))
            .collect::<Vec<_>>();
        let mut here = Fit {
            hypothesis: h.clone(),
            states: states.to_vec(),
            costs: Vec::new(),
            cost: 0.0,
            std: vec![f64::NAN; z.len()],
            z,
        };
        self.polish(&mut here, 2);
        if !here.cost.is_finite() {
            return here;
        }
        let mut damping = 1e-3;
        let mut r = self.linearise(&here);
        for iteration in 0..effort.iterations {
            if self.stop.wanted() {
                break;
            }
            let Some(step) = bounded_step(&here.z, &r, &bounds, damping) else {
                break;
            };
            let predicted = 2.0 * r.gradient.dot(&step) - (&r.matrix * &step).dot(&step);
            let hope = HOPE / (1 + iteration / HOPE_LASTS) as f64;
            let may_end = iteration >= PATIENCE || here.cost < NEAR * self.floor();
            if may_end && here.cost - effort.bar > hope * predicted.max(0.0) {
                break;
            }
            let trial = self.trial(&here, &r, &step);
            if trial.cost < here.cost {
                let before = here.cost;
                let gain = here.cost - trial.cost;
                let small = gain < effort.tolerance * trial.cost
                    || gain < FINE * (trial.cost - effort.reference);
                here = trial;
                self.restart(&mut here);
                if may_end && here.cost - effort.bar > hope * (before - here.cost) {
                    break;
                }
                damping = (damping * 0.2_f64).max(1e-8);
                r = self.linearise(&here);
                if small {
                    break;
                }
            } else {
                if predicted.abs() < 1e-5 * here.cost {
                    break;
                }
                damping = (damping * 8.0).max(1e-4);
                if damping > 1e4 {
                    break;
                }
            }
        }
        here.std = self.deviations(&here, &r, &bounds);
        here
    }

    pub(super) fn linearise(&self, f: &Fit) -> Reduced {
        reduced(
            &f.hypothesis,
            &f.z,
            self.nominal,
            self.data,
            &self.windows,
            &f.states,
        )
    }

    /// Brings every window's initial state to its optimum; the cost is infinite where a coupling is stiffer than samples follow.
    fn polish(&self, f: &mut Fit, iterations: usize) {
        let inner = Inner::<4>::new(&f.hypothesis, &f.z, self.nominal);
        let drives = |e: &&Spec| e.acts.includes(Acts::DRIVE);
        if f.hypothesis.effects.iter().any(drives)
            && inner.plain().substeps(self.nominal.period) > MOST_STEPS
        {
            f.costs = vec![f64::INFINITY; f.states.len()];
            f.cost = f64::INFINITY;
            return;
        }
        (f.states, f.costs) = self
            .windows
            .par_iter()
            .zip(&f.states)
            .map(|(w, x)| inner.solve(self.data, w, *x, iterations))
            .unzip();
        f.cost = f.costs.iter().sum();
    }

    /// Where the step leads, the initial states following.
    fn trial(&self, here: &Fit, r: &Reduced, step: &DVector<f64>) -> Fit {
        let mut trial = here.clone();
        trial.z = here.z.iter().zip(step.iter()).map(|(z, s)| z - s).collect();
        for (x, (response, own)) in trial.states.iter_mut().zip(&r.response) {
            let mut move_by = *own;
            for (i, s) in step.iter().enumerate() {
                move_by -= response.column(i) * *s;
            }
            let moved = std::array::from_fn(|i| x.to_array()[i] - move_by[i]);
            *x = State::from(moved);
        }
        let moved = trial.states.clone();
        self.polish(&mut trial, 2);
        if !trial.cost.is_finite() {
            return trial;
        }
        // A window that the step threw far off is tried from where it was as well.
        let off: Vec<usize> = (0..moved.len())
            .filter(|&i| trial.costs[i] > 2.0 * here.costs[i] + 20.0 && moved[i] != here.states[i])
            .collect();
        if off.len() as f64 <= THROWN_OFF * moved.len() as f64 {
            let inner = Inner::<4>::new(&trial.hypothesis, &trial.z, self.nominal);
            let again: Vec<(State<f64>, f64)> = off
                .par_iter()
                .map(|&i| inner.solve(self.data, &self.windows[i], here.states[i], 4))
                .collect();
            for (i, (state, cost)) in off.into_iter().zip(again) {
                if cost < trial.costs[i] {
                    trial.states[i] = state;
                    trial.costs[i] = cost;
                }
            }
        }
        trial.cost = trial.costs.iter().sum();
        trial
    }

    /// Solves windows that fit far worse than the others again from other starts: where the window before ends, at rest, and smoothed.
    fn restart(&self, f: &mut Fit) {
        let mut sorted = f.costs.clone();
        sorted.sort_by(f64::total_cmp);
        let Some(median) = sorted.get(sorted.len() / 2) else {
            return;
        };
        let bad = (8.0 * median).max(sorted[sorted.len() * 9 / 10]);
        if sorted[sorted.len() - 1] <= bad {
            return;
        }
        let inner = &Inner::<4>::new(&f.hypothesis, &f.z, self.nominal);
        let again: Vec<(usize, State<f64>, f64)> = (0..self.windows.len())
            .into_par_iter()
            .filter(|&i| f.costs[i] > bad)
            .map(|i| {
                let w = &self.windows[i];
                let mut starts = vec![];
                if i > 0
                    && self.windows[i - 1].run == w.run
                    && self.windows[i - 1].start + self.windows[i - 1].len == w.start
                {
                    starts.push(inner.end(self.data, &self.windows[i - 1], f.states[i - 1]));
                }
                let x = f.states[i];
                starts.push(State::new(x.theta, x.alpha, 0.0, x.alpha_dot));
                for half in [4, 10] {
                    let g = self.data.guess(w, half);
                    starts.push(g);
                    starts.push(State::new(g.theta, g.alpha, 0.0, g.alpha_dot));
                }
                let mut best = (x, f.costs[i]);
                for start in starts {
                    let found = inner.solve(self.data, w, start, 5);
                    if found.1 < best.1 {
                        best = found;
                    }
                }
                (i, best.0, best.1)
            })
            .collect();
        for (i, state, cost) in again {
            f.states[i] = state;
            f.costs[i] = cost;
        }
        f.cost = f.costs.iter().sum();
    }

    /// Standard deviations: `H⁻¹ (sum of score scoreᵀ) H⁻¹` over windows, and not below what white noise would give.
    fn deviations(&self, f: &Fit, r: &Reduced, bounds: &[(f64, f64)]) -> Vec<f64> {
        let p = f.z.len();
        let mut m = r.matrix.clone();
        for i in 0..p {
            m[(i, i)] += 1e-9;
        }
        for i in 0..p {
            if bounds[i].0 == bounds[i].1 {
                m.row_mut(i).fill(0.0);
                m.column_mut(i).fill(0.0);
                m[(i, i)] = 1e12;
            }
        }
        let Some(inverse) = m.clone().cholesky().map(|c| c.inverse()) else {
            return vec![f64::NAN; p];
        };
        let mut meat = nalgebra::DMatrix::zeros(p, p);
        for s in &r.scores {
            meat += s * s.transpose();
        }
        let sandwich = &inverse * meat * &inverse;
        (0..p)
            .map(|i| sandwich[(i, i)].max(inverse[(i, i)]).sqrt())
            .collect()
    }
}

/// A step of the parameters that stays within their bounds: components at a bound that would leave it rest.
pub(crate) fn bounded_step(
    z: &[f64],
    r: &Reduced,
    bounds: &[(f64, f64)],
    damping: f64,
) -> Option<DVector<f64>> {
    let p = z.len();
    let mut resting: Vec<bool> = bounds.iter().map(|(low, high)| low == high).collect();
    for _ in 0..p {
        let (mut m, mut g) = (r.matrix.clone(), r.gradient.clone());
        for i in 0..p {
            m[(i, i)] += damping * m[(i, i)] + 1e-9;
            if resting[i] {
                m.row_mut(i).fill(0.0);
                m.column_mut(i).fill(0.0);
                m[(i, i)] = 1.0;
                g[i] = 0.0;
            }
        }
        let step = m.cholesky()?.solve(&g);
        let mut left = false;
        for i in 0..p {
            let (low, high) = bounds[i];
            let at = (z[i] <= low && step[i] > 0.0) || (z[i] >= high && step[i] < 0.0);
            if at && !resting[i] {
                resting[i] = true;
                left = true;
            }
        }
        if !left {
            return Some(DVector::from_fn(p, |i, _| {
                z[i] - (z[i] - step[i]).clamp(bounds[i].0, bounds[i].1)
            }));
        }
    }
    None
}
