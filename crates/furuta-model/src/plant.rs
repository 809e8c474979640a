//! A rig with its effects, stepped under a held command.

use crate::dynamics::{self, Angle};
use crate::effects::{Acts, Effect, Instant, Law};
use crate::integrate::{Fixed, Length, Stage, Variable, rk4};
use crate::params::{Coefficients, Params};
use crate::scalar::Scalar;
use crate::state::State;
use arrayvec::ArrayVec;

/// The most effects one plant can have.
pub const MAX_EFFECTS: usize = 8;

/// The most samples a delayed command can be late.
pub const MAX_DELAY_SAMPLES: usize = 126;
const HISTORY: usize = MAX_DELAY_SAMPLES + 2;

/// A rig: parameters and effects, both fixed. What changes lies in [`PlantState`], so one plant serves many rollouts.
#[derive(Clone, Debug)]
pub struct Plant<S> {
    /// What the equations of motion see of the parameters.
    pub coefficients: Coefficients<S>,
    effects: ArrayVec<Effect<S>, MAX_EFFECTS>,
    acts: Acts,
    delay: S,
    lag: S,
}

/// Everything about a plant that changes: time, mechanical state, and the memory of its effects.
#[derive(Clone, Debug)]
pub struct PlantState<S> {
    /// Time since the run began, s.
    pub t: S,
    /// Mechanical state.
    pub x: State<S>,
    /// Voltage at the motor behind a lag (equal to the command where there is none), V.
    pub voltage: S,
    history: History<S>,
}

/// How fast dry friction stops an axis, per step: the faster, the less it acts before the stop; RK4 is stable up to 2.78.
const STICK: f64 = 2.0;

/// The last commands, newest first by age.
#[derive(Clone, Debug)]
struct History<S> {
    past: [S; HISTORY],
    newest: usize,
}

impl<S: Scalar> History<S> {
    fn push(&mut self, u: S) {
        self.newest = (self.newest + 1) % HISTORY;
        self.past[self.newest] = u;
    }

    fn ago(&self, samples: usize) -> S {
        self.past[(self.newest + HISTORY - samples.min(HISTORY - 1)) % HISTORY]
    }
}

/// Why a plant cannot be built or stepped as asked.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum PlantError {
    /// More effects than a plant can hold.
    TooManyEffects {
        /// How many were asked for.
        given: usize,
    },
    /// A delay longer than the plant remembers at this sample period.
    DelayTooLong {
        /// The delay, s.
        delay: f64,
        /// The longest possible one, s.
        longest: f64,
    },
    /// A sample period that is not a positive number of at most a second.
    SamplePeriod {
        /// What was asked for, s.
        period: f64,
    },
}

impl core::fmt::Display for PlantError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::TooManyEffects { given } => {
                write!(
                    f,
                    "{given} effects on one plant: at most {MAX_EFFECTS} are possible"
                )
            }
            Self::DelayTooLong { delay, longest } => write!(
                f,
                "a delay of {delay} s is longer than the {longest} s the plant remembers at this sample period: use a longer period"
            ),
            Self::SamplePeriod { period } => {
                write!(
                    f,
                    "a sample period of {period} s is outside the allowed range (0, 1] s"
                )
            }
        }
    }
}

impl core::error::Error for PlantError {}

impl<S: Scalar> Plant<S> {
    /// A plant with these parameters and effects. Effects that are exactly off are left out.
    ///
    /// # Errors
    /// More than [`MAX_EFFECTS`] effects.
    pub fn new(params: &Params<S>, effects: &[Effect<S>]) -> Result<Self, PlantError> {
        Self::from_coefficients(params.coefficients(), effects)
    }

    /// The same from what the equations of motion see of the parameters: what a fit varies.
    ///
    /// # Errors
    /// More than [`MAX_EFFECTS`] effects.
    pub fn from_coefficients(
        coefficients: Coefficients<S>,
        effects: &[Effect<S>],
    ) -> Result<Self, PlantError> {
        let mut plant = Self {
            coefficients,
            effects: ArrayVec::new(),
            acts: Acts::NOWHERE,
            delay: S::ZERO,
            lag: S::ZERO,
        };
        for effect in effects.iter().filter(|e| !e.is_off()) {
            plant
                .effects
                .try_push(*effect)
                .map_err(|_| PlantError::TooManyEffects {
                    given: effects.len(),
                })?;
            plant.acts = plant.acts.and(effect.spec().acts);
            plant.delay += effect.delay();
            plant.lag += effect.lag();
            plant.coefficients = effect.shape(plant.coefficients);
        }
        // Whatever order they are given in, effects act in that of the catalogue.
        plant.effects.sort_unstable_by_key(Effect::rank);
        Ok(plant)
    }

    /// The effects that are not off.
    #[must_use]
    pub fn effects(&self) -> &[Effect<S>] {
        &self.effects
    }

    /// The same plant in another scalar, all parameters constants.
    #[must_use]
    pub fn cast<T: Scalar>(&self) -> Plant<T> {
        Plant {
            coefficients: self.coefficients.cast(),
            effects: self.effects.iter().map(Effect::cast).collect(),
            acts: self.acts,
            delay: T::from_f64(self.delay.value()),
            lag: T::from_f64(self.lag.value()),
        }
    }

    /// Whether the plant can be stepped with this sample period.
    ///
    /// # Errors
    /// A period outside (0, 1] s, or so short that the command's delay spans more than [`MAX_DELAY_SAMPLES`] samples.
    pub fn check_period(&self, period: f64) -> Result<(), PlantError> {
        if !(period > 0.0 && period <= 1.0) {
            return Err(PlantError::SamplePeriod { period });
        }
        #[allow(clippy::cast_precision_loss)]
        let longest = period * MAX_DELAY_SAMPLES as f64;
        if self.delay.value() > longest {
            return Err(PlantError::DelayTooLong {
                delay: self.delay.value(),
                longest,
            });
        }
        Ok(())
    }

    /// The plant's state with the mechanical state `x`, after a long time without command.
    #[must_use]
    pub fn rest(&self, x: State<S>) -> PlantState<S> {
        self.rest_under(x, S::ZERO)
    }

    /// The plant's state with the mechanical state `x`, after a long time under the command `u`.
    #[must_use]
    pub fn rest_under(&self, x: State<S>, u: S) -> PlantState<S> {
        PlantState {
            t: S::ZERO,
            x,
            voltage: self.mapped(S::ZERO, u),
            history: History {
                past: [u; HISTORY],
                newest: 0,
            },
        }
    }

    /// The plant's state with the mechanical state `x` at time `t` (s), after the commands `past` (oldest first, each held for `h` seconds).
    ///
    /// What the effects remember comes from the commands alone, so a recording can be entered at any sample.
    #[must_use]
    pub fn resume(&self, x: State<S>, t: S::Real, past: &[S::Real], h: S::Real) -> PlantState<S> {
        let first = past.first().map_or(S::ZERO, |u| S::from_real(*u));
        let mut s = self.rest_under(x, first);
        let lagging = self.acts.includes(Acts::LAG);
        if lagging || self.acts.includes(Acts::DELAY) {
            #[allow(clippy::cast_precision_loss)]
            let mut ago = past.len() as f64;
            let decay = (-(S::from_real(h) / self.lag)).exp();
            for u in past {
                let u = S::from_real(*u);
                s.history.push(u);
                if lagging {
                    let now = S::from_real(t) - S::from_real(h).scale(S::Real::from_f64(ago));
                    let target = self.mapped(now, self.delayed(&s, u, h));
                    s.voltage = target + (s.voltage - target) * decay;
                }
                ago -= 1.0;
            }
        }
        s.t = S::from_real(t);
        s
    }

    /// The command that acts, on average over a step, after the delay.
    fn delayed(&self, s: &PlantState<S>, u: S, h: S::Real) -> S {
        if !self.acts.includes(Acts::DELAY) {
            return u;
        }
        let (samples, first) = self.split_delay(h);
        let (older, newer) = (s.history.ago(samples + 1), s.history.ago(samples));
        newer + (older - newer) * first / S::from_real(h)
    }

    /// The delay as whole samples and the seconds left over.
    fn split_delay(&self, h: S::Real) -> (usize, S) {
        let whole = libm::floor(self.delay.value() / h.value());
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let samples = if whole > 0.0 { whole as usize } else { 0 };
        (
            samples,
            self.delay - S::from_real(h).scale(S::Real::from_f64(whole)),
        )
    }

    /// Advances by `h` seconds under the command `u` (V): classical RK4, one step, two where a delayed command changes in between.
    #[inline]
    pub fn step(&self, s: &mut PlantState<S>, u: S, h: S::Real) {
        if self.acts.includes(Acts::DELAY) {
            self.step_delayed(s, u, h);
        } else {
            self.advance(s, u, Fixed(h), h);
        }
    }

    fn step_delayed(&self, s: &mut PlantState<S>, u: S, h: S::Real) {
        s.history.push(u);
        // The older command still acts for `first` seconds of this step.
        let (samples, first) = self.split_delay(h);
        let (older, newer) = (s.history.ago(samples + 1), s.history.ago(samples));
        if older == newer {
            self.advance(s, newer, Fixed(h), h);
            return;
        }
        if first.value() > 0.0 {
            self.advance(s, older, Variable(first), h);
        }
        self.advance(s, newer, Variable(S::from_real(h) - first), h);
    }

    /// The motor's voltage for a steady command `u` at the run's start, V.
    #[must_use]
    pub fn volts(&self, u: S) -> S {
        self.mapped(S::ZERO, u)
    }

    /// The command behind all maps without memory.
    #[inline(always)]
    fn mapped(&self, t: S, u: S) -> S {
        if !self.acts.includes(Acts::VOLTAGE) {
            return u;
        }
        self.effects.iter().fold(u, |u, e| e.voltage(t, u))
    }

    #[inline(always)]
    fn advance<H: Length<S>>(&self, s: &mut PlantState<S>, u: S, h: H, period: S::Real) {
        let length = h.of(S::ONE);
        let half = h.half().of(S::ONE);
        let target = self.mapped(s.t + half, u);
        let mut volts = [target; 3];
        if self.acts.includes(Acts::LAG) {
            // Exact for a held command, for any time constant: v = target + (v0 - target) e^(-t / time constant).
            let decay = (-(half / self.lag)).exp();
            let gap = s.voltage - target;
            let middle = gap * decay;
            volts = [s.voltage, target + middle, target + middle * decay];
        }
        let stick_rate = S::Real::from_f64(STICK) / period;
        let t = s.t;
        s.x = rk4(s.x, h, |stage, x| match stage {
            Stage::Start => self.rate(t, x, volts[0], stick_rate),
            Stage::Middle => self.rate(t + half, x, volts[1], stick_rate),
            Stage::End => self.rate(t + length, x, volts[2], stick_rate),
        });
        s.voltage = volts[2];
        s.t += length;
    }

    /// `dx/dt` at time `t` with `volts` at the motor.
    ///
    /// `stick_rate` (1/s) is how fast dry friction stops an axis that it can hold: [`Plant::step`] takes two over the step's
    /// length, which RK4 integrates stably.
    #[inline(always)]
    #[must_use]
    pub fn rate(&self, t: S, x: &State<S>, volts: S, stick_rate: S::Real) -> State<S> {
        let c = &self.coefficients;
        let angle = Angle::of(x.alpha);
        let (b, g) = (dynamics::bias(c, angle, x), dynamics::gravity(c, angle));
        let mut torque = dynamics::torque(c, x, volts);
        let at = Instant { t, x, angle };
        if self.acts.includes(Acts::TORQUE) {
            for e in &self.effects {
                let extra = e.torque(&at);
                torque = [torque[0] + extra[0], torque[1] + extra[1]];
            }
        }
        let free = [torque[0] - b[0] - g[0], torque[1] - b[1] - g[1]];
        let inverse = dynamics::mass_matrix(c, angle).inverse();
        let mut acceleration = inverse.times(free);
        if self.acts.includes(Acts::DRY_FRICTION) {
            let mut limit = [S::ZERO; 2];
            for e in &self.effects {
                let extra = e.dry_friction(&at);
                limit = [limit[0] + extra[0], limit[1] + extra[1]];
            }
            let stop = [
                -x.theta_dot.scale(stick_rate),
                -x.alpha_dot.scale(stick_rate),
            ];
            acceleration = with_dry_friction(&inverse, acceleration, stop, limit);
        }
        State::new(x.theta_dot, x.alpha_dot, acceleration[0], acceleration[1])
    }

    /// What the encoders would read, `[theta, alpha]` in rad, before they are rounded to counts.
    #[inline(always)]
    #[must_use]
    pub fn measure(&self, s: &PlantState<S>) -> [S; 2] {
        self.reading([s.x.theta, s.x.alpha])
    }

    /// What the encoders read for true angles, rad.
    #[inline(always)]
    #[must_use]
    pub fn reading(&self, angles: [S; 2]) -> [S; 2] {
        if !self.acts.includes(Acts::READING) {
            return angles;
        }
        self.effects.iter().fold(angles, |y, e| e.reading(y))
    }
}

/// Accelerations with dry friction of at most `limit` (N m) on each axis.
///
/// Friction is whatever torque would bring the axis to rest (`acceleration = stop`, a small deceleration towards zero speed),
/// as long as that needs no more than `limit`; beyond, it is `limit` against the motion. An axis that is held gets exactly
/// `stop`, so one at rest stays at rest. No stiff `tanh`, no event search: one RK4 step per sample.
#[inline(always)]
fn with_dry_friction<S: Scalar>(
    inverse: &dynamics::MassMatrix<S>,
    free: [S; 2],
    stop: [S; 2],
    limit: [S; 2],
) -> [S; 2] {
    let own = [inverse.arm, inverse.pendulum];
    let mut friction = [S::ZERO; 2];
    let mut held = [false; 2];
    // Gauss-Seidel over the two axes: the coupling is weak enough for three sweeps (the second axis alone needs one).
    let sweeps = if limit[0] == S::ZERO || limit[1] == S::ZERO {
        1
    } else {
        3
    };
    for _ in 0..sweeps {
        for i in 0..2 {
            if limit[i].value() > 0.0 {
                let others = free[i] + inverse.coupling * friction[1 - i];
                let wanted = (stop[i] - others) / own[i];
                friction[i] = wanted.clamp(-limit[i], limit[i]);
                held[i] = wanted.abs().value() <= limit[i].value();
            }
        }
    }
    let change = inverse.times(friction);
    let mut acceleration = [free[0] + change[0], free[1] + change[1]];
    for i in 0..2 {
        if held[i] {
            acceleration[i] = stop[i];
        }
    }
    acceleration
}
