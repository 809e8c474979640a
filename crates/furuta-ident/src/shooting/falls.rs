//! An example for tests: a pendulum that falls again and again.

use furuta_model::{Plant, Rig, State};

use super::rig::AsGiven;
use crate::pendulum::Pendulum;
use crate::recording::Recording;

const H: f64 = 0.002;
/// The pendulum is let go this often, next to upright.
const FALLS: usize = 12;
pub(super) const SECONDS: f64 = 1.0;

/// What the encoders of a rig see whose pendulum falls again and again, each fall a recording.
pub(super) fn falls(rig: &Rig) -> Vec<Recording> {
    let plant: Plant<f64> = Plant::new(&rig.params, &[]).expect("a plant");
    let fall = |i: usize| {
        let mut s = plant.rest(State::new(0.0, 0.02 + 0.002 * i as f64, 0.0, 0.0));
        let samples: Vec<[f64; 4]> = (0..(SECONDS / H) as usize + 1)
            .map(|k| {
                let [theta, alpha] = rig.sensors.quantised(plant.measure(&s));
                plant.step(&mut s, 0.0, H);
                [H * k as f64, 0.0, theta, alpha]
            })
            .collect();
        let name = format!("fall-{i}");
        Recording::from_samples(&name, samples)
            .expect("a recording")
            .0
    };
    (0..FALLS).map(fall).collect()
}

/// The rig as it is, each fall with zeros of its own.
pub(super) fn as_given(rig: &Rig) -> AsGiven<'_> {
    AsGiven {
        rig,
        recordings: FALLS,
        state: Pendulum::Swings,
        own_zeros: true,
    }
}
