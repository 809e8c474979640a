//! The voltage that holds the arm still.

use crate::real::Real;
use furuta_model::{Plant, State};

/// Voltage (V) that holds the arm at `theta` (rad) with the pendulum upright, by the model: 0 unless it knows an effect that pulls, such as
/// a spring. Found from the arm's accelerations at 0 V and at 1 V. Not finite where friction holds the arm by itself, and 1 V changes nothing.
pub(super) fn voltage<T: Real>(plant: &Plant<T>, theta: T, stick_rate: T) -> T {
    let x = State::new(theta, T::ZERO, T::ZERO, T::ZERO);
    let [free, pushed] = [T::ZERO, T::ONE].map(|u| {
        plant
            .rate(T::ZERO, &x, plant.volts(u), stick_rate)
            .theta_dot
    });
    -free / (pushed - free)
}
