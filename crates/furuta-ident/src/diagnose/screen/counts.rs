//! Where an encoder has lost counts: its zero steps between two samples. Every moment is tried, without simulating.

use furuta_model::effects::Law;
use furuta_model::{Effect, Spec};
use nalgebra::Vector4;
use rayon::prelude::*;

use super::scan::Place;
use super::{Response, Screen};

/// Of a step that the window's initial state can follow but for this share of its square, rounding is left.
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
        let steps = self.responses.par_iter().flat_map_iter(|response| {
            let place = |(gain, size, time)| Place {
                gain,
                values: vec![size, time, response.recording as f64],
                zeros: vec![0.0; self.recordings],
            };
            steps_in(response, encoder).into_iter().map(place)
        });
        steps.filter(|place| asked(&place.values)).collect()
    }
}

/// What a step between each two samples of a window gains, its best size (rad) and its time (s). The initial state
/// takes its part; the base parameters hardly follow what happens in one window.
fn steps_in(response: &Response, encoder: [f64; 2]) -> Vec<(f64, f64, f64)> {
    let (mut square, mut product, mut shared) = (0.0, 0.0, Vector4::zeros());
    let mut steps = Vec::with_capacity(response.steps.len());
    // All samples behind the step have it.
    for (k, step) in response.steps.iter().enumerate().rev() {
        for (c, encoder) in encoder.iter().enumerate() {
            let y = encoder * response.weight[k][c];
            square += y * y;
            product += y * response.left[k][c];
            shared += response.slopes[k][c] * y;
        }
        let absorbed = response.normal.solve(&shared);
        let own = square - absorbed.dot(&shared);
        let along = product - absorbed.dot(&response.gradient);
        if own > SHOWS * square {
            steps.push((along * along / own, along / own, step.t));
        }
    }
    steps
}
