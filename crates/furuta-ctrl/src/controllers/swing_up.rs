//! Energy swing-up.
//!
//! The pendulum's energy (arm at rest) `E = J alpha'^2 / 2 + m g c cos(alpha)` changes with the arm's acceleration as
//! `dE/dt = m L_r c cos(alpha) alpha' theta''` (K. J. Astrom, K. Furuta, *Swinging up a pendulum by energy control*, Automatica 36,
//! 2000), so an arm accelerated in step with `cos(alpha) alpha'` pumps. Four things make it work on rigs with friction, little
//! voltage and heavy pendulums:
//!
//! - The target is not the energy of the upright pendulum but that plus what friction will take on the way up; it follows from
//!   integrating the friction along the ascent once, when the controller is made.
//! - The arm is driven as an oscillator about its centre, a little faster than the pendulum swings: its travel is bounded by its
//!   amplitude, and it is slow when the pendulum nears the top, where a fast arm's centrifugal pull would hold the pendulum down.
//! - The acceleration is turned into a voltage with the model's inverse (collocated partial feedback linearisation).
//! - On the last ascent, once the speed is nearly the one that just reaches the top, the arm holds the pendulum to it.

use super::{Controller, Design};
use crate::config::ConfigError;
use crate::real::{Real, c, command, is_finite, wrap};
use crate::settings::{ParameterSpec, Settings, Spec};
use crate::site::Site;
use furuta_model::dynamics::{Angle, bias, gravity, mass_matrix};
use furuta_model::params::Coefficients;
use furuta_model::{Params, State, energy};

/// Intervals of the table over `0..=pi`.
const ASCENT: usize = 64;

// Found by a random search over all of them at once, for the built-in rigs at 200 to 1000 Hz, with their encoders, one sample of delay and
// eight starts about hanging; the score was the time until the catch. All are ratios: angles in
// rad, times in units of the pendulum's own 1/omega, energies in units of 2 m g c.
/// Amplitude of the arm's target, of the arm's range.
const DRIVE: f64 = 1.05;
/// Frequency of the arm's oscillator, of the pendulum's.
const ARM_FREQUENCY: f64 = 1.472;
/// Its damping ratio.
const ARM_DAMPING: f64 = 0.21;
/// Energy error at which the amplitude is full.
const FULL_DRIVE: f64 = 0.433;
/// `cos(alpha) alpha' / omega` beyond which the direction may change: keeps encoder steps at rest from chattering.
const DIRECTION_DEADBAND: f64 = 0.151;
/// Friction's share of the target, of what the table says: too fast can be caught, too slow falls back.
const FRICTION_MARGIN: f64 = 1.643;
/// On the last ascent: largest distance from the speed wanted, over omega, and how quickly it is driven to 0.
const ASCENT_WINDOW: f64 = 0.087;
const ASCENT_RATE: f64 = 1.732;
/// Where the last ascent begins, rad from upright.
const ASCENT_ANGLE: f64 = 1.226;
/// The arm is braked before it passes this share of its range.
const BRAKE_AT: f64 = 1.4;
/// How far the arm may go in the prediction of a catch, of its range.
const CATCH_RANGE: f64 = 1.82;

/// Half of the arm's travel where nothing is given and the rig leaves it free, rad.
const ARM_RANGE: f64 = 2.16;

/// What a controller file may say of it.
pub static SPEC: Spec = Spec {
    id: "swing_up",
    sentence: "Energy swing-up, the arm kept within a range",
    parameters: &[ParameterSpec::number(
        "arm_range",
        "rad",
        0.1,
        20.0,
        "the arm swings so far to either side, and is braked before 1.4 times that; 2.16 or what the arm's limit allows if left out",
    )],
};

/// Pumps energy into the pendulum until it rises to upright, with the arm kept near the reference's `theta`.
///
/// It does not catch the pendulum: see [`crate::supervisor`].
#[derive(Clone, Debug)]
pub struct SwingUp<T> {
    coefficients: Coefficients<T>,
    /// Friction's work from `i pi / 64` to upright along the ascent, J.
    friction: [T; ASCENT + 1],
    /// Small-angle frequency of the hanging pendulum, rad/s.
    frequency: T,
    /// Half of the arm's travel, rad.
    arm_range: T,
    /// The arm's acceleration that the motor can give wherever the pendulum is, rad/s^2.
    brake: T,
    command_limit: T,
}

/// Memory of [`SwingUp`].
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct SwingUpState<T> {
    /// Which way the arm is being driven, 1 or -1.
    direction: T,
}

impl<T: Real> SwingUp<T> {
    /// For a rig with these parameters, the arm swinging about `arm_range` (rad, 1 to 2.2 are sensible; a heavy pendulum on a short arm needs most) to either side and braked
    /// before 1.4 times that.
    pub fn new(params: &Params<T>, arm_range: T) -> Self {
        let coefficients = params.coefficients();
        let torque = coefficients.drive * params.motor.command_limit;
        Self {
            coefficients,
            friction: friction_of_ascent(&coefficients),
            frequency: (coefficients.weight / coefficients.pendulum).sqrt(),
            arm_range,
            brake: c::<T>(0.63) * torque / (coefficients.arm + coefficients.swing),
            command_limit: params.motor.command_limit,
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
        let share = if rising {
            alpha.abs().value() / core::f64::consts::PI
        } else {
            1.0
        };
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            clippy::cast_precision_loss
        )]
        let index = (share * ASCENT as f64 + 0.5) as usize;
        self.friction[index.min(ASCENT)]
    }

    /// The arm's acceleration that pumps, rad/s^2.
    fn pump(&self, state: &mut SwingUpState<T>, x: &State<T>, theta: T, angle: Angle<T>) -> T {
        let w = self.frequency;
        let stroke = angle.cos * x.alpha_dot / w;
        if stroke.abs() > c(DIRECTION_DEADBAND) {
            state.direction = if stroke > T::ZERO { T::ONE } else { -T::ONE };
        }
        let shortage =
            self.missing_energy(x) / (self.coefficients.weight + self.coefficients.weight);
        let drive = (shortage / c(FULL_DRIVE)).clamp(-T::ONE, T::ONE) * state.direction;
        let target = c::<T>(DRIVE) * self.arm_range * drive;
        let arm = c::<T>(ARM_FREQUENCY) * w;
        arm * (arm * (target - theta) - c::<T>(2.0 * ARM_DAMPING) * x.theta_dot)
    }

    /// The arm's acceleration that holds the pendulum to the ascent, where it is close to it.
    fn ascend(&self, x: &State<T>, angle: Angle<T>) -> Option<T> {
        let k = &self.coefficients;
        let alpha = wrap(x.alpha);
        if alpha.abs() > c(ASCENT_ANGLE) || !(alpha * x.alpha_dot < T::ZERO) {
            return None;
        }
        let two = c::<T>(2.0);
        let climb = k.weight * (T::ONE - angle.cos) + self.friction_ahead(x);
        let wanted = (two * climb / k.pendulum).sqrt();
        let excess = x.alpha_dot.abs() - wanted;
        if excess.abs() > c::<T>(ASCENT_WINDOW) * self.frequency {
            return None;
        }
        let toward_top = if alpha > T::ZERO { -T::ONE } else { T::ONE };
        // M22 alpha'' = M_c cos(alpha) theta'' + ...: brake the excess, and cancel the arm's centrifugal pull.
        let brake = k.pendulum * c(ASCENT_RATE) * self.frequency * excess * toward_top;
        let centrifugal = k.swing * angle.sin * angle.cos * x.theta_dot * x.theta_dot;
        Some(-(brake + centrifugal) / (k.coupling * angle.cos))
    }

    /// The acceleration, replaced by full braking where the arm could not be stopped within its range otherwise.
    fn within_range(&self, acceleration: T, theta: T, theta_dot: T) -> T {
        let stop = theta + theta_dot * theta_dot.abs() / (self.brake + self.brake);
        let beyond = stop.abs() - c::<T>(BRAKE_AT) * self.arm_range;
        if !(beyond > T::ZERO) {
            return acceleration;
        }
        // Comes in over 0.1 rad, so that the brake does not chatter.
        let brake = self.brake * (beyond * c(10.0)).clamp(T::ZERO, T::ONE);
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
        let room = match site.limits.arm_angle {
            Some(limit) => ARM_RANGE.min(limit / CATCH_RANGE),
            None => ARM_RANGE,
        };
        let arm_range = settings.number("arm_range").unwrap_or(room);
        Ok(Self {
            command_limit: T::from_f64(site.command_limit),
            ..Self::new(&site.params.cast(), T::from_f64(arm_range))
        })
    }
}

impl<T: Real> Controller<T> for SwingUp<T> {
    type State = SwingUpState<T>;

    fn start(&self) -> SwingUpState<T> {
        SwingUpState { direction: T::ONE }
    }

    fn update(&self, state: &mut SwingUpState<T>, x: &State<T>, reference: &State<T>, _: T) -> T {
        let theta = x.theta - reference.theta;
        if !x.is_finite() || !is_finite(theta) {
            return T::ZERO;
        }
        let angle = Angle::of(wrap(x.alpha));
        let wanted = match self.ascend(x, angle) {
            Some(acceleration) => acceleration,
            None => self.pump(state, x, theta, angle),
        };
        let acceleration = self.within_range(wanted, theta, x.theta_dot);
        command(self.command_for(acceleration, x, angle), self.command_limit)
    }
}

/// Friction's work (J) from each angle of the table up to upright, along the ascent that just gets there with the arm at rest:
/// `dW/dalpha = b_p |alpha'|`, `J alpha'^2 / 2 = W + m g c (1 - cos(alpha))`.
fn friction_of_ascent<T: Real>(k: &Coefficients<T>) -> [T; ASCENT + 1] {
    const STEPS: usize = 8;
    let step = c::<T>(core::f64::consts::PI / (ASCENT * STEPS) as f64);
    // At upright both sides vanish; the ascent leaves along the stable direction alpha' = -rate alpha.
    let half = k.pendulum_damping / (k.pendulum + k.pendulum);
    let rate = half + (half * half + k.weight / k.pendulum).sqrt();
    let mut work = T::ZERO;
    let mut middle = step * c(0.5);
    let mut table = [T::ZERO; ASCENT + 1];
    for (i, entry) in table.iter_mut().enumerate() {
        *entry = work * c(FRICTION_MARGIN);
        for _ in 0..STEPS {
            let kinetic = work + k.weight * (T::ONE - middle.sin_cos().1);
            let speed = if i == 0 {
                rate * middle
            } else {
                (c::<T>(2.0) * kinetic / k.pendulum).sqrt()
            };
            work += k.pendulum_damping * speed * step;
            middle += step;
        }
    }
    table
}
