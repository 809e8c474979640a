//! The voltage that holds the arm still.

use crate::real::Real;
use furuta_model::{Plant, State};

/// Voltage (V) at the motor that holds the arm at `theta` (rad) with the pendulum upright, by a model without dry
/// friction: 0 unless it knows an effect that pulls, such as a spring. Found from the arm's accelerations at 0 V and at
/// 1 V.
pub(super) fn voltage<T: Real>(smooth: &Plant<T>, theta: T) -> T {
    let x = State::new(theta, T::ZERO, T::ZERO, T::ZERO);
    let [free, pushed] = [T::ZERO, T::ONE].map(|volts| acceleration(smooth, &x, volts));
    -free / (pushed - free)
}

/// The arm's acceleration (rad/s²) by a model without dry friction.
pub(super) fn acceleration<T: Real>(smooth: &Plant<T>, x: &State<T>, volts: T) -> T {
    // There is nothing that could stick.
    smooth.rate(T::ZERO, x, volts, T::ONE).theta_dot
}
