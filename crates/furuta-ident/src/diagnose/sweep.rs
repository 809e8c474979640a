//! An example for tests: a rig that a sweep moves.

use furuta_model::{Effect, Plant, Rig, State};

use crate::recording::Recording;

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
