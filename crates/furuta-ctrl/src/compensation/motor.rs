//! The command that gives a voltage, behind a dead zone or an amplifier that is not straight.

use crate::real::{Real, c};
use furuta_model::Plant;

/// Halvings of the interval of commands: to 1e-6 of it.
const HALVINGS: u32 = 20;
/// Share of the largest command below which a voltage is not reached exactly but in proportion: across a dead zone the command would otherwise
/// jump with every change of sign.
const STRAIGHT: f64 = 0.01;

/// The command (V, within `limit`) for which the model's motor has the voltage `volts`.
pub(super) fn command<T: Real>(plant: &Plant<T>, volts: T, limit: T) -> T {
    let small = c::<T>(STRAIGHT) * limit;
    if volts.abs() >= small {
        return inverse(plant, volts, limit);
    }
    let (low, high) = (inverse(plant, -small, limit), inverse(plant, small, limit));
    low + (high - low) * ((volts + small) / (small + small))
}

/// By bisection: the maps of the catalogue never fall, and have kinks.
fn inverse<T: Real>(plant: &Plant<T>, volts: T, limit: T) -> T {
    let half = c::<T>(0.5);
    let (mut low, mut high) = (-limit, limit);
    for _ in 0..HALVINGS {
        let middle = half * (low + high);
        if plant.volts(middle) < volts {
            low = middle;
        } else {
            high = middle;
        }
    }
    half * (low + high)
}
