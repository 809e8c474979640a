//! The engine's parts one at a time, for measuring how long each takes.

use furuta_model::{Rig, effects};

use std::sync::Arc;

use super::hypothesis::{Hypothesis, Sheet};
use super::{Fit, SEARCH};
use crate::insufficient::{self, Insufficient};
use crate::pendulum::Pendulum;
use crate::recording::Recording;
use crate::shooting::{Data, Effort, Model, Problem, Windows};

/// Recordings made ready, and the model refitted to them: what a search starts from.
///
/// ```
/// use furuta_ident::diagnose::Parts;
/// use furuta_ident::recording::Recording;
/// use furuta_model::{Effect, Plant, Rig, State};
///
/// let rig = Rig::builtin("qube-servo-2").expect("built in");
/// let cable = Effect::new("arm.spring", &[2e-3, 0.2]).expect("valid");
/// let plant: Plant<f64> = Plant::new(&rig.params, &[cable]).expect("one effect");
/// let mut x = plant.rest(State::hanging());
/// let mut samples = Vec::new();
/// for k in 0..2000 {
///     let t = f64::from(k) * 0.002;
///     let [theta, alpha] = rig.sensors.quantised(plant.measure(&x));
///     let u = 1.5 * (3.0 * t * (1.0 + t)).sin();
///     samples.push([t, u, theta, alpha]);
///     plant.step(&mut x, u, 0.002);
/// }
/// let recordings = [Recording::from_samples("sweep", samples)?.0];
/// let parts = Parts::new(&recordings, &rig)?;
/// assert_eq!(parts.windows(), 16); // four seconds in quarters
/// assert!(parts.fit("arm.spring").expect("in the catalogue") < 0.5 * parts.cost());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Parts {
    data: Data,
    base: Fit,
}

impl Parts {
    /// Prepares the data and refits the model's parameters.
    ///
    /// # Errors
    /// As [`super::diagnose`].
    pub fn new(recordings: &[Recording], rig: &Rig) -> Result<Self, Insufficient> {
        let data = Data::new(recordings, rig);
        insufficient::check(recordings, rig, &data)?;
        let base = Hypothesis::base(&Arc::new(Sheet::new(rig, &data, true, Pendulum::Swings)));
        let problem = Problem::new(&data, data.windows(SEARCH, |_| true));
        let z = vec![0.0; base.layout().len()];
        let given = problem.solve_states(&base, &z, None);
        let base = problem.fit(&base, z, &given.states, Effort::FULL);
        Ok(Self { data, base })
    }

    fn problem(&self) -> Problem<'_> {
        Problem::new(&self.data, self.data.windows(SEARCH, |_| true))
    }

    /// How many windows the recordings are cut into.
    #[must_use]
    pub fn windows(&self) -> usize {
        self.base.states.len()
    }

    /// Cost of the refitted model: the sum of the squared residuals in units of the noise.
    #[must_use]
    pub fn cost(&self) -> f64 {
        self.base.cost
    }

    /// One simulation of every window with the derivatives to initial state and parameters; the size of the gradient.
    #[must_use]
    pub fn sensitivities(&self) -> f64 {
        self.problem().linearise(&self.base).gradient.norm()
    }

    /// Solves one window (from 0) for its initial state from a guess; the cost that is left, nothing if there is no
    /// such window.
    #[must_use]
    pub fn solve_window(&self, window: usize) -> Option<f64> {
        let problem = self.problem();
        let windows = Windows::new(&self.base.model, &self.base.z);
        let w = problem.windows.get(window)?;
        Some(windows.search(&self.data, w, None).1)
    }

    /// Fits the model with one more effect from its typical strength; the cost that is left, nothing if the catalogue
    /// has no such effect.
    #[must_use]
    pub fn fit(&self, id: &str) -> Option<f64> {
        let spec = effects::spec(id)?;
        let h = self.base.model.with(spec);
        let values: Vec<f64> = spec.parameters.iter().map(|p| p.starts[0]).collect();
        let z = self.base.model.extended(&self.base.z, &values);
        let fit = self.problem().fit(&h, z, &self.base.states, Effort::FULL);
        Some(fit.cost)
    }
}
