//! Time-varying LQR along a course.

use super::course::Course;
use super::model::Model;
use furuta_ctrl::design::{DesignError, Weights, lqr};
use furuta_model::Linear;
use nalgebra::{RowSVector, SMatrix};

/// Longest step of the recursion, s: gains are those of continuous time.
const STEP: f64 = 1e-3;

/// The gain at each point of the course: minimises the integral of `x'Qx + R u^2` of the deviation, and after the end
/// what the LQR about upright costs. By Riccati's recursion backwards over steps of a millisecond at most.
pub(super) fn gains(
    model: &Model,
    course: &Course,
    upright: &Linear,
    weights: &Weights<f64, 4, 1>,
) -> Result<Vec<RowSVector<f64, 4>>, DesignError> {
    let last = lqr(&upright.a, &upright.b, weights)?;
    let n = course.u.len();
    let interval = course.interval();
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let steps = (interval / STEP).ceil().clamp(1.0, 1e4) as usize;
    let h = interval / steps as f64;
    let mut gains = vec![last.gain; n + 1];
    let mut cost: SMatrix<f64, 4, 4> = last.cost;
    for k in (0..n).rev() {
        let mut x = course.x[k];
        let mut passed = Vec::with_capacity(steps);
        for _ in 0..steps {
            let step = model.step(&x, course.u[k], h);
            x = step.x;
            passed.push(step);
        }
        for step in passed.iter().rev() {
            let (a, b) = (step.a, step.b);
            let cheaper = b.transpose() * cost;
            let weight = weights.r[0] * h + (cheaper * b)[0];
            let gain = cheaper * a / weight;
            cost = weights.q * h + a.transpose() * cost * (a - b * gain);
            cost = (cost + cost.transpose()) * 0.5;
            gains[k] = gain;
        }
    }
    Ok(gains)
}
