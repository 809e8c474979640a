//! Where an encoder has lost counts: its zero steps between two samples. Every moment is tried, without simulating.

use furuta_model::effects::Law;
use furuta_model::{Effect, Spec};
use nalgebra::{DVector, SVector, Vector4};
use rayon::prelude::*;

use super::scan::Place;
use super::{FOLLOW, Response, Screen, follower};

/// Of a step that everything else can follow but for this share of its square, rounding is left.
const SHOWS: f64 = 1e-6;

impl Screen {
    /// The steps of an encoder's zero at the moments that are asked for (by their parameters: size, time, run).
    pub(super) fn steps_of_zero(
        &self,
        spec: &'static Spec,
        asked: impl Fn(&[f64]) -> bool + Sync,
    ) -> Vec<Place> {
        let Some(unit) = Effect::unchecked(spec.id, &[1.0, 0.0, 0.0]) else {
            return Vec::new();
        };
        let encoder = unit.lost(0, 1.0);
        let places = (0..self.recordings)
            .into_par_iter()
            .flat_map_iter(|recording| self.steps_in(recording, encoder));
        places.filter(|place| asked(&place.values)).collect()
    }

    /// What a step between each two samples of a recording gains, and its best size. All samples behind the step have
    /// it: in its window, and in those after it.
    fn steps_in(&self, recording: usize, encoder: [f64; 2]) -> Vec<Place> {
        let mut windows: Vec<&Response> = (self.responses.iter())
            .filter(|r| r.recording == recording && !r.steps.is_empty())
            .collect();
        windows.sort_by(|a, b| a.read[0].total_cmp(&b.read[0]));
        let mut places = Vec::new();
        let mut later = Step::default();
        for window in windows.into_iter().rev() {
            let mut whole = Step::default();
            for (time, here) in steps_of(window, encoder) {
                whole = here.and(&later);
                let Some((gain, size)) = self.best_size(recording, &whole) else {
                    continue;
                };
                places.push(Place {
                    gain,
                    values: vec![size, time, recording as f64],
                    zeros: vec![0.0; self.recordings],
                });
            }
            later = whole;
        }
        places
    }

    /// What a step gains at its best size (rad) while the base parameters and the zeros follow.
    fn best_size(&self, recording: usize, step: &Step) -> Option<(f64, f64)> {
        let mut cross = DVector::<f64>::zeros(self.gradient.len());
        for i in 0..FOLLOW {
            cross[follower(recording, i)] += step.base[i];
        }
        let follows = self.normal.as_ref()?.solve(&cross);
        let square = step.square - follows.dot(&cross);
        let product = step.product - follows.dot(&self.gradient);
        (square > SHOWS * step.readings).then(|| (product * product / square, product / square))
    }
}

/// A step of a zero by one radian, the initial states taken out.
#[derive(Clone, Copy, Default)]
struct Step {
    /// Its square in the readings alone.
    readings: f64,
    square: f64,
    /// Its product with what is left.
    product: f64,
    /// Its products with the slopes of what follows.
    base: SVector<f64, FOLLOW>,
}

impl Step {
    fn and(&self, other: &Self) -> Self {
        Self {
            readings: self.readings + other.readings,
            square: self.square + other.square,
            product: self.product + other.product,
            base: self.base + other.base,
        }
    }
}

/// The steps before each sample of a window, the last first, and their times (s).
fn steps_of(response: &Response, encoder: [f64; 2]) -> impl Iterator<Item = (f64, Step)> {
    let mut sum = Step::default();
    let mut shared = Vector4::zeros();
    response
        .steps
        .iter()
        .enumerate()
        .rev()
        .map(move |(k, step)| {
            for (c, encoder) in encoder.iter().enumerate() {
                let y = encoder * response.weight[k][c];
                sum.readings += y * y;
                sum.product += y * response.left[k][c];
                sum.base += response.base[k][c] * y;
                shared += response.slopes[k][c] * y;
            }
            let absorbed = response.normal.solve(&shared);
            let here = Step {
                readings: sum.readings,
                square: sum.readings - absorbed.dot(&shared),
                product: sum.product - absorbed.dot(&response.gradient),
                base: sum.base - response.absorbed.tr_mul(&shared),
            };
            (response.read[k] - 0.5 * step.length, here)
        })
}
