//! The standard balance gain of a rig.

use super::{DesignError, Regulator, Weights, dlqr};
use furuta_model::discretize::zero_order_hold;
use furuta_model::{Params, Plant, State, linearize};

/// Arm angle that weighs as much as the full command, rad. Loose, because an arm allowed to travel catches more (tuned with the swing-up, on all built-in rigs); the pendulum's own
/// instability keeps the loop fast.
const ARM_WEIGHT_AT: f64 = 9.9;
/// Pendulum angle that weighs as much as the full command, rad.
const PENDULUM_WEIGHT_AT: f64 = 0.5;

/// Weights that suit any rig: by Bryson's rule, full command, 0.5 rad of the pendulum and 9.9 rad of the arm cost alike; speeds are free.
pub fn balance_weights(params: &Params<f64>) -> Weights<f64, 4, 1> {
    let free = f64::INFINITY;
    Weights::bryson(
        [ARM_WEIGHT_AT, PENDULUM_WEIGHT_AT, free, free],
        [params.motor.command_limit],
    )
}

/// The gain that keeps this rig's pendulum upright at the sample period `h` (s): [`dlqr`] on the upright linearisation held over a
/// sample, with [`balance_weights`].
///
/// # Errors
/// Those of [`super::riccati::discrete`]; a rig without gravity, or a period far above the pendulum's own, has no useful answer.
///
/// ```
/// let rig = furuta_model::Rig::builtin("qube-servo-2").ok_or("no such rig")?;
/// let regulator = furuta_ctrl::design::balance(&rig.params, 0.002)?;
/// assert!(furuta_ctrl::design::is_schur(&regulator.closed_loop));
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
pub fn balance(params: &Params<f64>, h: f64) -> Result<Regulator<f64, 4, 1>, DesignError> {
    // Effects are left out on purpose: friction and dead zones have no useful derivative at rest.
    let Ok(plant) = Plant::new(params, &[]) else {
        return Err(DesignError::NoStabilisingSolution { measure: f64::NAN });
    };
    let linear = linearize(&plant, State::upright(), 0.0);
    let (a, b) = zero_order_hold(&linear.a, &linear.b, h);
    dlqr(&a, &b, &balance_weights(params))
}
