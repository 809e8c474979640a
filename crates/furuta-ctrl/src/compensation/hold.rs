//! The voltage that holds the arm still.

use crate::real::Real;
use furuta_model::{Plant, State};

/// Voltage (V) at the motor that holds the arm at `theta` (rad) with the pendulum upright, by a model without dry
/// friction: 0 unless it knows an effect that pulls, such as a spring. Found from the arm's accelerations at 0 V and at
/// 1 V.
///
/// ```
/// use furuta_ctrl::compensation::holding_voltage;
/// use furuta_model::{Effect, Plant, Rig};
/// let rig = Rig::builtin("qube-servo-2").ok_or("no such rig")?;
/// let spring = Effect::new("arm.spring", &[0.01, 0.5])?;
/// let plant = Plant::new(&rig.params, &[spring])?;
/// let torque = rig.params.coefficients().drive * holding_voltage(&plant, 0.2);
/// assert!((torque + 0.01 * 0.3_f64).abs() < 1e-12); // the spring pulls towards 0.5 rad
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
pub fn voltage<T: Real>(smooth: &Plant<T>, theta: T) -> T {
    let x = State::new(theta, T::ZERO, T::ZERO, T::ZERO);
    let [free, pushed] = [T::ZERO, T::ONE].map(|volts| acceleration(smooth, &x, volts));
    -free / (pushed - free)
}

/// The arm's acceleration (rad/s²) by a model without dry friction.
pub(crate) fn acceleration<T: Real>(smooth: &Plant<T>, x: &State<T>, volts: T) -> T {
    // There is nothing that could stick.
    smooth.rate(T::ZERO, x, volts, T::ONE).theta_dot
}
