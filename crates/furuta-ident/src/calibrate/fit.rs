//! Output-error fit of the numbers of a rig file, on the engine of `shooting`.

use furuta_model::Jet;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::parameters::Space;
use crate::pendulum::Pendulum;
use crate::shooting::{
    self, About, Data, Effort, Keep, Layout, Model, Observed, Pass, Prior, Reduced, Run, Start,
    Window, Windows, with_zeros_found, zero_bounds, zero_priors, zeros_each,
};

/// Near upright no model predicts for longer, s.
const UPRIGHT: f64 = 0.5;
/// Blocks over which scores are added up before they are squared, s: what is correlated for less is accounted for.
const BLOCK: f64 = 0.1;

/// What is fitted to what.
pub(super) struct CalibrationProblem<'a> {
    pub(super) data: &'a Data,
    pub(super) space: &'a Space,
    /// Whether each recording has zeros of its own.
    own_zeros: bool,
    pub(super) windows: Vec<Window>,
}

/// Values with the initial states that suit them.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    /// Of all parameters of the space.
    pub(super) values: Vec<f64>,
    /// The zeros of each recording but the first, as the model counts them.
    zeros: Vec<f64>,
    pub(super) states: Vec<Start>,
    /// Squared residuals in units of the noise.
    pub(super) cost: f64,
}

/// The parameters of a space that are free, the others held.
#[derive(Clone)]
struct Free<'a> {
    space: &'a Space,
    free: Vec<usize>,
    values: Vec<f64>,
    own_zeros: bool,
    /// What the rig was at each recording.
    states: Vec<Pendulum>,
}

impl Free<'_> {
    fn scale(&self, k: usize) -> f64 {
        self.space.parameters[self.free[k]].scale
    }

    /// The recording from whose zero of theta angles are counted, where all that depends on the arm's angle may turn.
    fn reference(&self) -> Option<usize> {
        self.space.turns(&self.free).then_some(0)
    }

    /// The values of all parameters for a vector.
    fn values(&self, z: &[f64]) -> Vec<f64> {
        let mut values = self.values.clone();
        for (k, &i) in self.free.iter().enumerate() {
            values[i] = z[k] * self.scale(k);
        }
        values
    }

    /// The vector for the values held and these zeros.
    fn vector(&self, zeros: &[f64]) -> Vec<f64> {
        let free = self.free.iter().enumerate();
        let mut z: Vec<f64> = free.map(|(k, &i)| self.values[i] / self.scale(k)).collect();
        z.extend(zeros);
        z.resize(self.layout().len(), 0.0);
        z
    }
}

impl Model for Free<'_> {
    fn layout(&self) -> Layout {
        Layout {
            shared: self.free.len(),
            lead: self.free.len(),
            zeros: zeros_each(self.own_zeros),
            recordings: self.states.len(),
        }
    }

    fn observed<const N: usize>(&self, z: &[f64], pass: Pass) -> Observed<Jet<f64, N>> {
        let layout = self.layout();
        let values = self.values(z);
        let plant = |state| self.space.plant::<N>(&values, &self.free, pass, state);
        let (whole, late) = plant(Pendulum::Swings);
        let mut seen = Observed::from_true_zeros(whole, late);
        let otherwise = |state: &Pendulum| (!state.is_whole()).then(|| plant(*state));
        seen.otherwise = self.states.iter().map(otherwise).collect();
        seen.free_zeros(&layout, z, pass);
        seen
    }

    fn bounds(&self, z: &[f64]) -> Vec<(f64, f64)> {
        let bounds = self.space.bounds(&self.values(z), &self.free);
        let scaled = bounds.iter().enumerate();
        let mut bounds: Vec<(f64, f64)> = scaled
            .map(|(k, (low, high))| (low / self.scale(k), high / self.scale(k)))
            .collect();
        bounds.extend(zero_bounds(
            &self.layout(),
            self.space.sees_angle(),
            self.reference(),
        ));
        bounds
    }

    fn priors(&self) -> Vec<Option<Prior>> {
        let mut priors = vec![None; self.free.len()];
        priors.extend(zero_priors(&self.layout(), &self.space.rig.sensors));
        priors
    }
}

/// Windows of `seconds` where the plant is stable, short ones elsewhere.
pub(super) fn windows(data: &Data, seconds: f64) -> Vec<Window> {
    let mut windows = data.windows(seconds, Run::hangs);
    windows.extend(data.windows(seconds.min(UPRIGHT), |r| !r.hangs()));
    windows
}

impl<'a> CalibrationProblem<'a> {
    pub(super) fn new(
        data: &'a Data,
        (space, own_zeros): (&'a Space, bool),
        windows: Vec<Window>,
    ) -> Self {
        Self {
            data,
            space,
            own_zeros,
            windows,
        }
    }

    fn engine(&self) -> shooting::Problem<'a> {
        shooting::Problem::new(self.data, self.windows.clone())
    }

    fn model(&self, values: &[f64], free: &[usize]) -> Free<'a> {
        Free {
            space: self.space,
            free: free.to_vec(),
            values: values.to_vec(),
            own_zeros: self.own_zeros,
            states: self.data.states(),
        }
    }

    /// Sum of the weights of all samples, less four per window: the cost that noise alone leaves.
    pub(super) fn floor(&self) -> f64 {
        self.engine().floor()
    }

    /// What the engine fitted, in values of the rig file.
    fn known(fit: shooting::Fit<Free<'a>>) -> Fit {
        Fit {
            values: fit.model.values(&fit.z),
            zeros: fit.z[fit.model.free.len()..].to_vec(),
            states: fit.states,
            cost: fit.costs.iter().sum(),
        }
    }

    /// The initial states that suit these values, from several starts.
    pub(super) fn solve_states(&self, values: &[f64]) -> Fit {
        let model = self.model(values, &[]);
        let z = with_zeros_found(self.data, &model, &model.vector(&[]));
        Self::known(self.engine().solve_states(&model, &z, None))
    }

    /// The same fit after its values were changed a little.
    pub(super) fn again(&self, fit: &Fit) -> Fit {
        self.with_values(fit, fit.values.clone())
    }

    /// Other values, their initial states found from those of a fit.
    pub(super) fn with_values(&self, fit: &Fit, values: Vec<f64>) -> Fit {
        let model = self.model(&values, &[]);
        let z = model.vector(&fit.zeros);
        Self::known(self.engine().fit(&model, z, &fit.states, Effort::TIGHT))
    }

    /// All windows linearised in the free parameters and the recordings' zeros, initial states eliminated, with what is
    /// to be kept beside the sums.
    fn reduced(&self, fit: &Fit, free: &[usize], keep: Keep) -> Reduced {
        let model = self.model(&fit.values, free);
        let z = model.vector(&fit.zeros);
        let about = About {
            model: &model,
            z: &z,
            data: self.data,
            windows: &self.windows,
            states: &fit.states,
            prior_weight: 1.0,
        };
        about.reduced(keep)
    }

    /// What the windows say of the free parameters, in units of their scales, initial states and those zeros eliminated
    /// that a fit would move.
    pub(super) fn information(&self, fit: &Fit, free: &[usize]) -> DMatrix<f64> {
        let (mut m, p) = (self.reduced(fit, free, Keep::Sums).matrix, free.len());
        let zeros = m.nrows() - p;
        let model = self.model(&fit.values, free);
        let bounds = model.bounds(&model.vector(&fit.zeros));
        for i in (p..m.nrows()).filter(|&i| bounds[i].0 == bounds[i].1) {
            m.row_mut(i).fill(0.0);
            m.column_mut(i).fill(0.0);
        }
        let mut own = m.view((p, p), (zeros, zeros)).into_owned();
        for i in 0..zeros {
            own[(i, i)] += 1e-9;
        }
        let cross = m.view((p, 0), (zeros, p)).into_owned();
        let known = m.view((0, 0), (p, p)).into_owned();
        match own.cholesky() {
            Some(own) => known - cross.tr_mul(&own.solve(&cross)),
            None => known,
        }
    }

    /// Fits the free parameters from where `start` is.
    pub(super) fn fit(&self, start: &Fit, free: &[usize]) -> Fit {
        let model = self.model(&start.values, free);
        let z = model.vector(&start.zeros);
        Self::known(self.engine().fit(&model, z, &start.states, Effort::TIGHT))
    }

    /// Covariance of the free parameters in units of their scales, those at a bound held; `None` where the data do not
    /// determine them all.
    ///
    /// `H⁻¹ B H⁻¹` with the curvature `H` and the scores' covariance `B`, added up over blocks of [`BLOCK`]: rounding
    /// repeats itself where a motion does, and what a model lacks is never white. Not below what white noise of the
    /// encoders' size would give.
    pub(super) fn covariance(&self, fit: &Fit, free: &[usize]) -> Option<DMatrix<f64>> {
        let model = self.model(&fit.values, free);
        let p = model.layout().len();
        let z = model.vector(&fit.zeros);
        let r = self.reduced(fit, free, Keep::Blocks(BLOCK));
        let blocks: Vec<&DVector<f64>> = r.windows.iter().flat_map(|w| &w.blocks).collect();
        let bounds = model.bounds(&z);
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
            mean += *s;
        }
        mean /= blocks.len() as f64;
        for s in &blocks {
            let s = *s - &mean;
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
        Some(robust.view((0, 0), (free.len(), free.len())).into_owned())
    }

    /// Predictions over the windows from the fit's initial states.
    pub(super) fn predictions(&self, fit: &Fit) -> Vec<Vec<[f64; 2]>> {
        let model = self.model(&fit.values, &[]);
        let windows = Windows::new(&model, &model.vector(&fit.zeros));
        self.windows
            .par_iter()
            .zip(&fit.states)
            .map(|(w, start)| windows.predictions(self.data, w, start))
            .collect()
    }
}
