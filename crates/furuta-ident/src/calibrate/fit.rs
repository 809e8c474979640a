//! Output-error fit: Levenberg-Marquardt on the free parameters, every window's initial state solved for at each trial.

use furuta_model::State;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::parameters::Space;
use crate::diagnose::data::{Data, Run, Window};
use crate::diagnose::fit::bounded_step;
use crate::diagnose::shooting::{Inner, MAX_FREE, Reduced, eliminated};

/// Steps of a fit, and the share of the cost below which a step's gain ends it.
const ITERATIONS: usize = 30;
const TOLERANCE: f64 = 1e-5;
/// Near upright no model predicts for longer, s.
const UPRIGHT: f64 = 0.5;
/// Blocks over which scores are added up before they are squared, s: what is correlated for less is accounted for.
const BLOCK: f64 = 0.1;

/// What is fitted to what.
pub(super) struct Problem<'a> {
    pub(super) data: &'a Data,
    pub(super) space: &'a Space,
    pub(super) windows: Vec<Window>,
}

/// Values with the initial states that suit them.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    /// Of all parameters of the space.
    pub(super) values: Vec<f64>,
    pub(super) states: Vec<State<f64>>,
    /// Squared residuals in units of the noise.
    pub(super) cost: f64,
}

/// Windows of `seconds` where the plant is stable, short ones elsewhere.
pub(super) fn windows(data: &Data, seconds: f64) -> Vec<Window> {
    let mut windows = data.windows(seconds, Run::hangs);
    windows.extend(data.windows(seconds.min(UPRIGHT), |r| !r.hangs()));
    windows
}

impl<'a> Problem<'a> {
    pub(super) fn new(data: &'a Data, space: &'a Space, windows: Vec<Window>) -> Self {
        Self {
            data,
            space,
            windows,
        }
    }

    /// Sum of the weights of all samples, less four per window: the cost that noise alone leaves.
    pub(super) fn floor(&self) -> f64 {
        self.windows
            .iter()
            .map(|w| {
                let weights = &self.data.runs[w.run].weight[w.start + 1..=w.start + w.len];
                let samples: f64 = weights.iter().map(|w| w[0] * w[0] + w[1] * w[1]).sum();
                (samples - 4.0).max(1.0)
            })
            .sum()
    }

    fn inner(&self, values: &[f64]) -> Inner<4> {
        let (plant, late) = self.space.plant::<4>(values, &[], 4);
        Inner::of(plant, late)
    }

    /// The initial states that suit these values, from several starts.
    pub(super) fn settle(&self, values: &[f64]) -> Fit {
        let inner = self.inner(values);
        let (states, costs): (Vec<_>, Vec<_>) = self
            .windows
            .par_iter()
            .map(|w| inner.search(self.data, w, None))
            .unzip();
        Fit {
            values: values.to_vec(),
            cost: costs.iter().sum(),
            states,
        }
    }

    /// The same fit after its values were changed a little.
    pub(super) fn again(&self, fit: &Fit) -> Fit {
        self.polish(fit.values.clone(), &fit.states, 4)
    }

    /// Other values, their initial states found from those of a fit.
    pub(super) fn with_values(&self, fit: &Fit, values: Vec<f64>) -> Fit {
        self.polish(values, &fit.states, 6)
    }

    /// The same from states that are near.
    fn polish(&self, values: Vec<f64>, states: &[State<f64>], iterations: usize) -> Fit {
        let inner = self.inner(&values);
        let (states, costs): (Vec<_>, Vec<_>) = self
            .windows
            .par_iter()
            .zip(states)
            .map(|(w, x)| inner.solve(self.data, w, *x, iterations))
            .unzip();
        Fit {
            cost: costs.iter().sum(),
            values,
            states,
        }
    }

    /// All windows linearised in the free parameters, initial states eliminated.
    pub(super) fn linearise(&self, fit: &Fit, free: &[usize]) -> Reduced {
        match free.len() {
            0..=8 => self.linearise_n::<12>(fit, free),
            9..=12 => self.linearise_n::<16>(fit, free),
            _ => self.linearise_n::<24>(fit, free),
        }
    }

    fn linearise_n<const N: usize>(&self, fit: &Fit, free: &[usize]) -> Reduced {
        let (plant, late) = self.space.plant::<N>(&fit.values, free, 4);
        eliminated(
            (&plant, late),
            free.len(),
            self.data,
            &self.windows,
            &fit.states,
        )
    }

    /// Free parameters and their bounds in units of their scales.
    fn scaled(&self, values: &[f64], free: &[usize]) -> (Vec<f64>, Vec<(f64, f64)>) {
        let scale = |i: usize| self.space.parameters[i].scale;
        let bounds = self.space.bounds(values, free);
        (
            free.iter().map(|&i| values[i] / scale(i)).collect(),
            free.iter()
                .zip(bounds)
                .map(|(&i, (low, high))| (low / scale(i), high / scale(i)))
                .collect(),
        )
    }

    /// Fits the free parameters from where `start` is.
    pub(super) fn fit(&self, start: &Fit, free: &[usize]) -> Fit {
        let mut here = start.clone();
        if free.is_empty() {
            return here;
        }
        let mut damping = 1e-4;
        let mut r = self.linearise(&here, free);
        for _ in 0..ITERATIONS {
            let (z, bounds) = self.scaled(&here.values, free);
            let Some(step) = bounded_step(&z, &r, &bounds, damping) else {
                break;
            };
            let trial = self.trial(&here, &r, &step, free);
            if trial.cost < here.cost {
                let small = here.cost - trial.cost < TOLERANCE * trial.cost;
                here = trial;
                if small {
                    break;
                }
                damping = (damping * 0.1_f64).max(1e-9);
                r = self.linearise(&here, free);
            } else {
                let predicted = 2.0 * r.gradient.dot(&step) - (&r.matrix * &step).dot(&step);
                if predicted.abs() < 0.1 * TOLERANCE * here.cost {
                    break;
                }
                damping = (damping * 10.0).max(1e-4);
                if damping > 1e5 {
                    break;
                }
            }
        }
        here
    }

    /// Where a step leads, the initial states following.
    fn trial(&self, here: &Fit, r: &Reduced, step: &DVector<f64>, free: &[usize]) -> Fit {
        let mut values = here.values.clone();
        for (k, &i) in free.iter().enumerate() {
            values[i] -= step[k] * self.space.parameters[i].scale;
        }
        let states: Vec<State<f64>> = here
            .states
            .iter()
            .zip(&r.response)
            .map(|(x, (response, own))| {
                let mut by = *own;
                for (k, s) in step.iter().enumerate() {
                    by -= response.column(k) * *s;
                }
                State::from(std::array::from_fn(|i| x.to_array()[i] - by[i]))
            })
            .collect();
        self.polish(values, &states, 2)
    }

    /// Covariance of the free parameters in units of their scales, those at a bound held; `None` where the data do not determine them all.
    ///
    /// `H⁻¹ B H⁻¹` with the curvature `H` and the scores' covariance `B`, added up over blocks of [`BLOCK`]: rounding repeats itself where a motion does,
    /// and what a model lacks is never white. Not below what white noise of the encoders' size would give.
    pub(super) fn covariance(&self, fit: &Fit, free: &[usize]) -> Option<DMatrix<f64>> {
        let p = free.len();
        let r = self.linearise(fit, free);
        let (plant, late) = self.space.plant::<{ 4 + MAX_FREE }>(&fit.values, free, 4);
        let inner = Inner::of(plant, late);
        let blocks: Vec<Vec<DVector<f64>>> = (0..self.windows.len())
            .into_par_iter()
            .map(|i| {
                let w = &self.windows[i];
                let (response, _) = &r.response[i];
                let len = ((BLOCK / self.data.runs[w.run].h).round() as usize).max(1);
                let steps = inner.trace(self.data, w, fit.states[i]).steps;
                steps
                    .chunks(len)
                    .map(|chunk| {
                        let mut score = DVector::zeros(p);
                        for s in chunk {
                            for c in 0..2 {
                                let e = s.left[c] * s.weight[c] * s.weight[c];
                                let d = &s.y[c].d;
                                for k in 0..p {
                                    let by_states: f64 =
                                        (0..4).map(|j| d[j] * response[(j, k)]).sum();
                                    score[k] += (d[4 + k] - by_states) * e;
                                }
                            }
                        }
                        score
                    })
                    .collect()
            })
            .collect();
        let blocks: Vec<DVector<f64>> = blocks.into_iter().flatten().collect();
        let (z, bounds) = self.scaled(&fit.values, free);
        let resting: Vec<bool> = z
            .iter()
            .zip(&bounds)
            .map(|(z, (low, high))| z <= low || z >= high)
            .collect();
        let mut curvature = r.matrix.clone();
        for i in (0..p).filter(|&i| resting[i]) {
            curvature.row_mut(i).fill(0.0);
            curvature.column_mut(i).fill(0.0);
            curvature[(i, i)] = 1.0;
        }
        let inverse = curvature.cholesky()?.inverse();
        let mut meat = DMatrix::zeros(p, p);
        let mut mean = DVector::zeros(p);
        for s in &blocks {
            mean += s;
        }
        mean /= blocks.len() as f64;
        for s in &blocks {
            let s = s - &mean;
            meat += &s * s.transpose();
        }
        let count = blocks.len() as f64;
        meat *= count / (count - p as f64).max(1.0);
        for i in (0..p).filter(|&i| resting[i]) {
            meat.row_mut(i).fill(0.0);
            meat.column_mut(i).fill(0.0);
        }
        let mut robust = &inverse * meat * &inverse;
        for i in 0..p {
            if resting[i] {
                robust[(i, i)] = f64::NAN;
                continue;
            }
            // Widened, correlations kept.
            let wider = (inverse[(i, i)] / robust[(i, i)]).max(1.0).sqrt();
            if wider > 1.0 && wider.is_finite() {
                robust.row_mut(i).scale_mut(wider);
                robust.column_mut(i).scale_mut(wider);
            }
        }
        Some(robust)
    }

    /// Predictions over the windows from the fit's initial states.
    pub(super) fn predictions(&self, fit: &Fit) -> Vec<Vec<[f64; 2]>> {
        let inner = self.inner(&fit.values);
        self.windows
            .par_iter()
            .zip(&fit.states)
            .map(|(w, x)| inner.predictions(self.data, w, *x))
            .collect()
    }
}
