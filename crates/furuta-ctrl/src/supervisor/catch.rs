//! Whether the balance controller would succeed from here.

use crate::controllers::{Controller, StateFeedback};
use crate::real::{Real, c, wrap};
use furuta_model::dynamics::acceleration;
use furuta_model::params::Coefficients;
use furuta_model::{Params, State};

/// Length of the prediction and of its steps, in units of `1/omega` of the pendulum.
const HORIZON: f64 = 6.0;
const STEP: f64 = 0.05;
/// Further from upright than this, no prediction is made, rad.
const FURTHEST: f64 = 1.2;
/// Close enough at the end: angle in rad, speed over omega.
const NEAR_ANGLE: f64 = 0.25;
const NEAR_SPEED: f64 = 0.5;

/// Predicts the balance loop with the rigid-body model and the command limit.
///
/// Costs up to 120 steps of the midpoint rule (two evaluations of the model each), and nothing while the pendulum hangs.
#[derive(Copy, Clone, Debug)]
pub struct Catch<T> {
    coefficients: Coefficients<T>,
    /// What is predicted with: the balance controller itself, or a state feedback that stands in for it.
    pub feedback: StateFeedback<T>,
    /// Largest distance the arm may be from zero on the way, rad.
    arm_angle: T,
    /// Small-angle frequency of the hanging pendulum, rad/s.
    frequency: T,
}

impl<T: Real> Catch<T> {
    /// For a rig with these parameters under `feedback`, the arm staying within `arm_angle` (rad) of zero.
    pub fn new(params: &Params<T>, feedback: StateFeedback<T>, arm_angle: T) -> Self {
        let coefficients = params.coefficients();
        Self {
            coefficients,
            feedback,
            arm_angle,
            frequency: (coefficients.weight / coefficients.pendulum).sqrt(),
        }
    }

    /// Whether the feedback, asked to hold the arm where it is now, brings the pendulum from `x` to upright.
    pub fn succeeds(&self, x: &State<T>) -> bool {
        let alpha = wrap(x.alpha);
        // Falling away from upright: only from very near is that worth a prediction.
        let falling = alpha * x.alpha_dot > c::<T>(0.1);
        !falling && alpha.abs() <= c(FURTHEST) && self.holds(x, x.theta)
    }

    /// Whether the feedback, asked to hold the arm at `theta`, brings the pendulum from `x` to upright, falling or not.
    pub fn holds(&self, x: &State<T>, theta: T) -> bool {
        if !x.is_finite() {
            return false;
        }
        let alpha = wrap(x.alpha);
        let reference = State::new(theta, T::ZERO, T::ZERO, T::ZERO);
        let step = c::<T>(STEP) / self.frequency;
        let half = step * c(0.5);
        let mut x = State { alpha, ..*x };
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        for _ in 0..(HORIZON / STEP) as u32 {
            let u = self.feedback.update(&mut (), &x, &reference, step);
            let middle = x + self.rate(&x, u) * half;
            x = x + self.rate(&middle, u) * step;
            // Written so that a NaN counts as failure.
            let inside = x.theta.abs() < self.arm_angle && x.alpha.abs() < c(1.6);
            if !inside {
                return false;
            }
        }
        x.alpha.abs() < c(NEAR_ANGLE) && x.alpha_dot.abs() < c::<T>(NEAR_SPEED) * self.frequency
    }

    fn rate(&self, x: &State<T>, u: T) -> State<T> {
        let [theta, alpha] = acceleration(&self.coefficients, x, u);
        State::new(x.theta_dot, x.alpha_dot, theta, alpha)
    }
}
