//! Where the arm's end stops may be: at the ends of how far it turned, in each recording by its own zero.

use furuta_model::Spec;

use super::Screen;
use super::scan::Place;

/// Of a stop of the typical stiffness, how deep the motor presses the arm into it at rest, rad.
const DEPTH: f64 = 0.1;

impl Screen {
    /// The stops that the arm has reached on both sides, for each stiffness that a fit may start with, as deep as the
    /// motor presses it into them.
    pub(super) fn stops(&self, spec: &'static Spec, typical: &[f64]) -> Vec<Place> {
        let at = |name: &str| spec.parameters.iter().position(|p| p.name == name);
        let (Some(stiffness), Some(angle), Some(middle)) =
            (at("stiffness"), at("angle"), at("middle"))
        else {
            return Vec::new();
        };
        let middles: Vec<f64> = self.travel.iter().map(|[a, b]| 0.5 * (a + b)).collect();
        let halves = self.travel.iter().map(|[a, b]| 0.5 * (b - a));
        let farthest = halves.fold(0.0, f64::max);
        let starts = spec.parameters[stiffness].starts.iter();
        let place = |start: &f64| {
            let first = spec.parameters.iter().zip(typical);
            let mut values: Vec<f64> = first
                .map(|(p, typical)| p.off + p.starts[0] * typical)
                .collect();
            values[stiffness] = start * typical[stiffness];
            // An arm that hardly moved has reached none.
            values[angle] = (farthest - DEPTH / start).max(0.5 * farthest);
            values[middle] = middles[0];
            Place {
                gain: 0.0,
                values,
                zeros: middles.iter().map(|m| middles[0] - m).collect(),
            }
        };
        starts.map(place).collect()
    }
}
