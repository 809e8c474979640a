//! The standard balance gain of a rig.

use super::{DesignError, Regulator, Weights, dlqr};
use furuta_model::discretize::zero_order_hold;
use furuta_model::{Params, Plant, State, linearize};

/// Arm angle that weighs as much as the full command, rad: stiff enough that friction and cables move the arm little,
/// loose enough that the arm may travel to save the pendulum.
const ARM_WEIGHT_AT: f64 = 4.0;
/// The same where the arm has little grip on the pendulum, over that grip `m L_r c / (I + m c^2)` (rad of pendulum for
/// 1 rad of arm, quickly): a long pendulum on a short arm takes more travel.
const ARM_WEIGHT_AT_GRIP: f64 = 1.7;
/// Pendulum angle that weighs as much as the full command, rad.
const PENDULUM_WEIGHT_AT: f64 = 0.5;
/// The same where the arm has little grip, of it: to catch an angle `a`, the arm moves at about `omega a / grip`, and
/// from `a = grip` on its centrifugal pull tips the pendulum more than gravity does.
const PENDULUM_WEIGHT_AT_GRIP: f64 = 0.55;
/// Number of the pendulum's time constants after which the integral of an error weighs as much as the error.
const PATIENCE: f64 = 10.0;

/// Weights that suit any rig, by Bryson's rule: full command, 0.5 rad of the pendulum and 4 rad of the arm (more where
/// the pendulum is long against the arm) cost alike; speeds are free.
pub fn balance_weights(params: &Params<f64>) -> Weights<f64, 4, 1> {
    let k = params.coefficients();
    let grip = k.coupling / k.pendulum;
    let arm = (ARM_WEIGHT_AT_GRIP / grip).max(ARM_WEIGHT_AT);
    let pendulum = (PENDULUM_WEIGHT_AT_GRIP * grip).min(PENDULUM_WEIGHT_AT);
    let free = f64::INFINITY;
    Weights::bryson([arm, pendulum, free, free], [params.motor.command_limit])
}

/// [`balance_weights`] with the integral of the arm's angle as a fifth state: an arm that has been off for ten of the
/// pendulum's time constants costs as much again as the angle itself.
pub fn balance_weights_with_integral(params: &Params<f64>) -> Weights<f64, 5, 1> {
    let weights = balance_weights(params);
    let q = weights.q.diagonal();
    let k = params.coefficients();
    let rate_squared = k.weight / k.pendulum / (PATIENCE * PATIENCE);
    Weights::diagonal(
        [q[0], q[1], q[2], q[3], q[0] * rate_squared],
        [weights.r[0]],
    )
}

/// The gain that keeps this rig's pendulum upright at the sample period `h` (s): [`dlqr`] on the upright linearisation
/// held over a sample, with [`balance_weights`].
///
/// # Errors
/// Those of [`super::riccati::discrete`]; a rig without gravity, or a period far above the pendulum's own, has no
/// useful answer.
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
