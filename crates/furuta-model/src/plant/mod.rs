//! A rig with its effects, stepped under a held command.

mod attached;
#[cfg(feature = "std")]
mod bare;
mod crossing;
mod drive;
mod error;
mod events;
mod friction;
mod own;
mod regime;
mod speed;
mod start;
mod state;
mod step;
mod torques;
mod trial;
mod twisting;

pub use error::PlantError;
pub use state::{MAX_OWN_STATES, PlantState, Twist};

use crate::effects::{Acts, Clock, Drive, Effect, EndStop, Law, Relaxation, Resonance, Winding};
use crate::params::{Coefficients, Params};
use crate::scalar::Scalar;
use crate::state::State;
use arrayvec::ArrayVec;
use drive::Bodies;
use friction::softly;

/// The most effects one plant can have.
pub const MAX_EFFECTS: usize = 8;

/// The most samples by which a command or a reading can be late.
pub const MAX_DELAY_SAMPLES: usize = 126;

/// The most steps of the integrator within one sample period, which a stiff coupling needs.
pub const MAX_SUBSTEPS: usize = 64;

/// A rig: parameters and effects, both fixed. What changes lies in [`PlantState`], so one plant serves many rollouts.
///
/// [`Plant::step`] advances by one sample period with the classical Runge-Kutta method. Where the equations jump within
/// a period (dry friction that stops or lets go, a drive's backlash that opens or closes, a command that arrives late,
/// a kick), the period is cut at the very moment, so that nothing chatters and the fourth order is kept on either side.
#[derive(Clone, Debug)]
pub struct Plant<S> {
    /// What the equations of motion see of the parameters.
    pub coefficients: Coefficients<S>,
    effects: ArrayVec<Effect<S>, MAX_EFFECTS>,
    acts: Acts,
    delay: S,
    lag: S,
    sensor_delay: S,
    speed_limit: S,
    resonance: Resonance<S>,
    drive: Drive<S>,
    end_stop: EndStop<S>,
    relaxation: Relaxation<S>,
    winding: Winding<S>,
}

/// What changes within a sample period: at these, [`Plant::step`] cuts it.
const EVENTS: Acts = Acts::DELAY
    .and(Acts::JUMPS)
    .and(Acts::DRY_FRICTION)
    .and(Acts::MEMORY)
    .and(Acts::SPEED_LIMIT)
    .and(Acts::DRIVE)
    .and(Acts::CONTACT)
    .and(Acts::INNER);

impl<S: Scalar> Plant<S> {
    /// A plant with these parameters and effects. Effects that are exactly off are left out.
    ///
    /// # Errors
    /// A parameter or an effect's value outside its range, an effect that cannot act on a rig of this kind of command,
    /// more than [`MAX_EFFECTS`] effects or [`MAX_OWN_STATES`] users' own laws with a state, or effects with events
    /// within a step in a scalar of several lanes.
    ///
    /// ```
    /// use furuta_model::{Plant, PlantError, Rig};
    /// let mut params = Rig::builtin("qube-servo-2").expect("built in").params;
    /// params.pendulum.mass = -1.0;
    /// let error = Plant::new(&params, &[]).expect_err("negative mass");
    /// assert_eq!(error.to_string(), "pendulum.mass = -1 is outside the allowed range (0, 100] kg");
    /// ```
    pub fn new(params: &Params<S>, effects: &[Effect<S>]) -> Result<Self, PlantError> {
        params.validate()?;
        for effect in effects {
            effect.validate()?;
            effect.validate_for(params.motor.actuation)?;
        }
        Self::from_coefficients(params.coefficients(), effects)
    }

    /// The same from what the equations of motion see of the parameters: what a fit varies. Ranges are not checked.
    ///
    /// # Errors
    /// More than [`MAX_EFFECTS`] effects, more than [`MAX_OWN_STATES`] users' own laws with a state, two effects that
    /// remember the arm's way, or effects with events within a step in a scalar of several lanes.
    pub fn from_coefficients(
        coefficients: Coefficients<S>,
        effects: &[Effect<S>],
    ) -> Result<Self, PlantError> {
        let mut plant = Self::without_effects(coefficients);
        for effect in effects.iter().filter(|e| !e.is_off()) {
            plant
                .effects
                .try_push(*effect)
                .map_err(|_| PlantError::TooManyEffects {
                    given: effects.len(),
                })?;
            plant.coefficients = effect.shape(plant.coefficients);
            plant.feel(effect);
        }
        let with_state = plant.effects.iter().filter(|e| e.with_state().is_some());
        let given = with_state.count();
        if given > MAX_OWN_STATES {
            return Err(PlantError::TooManyStates { given });
        }
        let mut remember =
            (plant.effects.iter().map(Effect::spec)).filter(|s| s.acts.includes(Acts::MEMORY));
        if let (Some(a), Some(b)) = (remember.next(), remember.next()) {
            return Err(PlantError::TwoMemories {
                effects: [a.id, b.id],
            });
        }
        if S::LANES > 1 && plant.acts.touches(EVENTS.and(Acts::SENSOR_DELAY)) {
            return Err(PlantError::EventsInLanes);
        }
        // Whatever order they are given in, effects act in that of the catalogue.
        plant
            .effects
            .sort_unstable_by_key(|e| (e.rank(), e.spec().id));
        Ok(plant)
    }

    /// A plant without effects. Ranges are not checked.
    #[must_use]
    pub fn without_effects(coefficients: Coefficients<S>) -> Self {
        Self {
            coefficients,
            effects: ArrayVec::new(),
            acts: Acts::NOWHERE,
            delay: S::ZERO,
            lag: S::ZERO,
            sensor_delay: S::ZERO,
            speed_limit: S::ZERO,
            resonance: Resonance::NONE,
            drive: Drive::RIGID,
            end_stop: EndStop::NONE,
            relaxation: Relaxation::NONE,
            winding: Winding::PROMPT,
        }
    }

    /// Adds what an effect does beside the equations of motion.
    fn feel(&mut self, effect: &Effect<S>) {
        self.acts = self.acts.and(effect.spec().acts);
        self.delay += effect.delay();
        self.lag += effect.lag();
        self.sensor_delay += effect.sensor_delay();
        self.speed_limit += effect.speed_limit();
        self.drive = self.drive.with(effect.drive());
        // Of each there is one.
        let acts = effect.spec().acts;
        if acts.includes(Acts::CONTACT) {
            self.end_stop = effect.end_stop();
        }
        if acts.includes(Acts::RESONANCE) {
            self.resonance = effect.resonance();
        }
        if acts.includes(Acts::INNER) {
            let (relaxation, winding) = (effect.relaxation(), effect.winding());
            if relaxation.is_there() {
                self.relaxation = relaxation;
            }
            if winding.is_late() {
                self.winding = winding;
            }
        }
    }

    /// The same plant with only those of its effects that `keep` says; its equations of motion keep their
    /// coefficients.
    pub(crate) fn retaining(&self, keep: impl Fn(&Effect<S>) -> bool) -> Self {
        let mut plant = Self::without_effects(self.coefficients);
        for effect in self.effects.iter().filter(|e| keep(e)) {
            let _ = plant.effects.try_push(*effect); // there is as much room as there was
            plant.feel(effect);
        }
        plant
    }

    /// A plant of which nothing is known: every prediction is not a number.
    #[must_use]
    pub fn unknown() -> Self {
        let unknown = S::from_f64(f64::NAN);
        Self::without_effects(Coefficients {
            arm: unknown,
            hub: unknown,
            swing: unknown,
            coupling: unknown,
            pendulum: unknown,
            weight: unknown,
            lever: unknown,
            drive: unknown,
            arm_damping: unknown,
            pendulum_damping: unknown,
        })
    }

    /// The effects that are not off.
    #[must_use]
    pub fn effects(&self) -> &[Effect<S>] {
        &self.effects
    }

    /// The same plant in another scalar, all parameters constants.
    #[must_use]
    pub fn cast<T: Scalar>(&self) -> Plant<T> {
        let f = |x: S| T::from_f64(x.value());
        Plant {
            coefficients: self.coefficients.cast(),
            effects: self.effects.iter().map(Effect::cast).collect(),
            acts: self.acts,
            delay: f(self.delay),
            lag: f(self.lag),
            sensor_delay: f(self.sensor_delay),
            speed_limit: f(self.speed_limit),
            resonance: Resonance {
                period: f(self.resonance.period),
                damping: f(self.resonance.damping),
            },
            drive: Drive {
                gap: f(self.drive.gap),
                stiffness: f(self.drive.stiffness),
                damping: f(self.drive.damping),
                motor_share: f(self.drive.motor_share),
                encoder_on_motor: self.drive.encoder_on_motor,
            },
            end_stop: EndStop {
                stiffness: f(self.end_stop.stiffness),
                angle: f(self.end_stop.angle),
                damping: f(self.end_stop.damping),
                middle: f(self.end_stop.middle),
            },
            relaxation: Relaxation {
                stiffness: f(self.relaxation.stiffness),
                time_constant: f(self.relaxation.time_constant),
            },
            winding: Winding {
                time_constant: f(self.winding.time_constant),
                back_emf: f(self.winding.back_emf),
            },
        }
    }

    /// Whether the plant can be stepped with this sample period.
    ///
    /// # Errors
    /// A period outside (0, 1] s, so short that a delay spans more than [`MAX_DELAY_SAMPLES`] samples, or so long that
    /// a flexible coupling would need more than [`MAX_SUBSTEPS`] steps.
    pub fn check_period(&self, period: f64) -> Result<(), PlantError> {
        if !(period > 0.0 && period <= 1.0) {
            return Err(PlantError::SamplePeriod { period });
        }
        #[allow(clippy::cast_precision_loss)]
        let longest = period * MAX_DELAY_SAMPLES as f64;
        for delay in [self.delay.value(), self.sensor_delay.value()] {
            if delay > longest {
                return Err(PlantError::DelayTooLong { delay, longest });
            }
        }
        let (frequency, highest) = self.coupling_frequency(period);
        if frequency > highest {
            return Err(PlantError::CouplingTooStiff { frequency, highest });
        }
        Ok(())
    }

    /// Whether rotor and arm are two bodies.
    #[must_use]
    pub fn has_drive(&self) -> bool {
        self.acts.includes(Acts::DRIVE)
    }

    /// What the encoders are mounted on: the mechanical state, with the rotor's angle and speed in the arm's place
    /// where the arm's encoder sits on the motor.
    #[inline(always)]
    #[must_use]
    pub fn seen(&self, s: &PlantState<S>) -> State<S> {
        if self.drive.encoder_on_motor {
            State::new(s.rotor[0], s.x.alpha, s.rotor[1], s.x.alpha_dot)
        } else {
            s.x
        }
    }

    /// Moves the whole rig so that [`Plant::seen`] is `x`: how far the rotor is turned against the arm, and how fast,
    /// stays.
    pub fn place(&self, s: &mut PlantState<S>, x: State<S>) {
        let seen = self.seen(s);
        let (angle, speed) = (x.theta - seen.theta, x.theta_dot - seen.theta_dot);
        s.rotor = [s.rotor[0] + angle, s.rotor[1] + speed];
        s.x = State::new(
            s.x.theta + angle,
            x.alpha,
            s.x.theta_dot + speed,
            x.alpha_dot,
        );
    }

    /// What the arm's friction remembers after sliding in the direction of `speed` for long.
    fn slid(&self, speed: S) -> S {
        if !self.acts.includes(Acts::MEMORY) || speed.real() == S::Real::ZERO {
            return S::ZERO;
        }
        // A way after which any bristle slides: exp(-far) is nothing.
        let far = speed.if_less(S::ZERO, S::from_f64(-1e6), S::from_f64(1e6));
        self.travelled(S::ZERO, far)
    }

    #[inline(never)]
    fn travelled(&self, memory: S, travel: S) -> S {
        self.effects
            .iter()
            .fold(memory, |m, e| e.travelled(m, travel))
    }

    /// How late the command acts, s.
    #[must_use]
    pub fn delay(&self) -> S {
        self.delay
    }

    /// Time constant of the lag between command and motor, s; 0: none.
    #[must_use]
    pub fn lag(&self) -> S {
        self.lag
    }

    /// How the arm rings about the commanded course; `None`: it follows at once.
    #[must_use]
    pub fn resonance(&self) -> Option<&Resonance<S>> {
        (self.acts.includes(Acts::RESONANCE) && self.resonance.period.real() > S::Real::ZERO)
            .then_some(&self.resonance)
    }

    /// How late the encoders' readings are, s.
    #[must_use]
    pub fn sensor_delay(&self) -> S {
        self.sensor_delay
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

    /// `dx/dt` at time `t` (s) with `volts` (V) at the motor, for integrators that know no events ([`Plant::step`]
    /// does).
    ///
    /// Dry friction stops an axis that it can hold at the rate `stick_rate` (1/s) instead of at once: RK4 is stable up
    /// to 2.78 over the step's length. Rotor and arm are taken as one body, friction that remembers and cables as
    /// relaxed, the motor's current as prompt, states of users' own laws as at the start of a run.
    #[inline(always)]
    #[must_use]
    pub fn rate(&self, t: S, x: &State<S>, volts: S, stick_rate: S::Real) -> State<S> {
        self.rate_with(&self.coefficients, t, x, volts, stick_rate)
    }

    /// As [`Plant::rate`], of a plant with the same effects and other coefficients.
    #[inline(always)]
    #[must_use]
    pub fn rate_with(
        &self,
        coefficients: &Coefficients<S>,
        t: S,
        x: &State<S>,
        volts: S,
        stick_rate: S::Real,
    ) -> State<S> {
        let mut balance =
            self.balance(coefficients, Clock::at(t), x, volts, S::ZERO, Bodies::Whole);
        if self.acts.includes(Acts::CONTACT) {
            let side = self.end_stop.side(x.theta, x.theta_dot);
            balance.free[0] += self.end_stop.torque(side, x.theta, x.theta_dot);
        }
        if self.acts.includes(Acts::STATE) {
            let extra = self.own_at_start(x, Clock::at(t), volts);
            balance.free = [balance.free[0] + extra[0], balance.free[1] + extra[1]];
        }
        let acceleration = if self.acts.includes(Acts::DRY_FRICTION) {
            let stop = [
                -x.theta_dot.scale(stick_rate),
                -x.alpha_dot.scale(stick_rate),
            ];
            softly(&balance, stop)
        } else {
            balance.inverse.times(balance.free)
        };
        State::new(x.theta_dot, x.alpha_dot, acceleration[0], acceleration[1])
    }

    /// What the encoders would read, `[theta, alpha]` in rad, before they are rounded to counts.
    #[inline(always)]
    #[must_use]
    pub fn measure(&self, s: &PlantState<S>) -> [S; 2] {
        let mut angles = self.angles(s);
        if self.acts.includes(Acts::UNTIMELY) {
            let seen = self.seen(s);
            for e in &self.effects {
                let late = e.untimely(s.run, s.t);
                angles[0] += late * seen.theta_dot;
                angles[1] += late * seen.alpha_dot;
            }
        }
        self.reading_from(angles, [S::ZERO; 2], (s.run, s.t))
    }

    /// What a model expects the encoders to read: as [`Plant::measure`], each sample taken when it should be, since
    /// random moments cannot be foreseen.
    #[inline(always)]
    #[must_use]
    pub fn expected(&self, s: &PlantState<S>) -> [S; 2] {
        self.reading_from(self.angles(s), [S::ZERO; 2], (s.run, s.t))
    }

    /// The angles that the encoders show at a sample.
    #[inline(always)]
    fn angles(&self, s: &PlantState<S>) -> [S; 2] {
        if self.acts.includes(Acts::SENSOR_DELAY) {
            self.late_reading(s)
        } else {
            self.prompt_reading(s)
        }
    }

    /// The angles at the encoders, now.
    #[inline(always)]
    fn prompt_reading(&self, s: &PlantState<S>) -> [S; 2] {
        let seen = self.seen(s);
        [seen.theta, seen.alpha]
    }

    /// What the encoders read for true angles when the first run begins, rad.
    #[inline(always)]
    #[must_use]
    pub fn reading(&self, angles: [S; 2]) -> [S; 2] {
        self.reading_from(angles, [S::ZERO; 2], (0, S::ZERO))
    }

    /// The same at a moment (which run, from 0, and its time, s) of encoders that were zeroed at other true angles
    /// `[theta, alpha]`, rad: a disc's error belongs to the place in the turn, scale and offset to what is counted.
    #[inline(always)]
    #[must_use]
    pub fn reading_from(&self, angles: [S; 2], zeros: [S; 2], (run, t): (usize, S)) -> [S; 2] {
        let mut shown = [angles[0] - zeros[0], angles[1] - zeros[1]];
        if self.acts.includes(Acts::DISC) {
            shown = self.effects.iter().fold(shown, |y, e| {
                let off = e.disc(angles);
                [y[0] + off[0], y[1] + off[1]]
            });
        }
        if self.acts.includes(Acts::COUNTS) {
            shown = self.effects.iter().fold(shown, |y, e| {
                let lost = e.lost(run, t);
                [y[0] + lost[0], y[1] + lost[1]]
            });
        }
        if !self.acts.includes(Acts::READING) {
            return shown;
        }
        self.effects.iter().fold(shown, |y, e| e.reading(y))
    }
}
