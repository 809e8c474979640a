//! Whether the balance controller would succeed from here.

use crate::compensation::holding_voltage;
use crate::controllers::{Controller, StateFeedback};
use crate::numbers::Number;
use crate::real::{Real, c, wrap};
use furuta_model::params::Coefficients;
use furuta_model::{Params, Plant, State};

/// Length of the prediction and of its steps, in units of `1/omega` of the pendulum.
const HORIZON: f64 = 6.0;
const STEP: f64 = 0.05;
/// Close enough at the end: angle in rad, speed over omega.
const NEAR_ANGLE: f64 = 0.25;
const NEAR_SPEED: f64 = 0.5;

/// Predicts the balance loop with the model, its springs, cables and tilt, and the command limit.
///
/// Costs up to 120 steps of the midpoint rule (two evaluations of the model each), and nothing while the pendulum
/// hangs.
#[derive(Clone, Debug)]
pub struct Catch<T: Real> {
    /// Without friction and voltage maps with a kink.
    plant: Plant<T>,
    /// Whether the voltage is added that holds the arm where it is asked to be.
    holds: bool,
    /// What is predicted with: the balance controller itself, or its surrogate.
    pub feedback: StateFeedback<T>,
    /// Largest distance the arm may be from zero on the way, rad.
    arm_angle: T,
    /// Small-angle frequency of the hanging pendulum, rad/s.
    frequency: T,
    /// Further from upright than this, no prediction is made, rad.
    furthest: T,
    /// By how much the weight may be wrong, of it.
    error: T,
}

impl<T: Real> Catch<T> {
    /// For a rig with these parameters and without effects under `feedback`, the arm staying within `arm_angle` (rad)
    /// of zero.
    pub fn new(params: &Params<T>, feedback: StateFeedback<T>, arm_angle: T) -> Self {
        let coefficients = params.coefficients();
        Self {
            plant: Plant::without_effects(coefficients),
            holds: false,
            feedback,
            arm_angle,
            frequency: (coefficients.weight / coefficients.pendulum).sqrt(),
            furthest: c(1.2),
            error: T::ZERO,
        }
    }

    /// The same on a plant with effects, none of them dry friction; `holds` says whether the voltage is added that
    /// holds the arm where it is asked to be against them.
    #[must_use]
    pub fn on(self, plant: Plant<T>, holds: bool) -> Self {
        Self {
            plant,
            holds,
            ..self
        }
    }

    /// The same, catching no further than `furthest` (rad) from upright, and where the weight may be wrong by the share
    /// `error`.
    #[must_use]
    pub fn within(self, furthest: T, error: T) -> Self {
        Self {
            furthest,
            error,
            ..self
        }
    }

    /// Every number that its prediction depends on, by name; its plant is [`Catch::plant()`].
    pub fn numbers(&self, put: &mut impl FnMut(&'static str, Number<'_, T>)) {
        put("CATCH_GAIN", Number::Real(&self.feedback.gain));
        put("CATCH_HOLDS", Number::Whole(u32::from(self.holds)));
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        put("CATCH_STEPS", Number::Whole((HORIZON / STEP) as u32));
        let single = [
            ("CATCH_COMMAND_LIMIT", self.feedback.command_limit),
            ("CATCH_ARM_ANGLE", self.arm_angle),
            ("CATCH_STEP", c::<T>(STEP) / self.frequency),
            ("CATCH_NEAR_ANGLE", c(NEAR_ANGLE)),
            ("CATCH_NEAR_SPEED", c::<T>(NEAR_SPEED) * self.frequency),
            ("CATCH_FURTHEST", self.furthest),
            ("CATCH_ERROR", self.error),
        ];
        for (name, value) in single {
            put(name, Number::Real(&[value]));
        }
    }

    /// What the prediction takes for the rig: no dry friction, no voltage map with a kink.
    pub fn plant(&self) -> &Plant<T> {
        &self.plant
    }

    /// The largest speed (rad/s) at the top, the arm resting at its middle, that the feedback can catch.
    pub fn fastest(&self) -> T {
        let step = c::<T>(0.05) * self.frequency;
        let mut speed = T::ZERO;
        for _ in 0..40 {
            let x = State::new(T::ZERO, T::ZERO, T::ZERO, speed + step);
            if !self.holds(&x, T::ZERO) {
                break;
            }
            speed += step;
        }
        speed
    }

    /// Whether the feedback, asked to hold the arm where it is now, brings the pendulum from `x` to upright.
    pub fn succeeds(&self, x: &State<T>) -> bool {
        self.travel(x).is_some()
    }

    /// How far the arm moves (rad) while the feedback, asked to hold it where it is now, brings the pendulum from `x`
    /// to upright; `None` where it does not.
    pub fn travel(&self, x: &State<T>) -> Option<T> {
        self.travel_weighing(x, T::ONE)
    }

    /// The same with a pendulum of `times` the weight and of the same inertia.
    pub(crate) fn travel_weighing(&self, x: &State<T>, times: T) -> Option<T> {
        let alpha = wrap(x.alpha);
        // Falling away from upright: only from very near is that worth a prediction.
        let falling = alpha * x.alpha_dot > c::<T>(0.1);
        if falling || !(alpha.abs() <= self.furthest) {
            return None;
        }
        let travel = self.prediction(x, x.theta, times)?;
        let with = |share: T| self.holds_weighing(x, x.theta, share * times);
        let sure = self.error == T::ZERO || with(T::ONE + self.error) && with(T::ONE - self.error);
        sure.then_some(travel)
    }

    /// Whether the feedback, asked to hold the arm at `theta`, brings the pendulum from `x` to upright, falling or not.
    pub fn holds(&self, x: &State<T>, theta: T) -> bool {
        self.holds_weighing(x, theta, T::ONE)
    }

    /// The same with a pendulum of `times` the weight and of the same inertia.
    pub(crate) fn holds_weighing(&self, x: &State<T>, theta: T, times: T) -> bool {
        self.prediction(x, theta, times).is_some()
    }

    /// How far the arm goes from where it is, rad, the pendulum of `times` the weight; `None` where it does not come
    /// up.
    fn prediction(&self, x: &State<T>, theta: T, times: T) -> Option<T> {
        if !x.is_finite() {
            return None;
        }
        let from = x.theta;
        let mut travel = T::ZERO;
        let alpha = wrap(x.alpha);
        let reference = State::new(theta, T::ZERO, T::ZERO, T::ZERO);
        let step = c::<T>(STEP) / self.frequency;
        let half = step * c(0.5);
        let mut x = State { alpha, ..*x };
        let holding = if self.holds {
            holding_voltage(&self.plant, theta)
        } else {
            T::ZERO
        };
        let limit = self.feedback.command_limit;
        let coefficients = Coefficients {
            weight: times * self.plant.coefficients.weight,
            ..self.plant.coefficients
        };
        // There is nothing that could stick.
        let rate = |x: &State<T>, u: T| self.plant.rate_with(&coefficients, T::ZERO, x, u, T::ONE);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        for _ in 0..(HORIZON / STEP) as u32 {
            let mut u = self.feedback.update(&mut (), &x, &reference, step);
            if self.holds {
                u = (u + holding).clamp(-limit, limit);
            }
            let middle = x + rate(&x, u) * half;
            x = x + rate(&middle, u) * step;
            // Written so that a NaN counts as failure.
            let inside = x.theta.abs() < self.arm_angle && x.alpha.abs() < c(1.6);
            if !inside {
                return None;
            }
            let gone = (x.theta - from).abs();
            travel = travel.if_less(gone, gone, travel);
        }
        let near = x.alpha.abs() < c(NEAR_ANGLE)
            && x.alpha_dot.abs() < c::<T>(NEAR_SPEED) * self.frequency;
        near.then_some(travel)
    }
}
