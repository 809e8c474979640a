//! An example for tests: a rig that a sweep moves, and what is fitted to it.

use std::sync::Arc;

use furuta_model::{Effect, Plant, Rig, State, effects};

use super::hypothesis::{Hypothesis, Sheet};
use super::{Fit, SEARCH};
use crate::pendulum::Pendulum;
use crate::recording::Recording;
use crate::shooting::{Data, Effort, Problem};

/// Recordings of a rig of this data sheet, each with zeros of its own.
pub(super) struct Recorded {
    pub(super) data: Data,
    pub(super) sheet: Arc<Sheet>,
}

impl Recorded {
    pub(super) fn new(recordings: &[Recording], rig: &Rig) -> Self {
        let data = Data::new(recordings, rig);
        let sheet = Arc::new(Sheet::new(rig, &data, true, Pendulum::Swings));
        Self { data, sheet }
    }

    /// The short windows of a search.
    pub(super) fn problem(&self) -> Problem<'_> {
        Problem::new(&self.data, self.data.windows(SEARCH, |_| true))
    }

    /// The sheet refitted.
    pub(super) fn refitted(&self, problem: &Problem<'_>) -> Fit {
        let base = Hypothesis::base(&self.sheet);
        let given = problem.solve_states(&base, &vec![0.0; base.len()], None);
        problem.fit(&base, given.z, &given.states, Effort::FULL)
    }
}

/// A QUBE whose arm hides Stribeck's friction.
pub(super) fn sticking() -> Recorded {
    let rig = Rig::builtin("qube-servo-2").expect("built in");
    let hidden = Effect::new("arm.stribeck", &[1e-3, 2e-3, 0.5]).expect("valid");
    Recorded::new(&[sweep("sticking", &rig, &[hidden], 0.0)], &rig)
}

/// A fit with one more effect, from these values of its numbers.
pub(super) fn extended(
    problem: &Problem<'_>,
    from: &Fit,
    id: &str,
    values: &[f64],
    effort: Effort,
) -> Fit {
    let spec = effects::spec(id).expect("an entry");
    let params = &from.model.sheet.params;
    let units = values.iter().zip(spec.parameters);
    let units: Vec<f64> = units
        .map(|(v, p)| (v - p.off) / p.typical(params))
        .collect();
    let z = from.model.extended(&from.z, &units);
    let h = from.model.with(spec);
    let start = problem.solve_states(&h, &z, Some(&from.states));
    problem.fit(&h, start.z, &start.states, effort)
}

/// What the encoders of a hanging rig with these effects see for six seconds, the pendulum's zero `zero` radians off.
pub(super) fn sweep(name: &str, rig: &Rig, effects: &[Effect<f64>], zero: f64) -> Recording {
    let plant: Plant<f64> = Plant::new(&rig.params, effects).expect("a plant");
    let mut x = plant.rest(State::hanging());
    let samples: Vec<[f64; 4]> = (0..3000)
        .map(|k| {
            let t = f64::from(k) * 0.002;
            let u = 1.5 * (3.0 * t * (1.0 + t)).sin();
            let [theta, alpha] = plant.measure(&x);
            let [theta, alpha] = rig.sensors.quantised([theta, alpha + zero]);
            plant.step(&mut x, u, 0.002);
            [t, u, theta, alpha]
        })
        .collect();
    Recording::from_samples(name, samples).expect("sound").0
}
