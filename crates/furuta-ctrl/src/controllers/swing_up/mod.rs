//! Energy swing-up.
//!
//! The pendulum's energy (arm at rest) `E = J alpha'^2 / 2 + m g c cos(alpha)` changes with the arm's acceleration as
//! `dE/dt = m L_r c cos(alpha) alpha' theta''` (K. J. Astrom, K. Furuta, *Swinging up a pendulum by energy control*,
//! Automatica 36, 2000), so an arm accelerated in step with `cos(alpha) alpha'` pumps. Four things make it work on rigs
//! with friction, little voltage and heavy pendulums:
//!
//! - The target is not the energy of the upright pendulum but that plus what friction will take on the way up; it
//!   follows from integrating the friction along the ascent once, when the controller is made.
//! - The arm is driven as an oscillator about its centre, a little faster than the pendulum swings: its travel is
//!   bounded by its amplitude, and it is slow when the pendulum nears the top, where a fast arm's centrifugal pull
//!   would hold the pendulum down.
//! - The acceleration is turned into a voltage with the model's inverse (collocated partial feedback linearisation).
//! - On the last ascent, once the speed is nearly the one that just reaches the top, the arm holds the pendulum to it.

mod friction;
mod numbers;
mod tuning;

pub use tuning::SPEC;

use super::{Controller, Design};
use crate::error::ConfigError;
use crate::real::{Real, c, command, is_finite, wrap};
use crate::section::Settings;
use crate::site::Site;
use friction::AscentFriction;
use furuta_model::dynamics::{Angle, bias, gravity, mass_matrix};
use furuta_model::params::Coefficients;
use furuta_model::{Params, State, energy};
use tuning::SwingUpTuning;

/// Half of the arm's travel where nothing is given and the rig leaves it free, rad.
const ARM_RANGE: f64 = 2.16;

/// How far the arm may go in the prediction of a catch, of its range.
const CATCH_RANGE: f64 = 1.82;
/// Largest error of the weight that is learnt, of it.
const LEARN_LIMIT: f64 = 0.3;
/// How much nearer to horizontal the pendulum may fall while the arm is braked, in `sin(alpha)`.
const FALLING: f64 = 0.3;
/// Height, of the pendulum's centre of mass over its distance from the hinge, over which energies are compared: less
/// drowns in encoder steps.
const LEARN_HEIGHT: f64 = 0.25;

/// Pumps energy into the pendulum until it rises to upright, with the arm kept near the reference's `theta`.
///
/// It does not catch the pendulum: see [`crate::supervisor`].
#[derive(Clone, Debug)]
pub struct SwingUp<T> {
    coefficients: Coefficients<T>,
    friction: AscentFriction<T>,
    /// Small-angle frequency of the hanging pendulum, rad/s.
    frequency: T,
    /// Half of the arm's travel, rad.
    arm_range: T,
    /// The arm's acceleration that the motor can give wherever the pendulum is, rad/s^2.
    brake: T,
    command_limit: T,
    tuning: SwingUpTuning<T>,
    /// Speed wanted at the top, rad/s.
    top_speed: T,
}

/// Memory of [`SwingUp`].
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct SwingUpState<T> {
    /// Which way the arm is being driven, 1 or -1.
    direction: T,
    /// For how long, s.
    waited: T,
    /// How often the direction has changed since the swing-up began.
    strokes: u32,
    /// What the pendulum's weight is above the model's, N m.
    heavier: T,
    /// The ascent under way.
    ascent: Option<Ascent<T>>,
}

/// Energy on a piece of an ascent.
#[derive(Copy, Clone, Debug, PartialEq)]
struct Ascent<T> {
    /// The pendulum's energy at the last sample, by the model, J.
    energy: T,
    /// `cos(alpha)` and the arm's speed (rad/s) then.
    cos: T,
    theta_dot: T,
    /// What it has lost that the model does not explain, J.
    lost: T,
    /// How much it has risen meanwhile, of its distance from the hinge.
    risen: T,
}

impl<T: Real> SwingUp<T> {
    /// For a rig with these parameters: the standard settings, the arm swinging about `arm_range` (rad, 1 to 2.2 are
    /// sensible; a heavy pendulum on a short arm needs most) to either side.
    pub fn new(params: &Params<T>, arm_range: T) -> Self {
        Self::tuned(params, arm_range, &Settings::new(&SPEC))
    }

    fn tuned(params: &Params<T>, arm_range: T, settings: &Settings) -> Self {
        let number = |key| T::from_f64(settings.value(key));
        let coefficients = params.coefficients();
        let torque = coefficients.drive * params.motor.command_limit;
        Self {
            coefficients,
            friction: AscentFriction::new(
                &coefficients,
                number(const { SPEC.parameter("friction_margin").settled() }),
            ),
            frequency: (coefficients.weight / coefficients.pendulum).sqrt(),
            arm_range,
            brake: c::<T>(0.63) * torque / (coefficients.arm + coefficients.swing),
            command_limit: params.motor.command_limit,
            top_speed: T::ZERO,
            tuning: SwingUpTuning::of(settings),
        }
    }

    /// The memory for another swing-up after this one: what has been learnt stays.
    pub fn again(&self, state: &SwingUpState<T>) -> SwingUpState<T> {
        SwingUpState {
            strokes: 0,
            ascent: None,
            ..*state
        }
    }

    /// How far from its middle the arm may go while the pendulum is caught, rad.
    pub fn catch_range(&self) -> T {
        c::<T>(CATCH_RANGE) * self.arm_range
    }

    /// Energy (J) the pendulum lacks to coast up to upright; below 0 where it has too much.
    ///
    /// ```
    /// use furuta_ctrl::controllers::SwingUp;
    /// use furuta_model::{Rig, State};
    /// let p = Rig::builtin("shahzad2022-srv02").ok_or("no such rig")?.params; // a pendulum without friction
    /// let missing = SwingUp::new(&p, 1.5).missing_energy(&State::hanging());
    /// assert!((missing - 2.0 * p.pendulum.mass * p.gravity * p.pendulum.com).abs() < 1e-12);
    /// # Ok::<(), &str>(())
    /// ```
    pub fn missing_energy(&self, x: &State<T>) -> T {
        let still = State::new(T::ZERO, x.alpha, T::ZERO, x.alpha_dot);
        let upright = energy::total(&self.coefficients, &State::upright());
        upright + self.friction_ahead(x) - energy::total(&self.coefficients, &still)
    }

    /// Friction's work still to come: from here to upright, or from the bottom where the pendulum is on its way down.
    fn friction_ahead(&self, x: &State<T>) -> T {
        let alpha = wrap(x.alpha);
        let rising = alpha * x.alpha_dot < T::ZERO;
        self.friction.from(if rising {
            alpha.abs().value()
        } else {
            core::f64::consts::PI
        })
    }

    /// Where the arm comes to rest under full braking, rad: the nearer to upright the pendulum, the less of its inertia
    /// the arm carries.
    pub fn stops_at(&self, x: &State<T>) -> T {
        let k = &self.coefficients;
        let sin = Angle::of(wrap(x.alpha)).sin.abs() + c(FALLING);
        let sin = sin.if_less(T::ONE, sin, T::ONE);
        let lighter = (k.arm + k.swing) / (k.arm + k.swing * sin * sin);
        x.theta + x.theta_dot * x.theta_dot.abs() / (c::<T>(2.0) * self.brake * lighter)
    }

    /// Compares the energy that the rising pendulum loses with what the model says: friction that it does not know
    /// counts as weight, as it should on the way up.
    fn learn(&self, state: &mut SwingUpState<T>, x: &State<T>, angle: Angle<T>, h: T) {
        let k = &self.coefficients;
        let alpha = wrap(x.alpha);
        if !(alpha * x.alpha_dot < T::ZERO) || self.tuning.learn == T::ZERO {
            state.ascent = None;
            return;
        }
        let still = State::new(T::ZERO, x.alpha, T::ZERO, x.alpha_dot);
        let energy = energy::total(k, &still);
        let mut now = Ascent {
            energy,
            cos: angle.cos,
            theta_dot: x.theta_dot,
            lost: T::ZERO,
            risen: T::ZERO,
        };
        if let Some(last) = state.ascent {
            // What the arm does on the hinge, and the hinge's friction.
            let pumped = k.coupling * angle.cos * x.alpha_dot * (x.theta_dot - last.theta_dot);
            let thrown = k.swing * angle.sin * angle.cos * x.theta_dot * x.theta_dot * x.alpha_dot;
            let damped = k.pendulum_damping * x.alpha_dot * x.alpha_dot;
            now.lost = last.lost + last.energy - energy + pumped + (thrown - damped) * h;
            now.risen = last.risen + angle.cos - last.cos;
            if now.risen > c(LEARN_HEIGHT) {
                let limit = c::<T>(LEARN_LIMIT) * k.weight;
                let heavier = (now.lost / now.risen).clamp(-limit, limit);
                state.heavier += self.tuning.learn * (heavier - state.heavier);
                (now.lost, now.risen) = (T::ZERO, T::ZERO);
            }
        }
        state.ascent = Some(now);
    }

    /// The pendulum's weight over the model's, as learnt.
    pub fn weight_ratio(&self, state: &SwingUpState<T>) -> T {
        T::ONE + state.heavier / self.coefficients.weight
    }

    /// The same, to pass the top with its share of `fastest` (rad/s), the largest speed that can be caught there.
    #[must_use]
    pub fn aiming_at(self, fastest: T) -> Self {
        Self {
            top_speed: self.tuning.aim * fastest,
            ..self
        }
    }

    /// Energy (J) that the pendulum needs to pass the top as it should, above what it has, with the weight that was
    /// learnt.
    fn shortage(&self, state: &SwingUpState<T>, x: &State<T>, angle: Angle<T>) -> T {
        let faster = c::<T>(0.5) * self.coefficients.pendulum * self.top_speed * self.top_speed;
        self.missing_energy(x) + faster + state.heavier * (T::ONE - angle.cos)
    }

    /// The arm's acceleration that pumps, rad/s^2.
    fn pump(
        &self,
        state: &mut SwingUpState<T>,
        x: &State<T>,
        theta: T,
        angle: Angle<T>,
        h: T,
    ) -> T {
        let t = &self.tuning;
        let w = self.frequency;
        let stroke = angle.cos * x.alpha_dot / w;
        // A pendulum that swings less than the deadband would never be pumped: after a period without a change, any
        // stroke will do.
        state.waited += h;
        let waiting =
            (T::ONE - state.waited * w / c(core::f64::consts::TAU)).clamp(T::ZERO, T::ONE);
        if stroke.abs() > t.deadband * waiting {
            let direction = if stroke > T::ZERO { T::ONE } else { -T::ONE };
            if direction != state.direction {
                state.waited = T::ZERO;
                state.strokes = state.strokes.saturating_add(1);
            }
            state.direction = direction;
        }
        let unit = self.coefficients.weight + self.coefficients.weight;
        let shortage = self.shortage(state, x, angle) / unit;
        let drive = (shortage / t.full_drive).clamp(-T::ONE, T::ONE) * state.direction;
        let target = t.drive * self.arm_range * drive * variation(state.strokes);
        let arm = t.arm_frequency * w;
        arm * (arm * (target - theta) - c::<T>(2.0) * t.arm_damping * x.theta_dot)
    }

    /// The arm's acceleration that holds the pendulum to the ascent, where it is close to it.
    fn ascend(&self, state: &SwingUpState<T>, x: &State<T>, angle: Angle<T>) -> Option<T> {
        let k = &self.coefficients;
        let alpha = wrap(x.alpha);
        if alpha.abs() > self.tuning.ascent_angle || !(alpha * x.alpha_dot < T::ZERO) {
            return None;
        }
        let two = c::<T>(2.0);
        let climb = (k.weight + state.heavier) * (T::ONE - angle.cos) + self.friction_ahead(x);
        let wanted = (two * climb / k.pendulum + self.top_speed * self.top_speed).sqrt();
        let excess = x.alpha_dot.abs() - wanted;
        if excess.abs() > self.tuning.ascent_window * self.frequency {
            return None;
        }
        let toward_top = if alpha > T::ZERO { -T::ONE } else { T::ONE };
        // M22 alpha'' = M_c cos(alpha) theta'' + ...: brake the excess, and cancel the arm's centrifugal pull.
        let brake = k.pendulum * self.tuning.ascent_rate * self.frequency * excess * toward_top;
        let centrifugal = k.swing * angle.sin * angle.cos * x.theta_dot * x.theta_dot;
        Some(-(brake + centrifugal) / (k.coupling * angle.cos))
    }

    /// The acceleration, replaced by full braking where the arm could not be stopped within its range otherwise.
    fn within_range(&self, acceleration: T, theta: T, theta_dot: T) -> T {
        let stop = theta + theta_dot * theta_dot.abs() / (self.brake + self.brake);
        let beyond = stop.abs() - self.tuning.brake_at * self.arm_range;
        if !(beyond > T::ZERO) {
            return acceleration;
        }
        // What stops it on the way that is left, where that is more: a pendulum that falls drags the arm along.
        let left = self.catch_range() - theta.abs();
        let left = left.if_less(c(0.1), c(0.1), left);
        let needed = theta_dot * theta_dot / (left + left);
        let most = needed.if_less(self.brake, self.brake, needed);
        // Comes in over 0.1 rad, so that the brake does not chatter.
        let brake = most * (beyond * c(10.0)).clamp(T::ZERO, T::ONE);
        if stop > T::ZERO {
            acceleration.if_less(-brake, acceleration, -brake)
        } else {
            acceleration.if_less(brake, brake, acceleration)
        }
    }

    /// The command under which the arm accelerates so, the pendulum moving freely.
    fn command_for(&self, acceleration: T, x: &State<T>, angle: Angle<T>) -> T {
        let k = &self.coefficients;
        let (m, b, g) = (mass_matrix(k, angle), bias(k, angle, x), gravity(k, angle));
        let swing = -(m.coupling * acceleration + b[1] + g[1] + k.pendulum_damping * x.alpha_dot)
            / m.pendulum;
        (m.arm * acceleration + m.coupling * swing + b[0] + g[0] + k.arm_damping * x.theta_dot)
            / k.drive
    }
}

impl<T: Real> Design for SwingUp<T> {
    fn design(settings: &Settings, site: &Site<'_>) -> Result<Self, ConfigError> {
        let widest = match site.limits.arm_angle {
            Some(limit) => ARM_RANGE.min(limit / CATCH_RANGE),
            None => ARM_RANGE,
        };
        let arm_range = settings
            .number(const { SPEC.parameter("arm_range").optional() })
            .unwrap_or(widest);
        Ok(Self {
            command_limit: T::from_f64(site.command_limit),
            ..Self::tuned(&site.params.cast(), T::from_f64(arm_range), settings)
        })
    }
}

impl<T: Real> Controller<T> for SwingUp<T> {
    type State = SwingUpState<T>;

    fn start(&self) -> SwingUpState<T> {
        SwingUpState {
            direction: T::ONE,
            waited: T::ZERO,
            strokes: 0,
            heavier: T::ZERO,
            ascent: None,
        }
    }

    fn update(&self, state: &mut SwingUpState<T>, x: &State<T>, reference: &State<T>, h: T) -> T {
        let theta = x.theta - reference.theta;
        if !x.is_finite() || !is_finite(theta) {
            return T::ZERO;
        }
        let angle = Angle::of(wrap(x.alpha));
        self.learn(state, x, angle, h);
        let wanted = match self.ascend(state, x, angle) {
            Some(acceleration) => acceleration,
            None => self.pump(state, x, theta, angle, h),
        };
        let acceleration = self.within_range(wanted, theta, x.theta_dot);
        let u = self.command_for(acceleration, x, angle);
        // Comes in over twice its own size, so that it does not chatter.
        let push = self.tuning.break_away * self.command_limit;
        let push = (u * c(0.5)).clamp(-push, push);
        command(u + push, self.command_limit)
    }
}

/// What the drive is multiplied with: 1 at first, then different at every stroke. Pendulum and drive can settle into a
/// swing below the top that repeats itself for ever; strokes that differ leave it.
fn variation<T: Real>(strokes: u32) -> T {
    const SAME: u32 = 8;
    /// The golden ratio's fractional part: its multiples fill an interval evenly.
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    if strokes <= SAME {
        return T::ONE;
    }
    // Few enough for a product exact in either precision.
    let turns = f64::from(strokes % 1000) * GOLDEN;
    #[allow(clippy::cast_possible_truncation)]
    let share = turns - f64::from(turns as u32);
    T::from_f64(0.6 + 0.6 * share)
}
