//! Where an encoder has lost counts: its zero steps between two samples. Every moment is tried, without simulating.

use furuta_model::effects::Law;
use furuta_model::{Effect, Spec};
use nalgebra::{ArrayStorage, DVector, SVector, Vector4};
use rayon::prelude::*;

use super::scan::Place;
use super::{FOLLOW, Screen, follower};

/// Of a step that initial states can follow but for this share of its square, rounding is left.
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
        let places = (0..self.recordings).into_par_iter().flat_map_iter(|run| {
            let steps = self.steps_in(run, encoder);
            steps.into_iter().map(move |(gain, size, time)| Place {
                gain,
                values: vec![size, time, run as f64],
                zeros: vec![0.0; self.recordings],
            })
        });
        places.filter(|place| asked(&place.values)).collect()
    }

    /// What a step between each two samples of a recording gains, its best size (rad) and its time (s): all readings
    /// behind it have it, those of the later windows with it.
    fn steps_in(&self, recording: usize, encoder: [f64; 2]) -> Vec<(f64, f64, f64)> {
        let Some(base) = self.normal.as_ref() else {
            return Vec::new();
        };
        let mut steps = Vec::new();
        let mut later = Sum::ZERO;
        let windows = self.responses.iter().rev();
        for response in windows.filter(|r| r.recording == recording) {
            let mut here = Sum::ZERO;
            let mut shared = Vector4::zeros();
            let mut whole = later;
            for (k, step) in response.steps.iter().enumerate().rev() {
                for (c, encoder) in encoder.iter().enumerate() {
                    let y = encoder * response.weight[k][c];
                    here.raw += y * y;
                    here.product += y * response.left[k][c];
                    here.follow += response.base[k][c] * y;
                    shared += response.slopes[k][c] * y;
                }
                // The initial state takes its part, then what follows.
                let absorbed = response.normal.solve(&shared);
                whole = Sum {
                    raw: later.raw + here.raw,
                    square: later.square + here.raw - absorbed.dot(&shared),
                    product: later.product + here.product - absorbed.dot(&response.gradient),
                    follow: later.follow + here.follow - response.absorbed.tr_mul(&shared),
                };
                let mut cross = DVector::zeros(self.gradient.len());
                for i in 0..FOLLOW {
                    cross[follower(recording, i)] = whole.follow[i];
                }
                let follows = base.solve(&cross);
                let square = whole.square - follows.dot(&cross);
                let product = whole.product - follows.dot(&self.gradient);
                if square > SHOWS * whole.raw {
                    steps.push((product * product / square, product / square, step.t));
                }
            }
            later = whole;
        }
        steps
    }
}

/// Sums over readings that a step of one radian moves: of its square, with and without what initial states take; of its
/// products with what is left and with the slopes of what follows.
#[derive(Clone, Copy)]
struct Sum {
    raw: f64,
    square: f64,
    product: f64,
    follow: SVector<f64, FOLLOW>,
}

impl Sum {
    const ZERO: Self = Self {
        raw: 0.0,
        square: 0.0,
        product: 0.0,
        follow: SVector::<f64, FOLLOW>::from_array_storage(ArrayStorage([[0.0; FOLLOW]; 1])),
    };
}
