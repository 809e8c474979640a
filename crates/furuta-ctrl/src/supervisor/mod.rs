//! What stands between controllers and a motor: modes, the catch, limits, faults.
//!
//! | from | when | to | command |
//! |---|---|---|---|
//! | idle, stopping | [`Request::Start`] | swing-up | 0 while idle |
//! | swing-up | the balance controller would succeed from here (see below) | balance | energy swing-up |
//! | balance | the pendulum is further than [`Thresholds::release_angle`] from upright, or beyond [`Thresholds::doubt_angle`] falling, and the model says that it will not be saved; or the arm could not be stopped within its limit any more | swing-up | the balance controller's |
//! | swing-up, balance | [`Request::Stop`] | stopping | |
//! | stopping | both axes at rest for half a second | idle | 0 |
//! | swing-up, balance | an angle or speed beyond its limit | braking | 0 from the next sample on, then against the arm's speed: [`Brake`] |
//! | braking | the arm has stopped, or a quarter of a second is over | fault | |
//! | idle, stopping | an angle or speed beyond its limit | fault | 0 |
//! | any | a measurement that is not a number | fault | 0 |
//! | fault | [`Request::Reset`], measurements being sound again | idle | 0 while in fault |
//!
//! Started with the pendulum held upright, the catch succeeds at once: there is no separate mode for it.
//!
//! **The catch.** Whether the balance controller can take over depends on angle, both speeds, the arm's room, and the voltage at hand;
//! no fixed window around upright fits a light pendulum on a strong motor and a heavy one on a short arm. So the model is asked: the
//! balance loop, command limit included, is rolled out for a few of the pendulum's own time constants, and the switch is made where it
//! ends near upright, at the moment at which the command jumps least. Near upright the switch back is not even considered: that is the hysteresis.
//!
//! The same as a table of modes and events, tried and compared by a test: `docs/controllers.md`.

mod brake;
mod catch;

pub use brake::{Brake, Braking};
pub use catch::Catch;

use crate::compensation::{Compensation, Situation};
use crate::config::{Config, ConfigError};
use crate::controllers::{
    AnyController, AnyControllerState, Controller, Design, StateFeedback, SwingUp, SwingUpState,
};
use crate::design;
use crate::estimators::{AnyEstimator, AnyEstimatorState, Estimate, Estimator, Measurement};
use crate::real::{Real, c, command, is_finite, wrap};
use crate::settings::{ParameterSpec, Settings, Spec};
use crate::site::{Limits, Site};
use furuta_model::State;

/// A jump of the command at the catch that is small enough, of the command limit.
const SMALL_JUMP: f64 = 0.1;

/// Balancing is given up where full braking would stop the arm beyond this share of its limit.
const LAST_BRAKE: f64 = 0.9;
/// No catch is tried where it would stop beyond this: the distance from the other is a hysteresis.
const CATCH_BRAKE: f64 = 0.7;

/// What the supervisor is doing.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Waiting; the motor is off.
    Idle,
    /// Pumping energy into the pendulum.
    SwingUp,
    /// Keeping it upright.
    Balance,
    /// The motor is off until everything rests.
    Stopping,
    /// A limit was passed: the arm is braked, for a quarter of a second at most, and then the motor is off. See [`Brake`].
    Braking,
    /// A limit was passed or a measurement was no number; the motor is off until [`Request::Reset`].
    Fault,
}

impl Mode {
    /// Its name in logs: `idle`, `swing-up`, `balance`, `stopping`, `braking`, `fault`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Idle => "idle",
            Self::SwingUp => "swing-up",
            Self::Balance => "balance",
            Self::Stopping => "stopping",
            Self::Braking => "braking",
            Self::Fault => "fault",
        }
    }
}

/// What the operator asks for.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Request {
    /// Swing up and balance.
    Start,
    /// Let go.
    Stop,
    /// Leave the fault.
    Reset,
}

/// Why the motor was switched off.
#[derive(Copy, Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Fault {
    /// An encoder's angle is not a finite number.
    #[error("a measured angle is not a finite number")]
    NotANumber,
    /// The arm went too far.
    #[error("arm at {angle:.3} rad, beyond its limit of {limit:.3} rad")]
    ArmAngle {
        /// rad.
        angle: f64,
        /// rad.
        limit: f64,
    },
    /// The arm went too fast.
    #[error("arm at {speed:.2} rad/s, beyond its limit of {limit:.2} rad/s")]
    ArmSpeed {
        /// rad/s.
        speed: f64,
        /// rad/s.
        limit: f64,
    },
    /// The pendulum went too fast.
    #[error("pendulum at {speed:.2} rad/s, beyond its limit of {limit:.2} rad/s")]
    PendulumSpeed {
        /// rad/s.
        speed: f64,
        /// rad/s.
        limit: f64,
    },
}

/// What a controller file's section `[supervisor]` may say.
pub static SPEC: Spec = Spec {
    id: "supervisor",
    sentence: "When swing-up and balance hand over to each other",
    parameters: &[
        ParameterSpec::number(
            "doubt_angle",
            "rad",
            0.01,
            1.5,
            "distance from upright beyond which balancing goes on only while the model says that it will succeed",
        )
        .or(0.4),
        ParameterSpec::number(
            "release_angle",
            "rad",
            0.1,
            3.1,
            "distance from upright at which balancing is given up",
        )
        .or(1.6),
        ParameterSpec::number(
            "reference_speed",
            "rad/s",
            1e-3,
            1e3,
            "how fast the arm is led to its reference",
        )
        .or(1.0),
        ParameterSpec::number(
            "catch_angle",
            "rad",
            0.01,
            1.5,
            "distance from upright beyond which no catch is tried",
        )
        .or(1.2),
        ParameterSpec::number(
            "catch_error",
            "",
            0.0,
            0.5,
            "a catch must succeed by the model with its weight so much greater, and so much less; 0: by the model as it is",
        )
        .or(0.0),
        ParameterSpec::number(
            "blend",
            "",
            0.0,
            1.0,
            "time constant with which the difference of the two commands at a catch dies out, of the pendulum's time constant; 0: at once",
        )
        .or(0.1),
        ParameterSpec::whole(
            "catch_every",
            1.0,
            1000.0,
            1.0,
            "samples from one test of the catch to the next: what it costs is spread over so many",
        ),
    ],
};

/// What a controller file's section `[limits]` may say.
pub static LIMITS: Spec = Spec {
    id: "limits",
    sentence: "Where the motor is switched off; a rig file's tighter limits count all the same",
    parameters: &[
        ParameterSpec::number(
            "arm_angle",
            "rad",
            1e-3,
            1e3,
            "largest arm angle either way; a turn if neither file says",
        ),
        ParameterSpec::number(
            "arm_speed",
            "rad/s",
            1e-3,
            1e4,
            "largest arm speed; half as much again as the motor reaches if neither file says",
        ),
        ParameterSpec::number(
            "pendulum_speed",
            "rad/s",
            1e-3,
            1e4,
            "largest pendulum speed; ten times its small-angle frequency if neither file says",
        ),
        ParameterSpec::number(
            "command",
            "V",
            1e-3,
            1e3,
            "largest command; the rig's if left out",
        ),
    ],
};

/// Numbers of a [`Supervisor`].
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Thresholds<T> {
    /// Largest arm angle either way, rad.
    pub arm_angle_limit: T,
    /// Largest arm speed, rad/s.
    pub arm_speed_limit: T,
    /// Largest pendulum speed, rad/s.
    pub pendulum_speed_limit: T,
    /// Largest command, V.
    pub command_limit: T,
    /// Distance from upright beyond which balancing goes on only while the model says that it will succeed, rad.
    pub doubt_angle: T,
    /// Distance from upright at which balancing is given up, rad.
    pub release_angle: T,
    /// How fast the arm is led to its reference, rad/s.
    pub reference_speed: T,
    /// Speed below which an axis counts as resting, rad/s.
    pub rest_speed: T,
    /// What is left after a sample of the commands' difference at the catch.
    pub blend: T,
    /// Samples from one test of the catch to the next.
    pub catch_every: u32,
}

/// Swing-up, catch and balance of one rig at one sample period. Configuration only: see [`SupervisorState`].
#[derive(Clone, Debug)]
pub struct Supervisor<T: Real> {
    /// From measurements to states.
    pub estimator: AnyEstimator<T>,
    /// Brings the pendulum up.
    pub swing_up: SwingUp<T>,
    /// Keeps it there.
    pub balance: AnyController<T>,
    /// Decides when the second takes over from the first.
    pub catch: Catch<T>,
    /// Added to the command of the second.
    pub compensation: Compensation<T>,
    /// Limits and thresholds.
    pub thresholds: Thresholds<T>,
    /// How the arm is stopped where a limit is passed.
    pub brake: Brake<T>,
    /// Sample period, s.
    h: T,
}

/// Memory of a [`Supervisor`].
#[derive(Clone, Debug)]
pub struct SupervisorState<T: Real> {
    mode: Mode,
    fault: Option<Fault>,
    estimator: AnyEstimatorState<T>,
    swing_up: SwingUpState<T>,
    balance: AnyControllerState<T>,
    /// Where the balance controller is asked to hold the arm just now, rad.
    arm_reference: T,
    /// The last command, V.
    u: T,
    /// What is left of the commands' difference at the catch, V; `None` before the first command that balances.
    bump: Option<T>,
    /// Samples since the last test of the catch.
    since_test: u32,
    /// By how much the command would have jumped at the last test, had the pendulum been caught, V.
    catch_jump: Option<T>,
    /// For how long both axes have been at rest, s.
    resting: T,
    /// While in [`Mode::Braking`].
    braking: Braking<T>,
}

/// One sample's answer.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Output<T> {
    /// Command for the motor, V.
    pub u: T,
    /// Mode that gave it.
    pub mode: Mode,
    /// Estimated state at the sample.
    pub x: State<T>,
    /// Where the arm is asked to be just now, rad.
    pub reference: T,
}

impl<T: Real> Supervisor<T> {
    /// The control system of a controller file at a site.
    ///
    /// # Errors
    /// Settings that are not possible there; see [`ConfigError`].
    ///
    /// ```
    /// use furuta_ctrl::estimators::Measurement;
    /// use furuta_ctrl::supervisor::{Mode, Request, Supervisor};
    /// use furuta_ctrl::{Config, Site};
    /// let rig = furuta_model::Rig::builtin("qube-servo-2").ok_or("no such rig")?;
    /// let supervisor = Supervisor::<f32>::design(&Config::default(), &Site::of(&rig, 0.002))?;
    /// let mut state = supervisor.start();
    /// state.request(Request::Start);
    /// let out = supervisor.update(&mut state, &Measurement::new(0.0, 3.1, 0.0), 0.0);
    /// assert_eq!(out.mode, Mode::SwingUp);
    /// # Ok::<(), Box<dyn core::error::Error>>(())
    /// ```
    pub fn design(config: &Config, site: &Site<'_>) -> Result<Self, ConfigError> {
        if !(site.period > 0.0 && site.period <= 0.1) {
            return Err(ConfigError::Period {
                period: site.period,
            });
        }
        let site = &within(&config.limits, site);
        let swing_up = SwingUp::design(&config.swing_up, site)?;
        let balance = AnyController::design(&config.controller, site)?;
        let stand_in = match balance.stand_in() {
            Some(feedback) => feedback,
            None => StateFeedback::new(
                &design::balance(site.params, site.period)?,
                site.command_limit,
            ),
        };
        let number = |name| T::from_f64(config.supervisor.number(name).unwrap_or_default());
        let catch = Catch::new(&site.params.cast(), stand_in, swing_up.catch_range())
            .within(number("catch_angle"), number("catch_error"));
        Ok(Self {
            estimator: AnyEstimator::design(&config.estimator, site)?,
            swing_up: swing_up.aiming_at(catch.fastest()),
            balance,
            catch,
            compensation: Compensation::design(&config.compensate, site)?,
            thresholds: thresholds(&config.supervisor, site),
            brake: Brake::new(site.params, site.command_limit, site.period),
            h: T::from_f64(site.period),
        })
    }

    /// Idle, before the first sample.
    pub fn start(&self) -> SupervisorState<T> {
        SupervisorState {
            mode: Mode::Idle,
            fault: None,
            estimator: self.estimator.start(),
            swing_up: self.swing_up.start(),
            balance: self.balance.start(),
            arm_reference: T::ZERO,
            u: T::ZERO,
            bump: None,
            since_test: u32::MAX,
            catch_jump: None,
            resting: T::ZERO,
            braking: Brake::none().begin(T::ZERO),
        }
    }

    /// The command for one sample; the arm is to go to `target` (rad) once the pendulum is up.
    ///
    /// Always a finite number within the command limit; 0 in the modes idle, stopping and fault; against the arm's speed in braking.
    pub fn update(
        &self,
        state: &mut SupervisorState<T>,
        measurement: &Measurement<T>,
        target: T,
    ) -> Output<T> {
        let Estimate {
            now,
            ahead,
            disturbance,
        } = self.estimator.update(&mut state.estimator, measurement);
        if let Some(fault) = self.violation(&now) {
            self.find(state, fault, &now);
        }
        let periods = T::from_f64(f64::from(measurement.periods));
        let target = if is_finite(target) { target } else { T::ZERO };
        let mode = self.next_mode(state, &now, &ahead, periods);
        if mode != state.mode {
            self.enter(state, mode, &ahead);
        }
        let u = match mode {
            Mode::SwingUp => {
                self.swing_up
                    .update(&mut state.swing_up, &ahead, &arm_at(T::ZERO), self.h)
            }
            Mode::Balance => {
                let step = self.thresholds.reference_speed * self.h * periods;
                state.arm_reference += (target - state.arm_reference).clamp(-step, step);
                let reference = arm_at(state.arm_reference);
                let u = self
                    .balance
                    .update(&mut state.balance, &ahead, &reference, self.h);
                // What the last command was above this one dies out, instead of vanishing at once.
                let bump = self.thresholds.blend * state.bump.unwrap_or(state.u - u);
                state.bump = Some(bump);
                let u = u + bump;
                let situation = Situation {
                    x: ahead,
                    reference: state.arm_reference,
                    disturbance,
                };
                self.compensation.command(u, &situation)
            }
            Mode::Braking => {
                let u = self
                    .brake
                    .update(&mut state.braking, &now, measurement.periods);
                if state.braking.is_over() {
                    state.mode = Mode::Fault;
                }
                u
            }
            Mode::Idle | Mode::Stopping | Mode::Fault => T::ZERO,
        };
        let mode = state.mode;
        state.u = command(u, self.thresholds.command_limit);
        Output {
            u: state.u,
            mode,
            x: now,
            reference: match mode {
                Mode::Balance => state.arm_reference,
                _ => T::ZERO,
            },
        }
    }

    fn next_mode(
        &self,
        state: &mut SupervisorState<T>,
        now: &State<T>,
        ahead: &State<T>,
        periods: T,
    ) -> Mode {
        match state.mode {
            Mode::SwingUp => {
                state.since_test = state.since_test.saturating_add(1);
                if state.since_test < self.thresholds.catch_every {
                    return Mode::SwingUp;
                }
                state.since_test = 0;
                if self.runs_away(ahead, CATCH_BRAKE) {
                    state.catch_jump = None;
                    return Mode::SwingUp;
                }
                let ratio = self.swing_up.weight_ratio(&state.swing_up);
                let jump = self
                    .catch
                    .weighing(ratio)
                    .succeeds(ahead)
                    .then(|| self.jump(state, ahead));
                let before = core::mem::replace(&mut state.catch_jump, jump);
                let small = c::<T>(SMALL_JUMP) * self.thresholds.command_limit;
                match (before, jump) {
                    (None, None) => Mode::SwingUp,
                    // It will be smoother yet.
                    (None, Some(now)) if now > small => Mode::SwingUp,
                    (Some(before), Some(now)) if now > small && now < before => Mode::SwingUp,
                    // The smoothest moment, or just after it.
                    _ => Mode::Balance,
                }
            }
            Mode::Balance if self.is_lost(state, ahead) => Mode::SwingUp,
            Mode::Stopping => {
                let rest = self.thresholds.rest_speed;
                let moving = now.theta_dot.abs() > rest || now.alpha_dot.abs() > rest;
                state.resting = if moving {
                    T::ZERO
                } else {
                    state.resting + self.h * periods
                };
                if state.resting > c(0.5) {
                    Mode::Idle
                } else {
                    Mode::Stopping
                }
            }
            mode => mode,
        }
    }

    /// Whether the arm, going outwards, would stop beyond this share of its limit under full braking.
    fn runs_away(&self, x: &State<T>, share: f64) -> bool {
        let stop = self.swing_up.stops_at(x).abs();
        x.theta * x.theta_dot > T::ZERO && stop > c::<T>(share) * self.thresholds.arm_angle_limit
    }

    /// By how much the command would jump if the balance controller took over now, V.
    fn jump(&self, state: &SupervisorState<T>, x: &State<T>) -> T {
        // Before the limit, or all that saturate would be alike.
        let u = self.catch.feedback.unlimited(x, &arm_at(x.theta));
        (u - state.u).abs()
    }

    /// Whether the pendulum falls whatever the balance controller does: better swing it up again than let the arm run after it. While it
    /// still rises, nothing is lost: a catch at the edge of what the model promises would be given up and tried again at every other sample.
    fn is_lost(&self, state: &SupervisorState<T>, x: &State<T>) -> bool {
        let alpha = wrap(x.alpha);
        let falling = alpha * x.alpha_dot > T::ZERO;
        let doubtful = falling && alpha.abs() > self.thresholds.doubt_angle;
        // The arm is on its way into its limit: the swing-up brakes.
        self.runs_away(x, LAST_BRAKE)
            || alpha.abs() > self.thresholds.release_angle
            || doubtful
                && !self
                    .catch
                    .weighing(self.swing_up.weight_ratio(&state.swing_up))
                    .holds(x, state.arm_reference)
    }

    /// A limit passed while the motor drives: it brakes first. Where the motor is off already, or nothing is known, it is off.
    fn find(&self, state: &mut SupervisorState<T>, fault: Fault, now: &State<T>) {
        let known = fault != Fault::NotANumber;
        match state.mode {
            Mode::Fault => return,
            Mode::Braking if known => return,
            Mode::SwingUp | Mode::Balance if known => {
                state.mode = Mode::Braking;
                state.braking = self.brake.begin(now.theta_dot);
            }
            _ => state.mode = Mode::Fault,
        }
        state.fault = Some(fault);
    }

    fn enter(&self, state: &mut SupervisorState<T>, mode: Mode, x: &State<T>) {
        state.mode = mode;
        match mode {
            // From where the arm is, and from the command so far: no jump in either.
            Mode::Balance => {
                state.arm_reference = x.theta;
                state.bump = None;
                state.balance = self.balance.take_over(x, &arm_at(x.theta), state.u);
            }
            Mode::SwingUp => {
                state.catch_jump = None;
                state.swing_up = self.swing_up.again(&state.swing_up);
            }
            Mode::Idle | Mode::Stopping | Mode::Braking | Mode::Fault => {}
        }
    }

    fn violation(&self, x: &State<T>) -> Option<Fault> {
        let t = &self.thresholds;
        if !x.is_finite() {
            return Some(Fault::NotANumber);
        }
        if x.theta.abs() > t.arm_angle_limit {
            return Some(Fault::ArmAngle {
                angle: x.theta.value(),
                limit: t.arm_angle_limit.value(),
            });
        }
        if x.theta_dot.abs() > t.arm_speed_limit {
            return Some(Fault::ArmSpeed {
                speed: x.theta_dot.value(),
                limit: t.arm_speed_limit.value(),
            });
        }
        if x.alpha_dot.abs() > t.pendulum_speed_limit {
            return Some(Fault::PendulumSpeed {
                speed: x.alpha_dot.value(),
                limit: t.pendulum_speed_limit.value(),
            });
        }
        None
    }
}

/// The site with the tighter of its own limits and the file's.
fn within<'a>(settings: &Settings, site: &Site<'a>) -> Site<'a> {
    let tighter = |of_rig: Option<f64>, name| match (of_rig, settings.number(name)) {
        (Some(a), Some(b)) => Some(a.min(b)),
        (a, b) => a.or(b),
    };
    Site {
        command_limit: tighter(Some(site.command_limit), "command").unwrap_or(site.command_limit),
        limits: Limits {
            arm_angle: tighter(site.limits.arm_angle, "arm_angle"),
            arm_speed: tighter(site.limits.arm_speed, "arm_speed"),
            pendulum_speed: tighter(site.limits.pendulum_speed, "pendulum_speed"),
        },
        ..*site
    }
}

fn thresholds<T: Real>(settings: &Settings, site: &Site<'_>) -> Thresholds<T> {
    let k = site.params.coefficients();
    let frequency = site.frequency();
    let free_speed = k.drive * site.params.motor.command_limit / k.arm_damping.max(1e-9);
    let limits = &site.limits;
    // Every one has a default.
    let number = |name| T::from_f64(settings.number(name).unwrap_or_default());
    Thresholds {
        arm_angle_limit: T::from_f64(limits.arm_angle.unwrap_or(core::f64::consts::TAU)),
        arm_speed_limit: T::from_f64(limits.arm_speed.unwrap_or(1.5 * free_speed)),
        pendulum_speed_limit: T::from_f64(limits.pendulum_speed.unwrap_or(10.0 * frequency)),
        command_limit: T::from_f64(site.command_limit),
        doubt_angle: number("doubt_angle"),
        release_angle: number("release_angle"),
        reference_speed: number("reference_speed"),
        rest_speed: T::from_f64(0.05 * frequency),
        blend: T::from_f64(libm::exp(
            -site.period * frequency / settings.number("blend").unwrap_or_default(),
        )),
        #[allow(clippy::cast_possible_truncation)] // at most 1000
        catch_every: settings.whole("catch_every").unwrap_or(1) as u32,
    }
}

fn arm_at<T: Real>(theta: T) -> State<T> {
    State::new(theta, T::ZERO, T::ZERO, T::ZERO)
}

impl<T: Real> SupervisorState<T> {
    /// What the swing-up remembers.
    pub fn swing_up_state(&self) -> &SwingUpState<T> {
        &self.swing_up
    }

    /// The present mode.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Why the motor was switched off, while in [`Mode::Braking`] and [`Mode::Fault`].
    pub fn fault(&self) -> Option<Fault> {
        self.fault
    }

    /// Asks for a change of mode; false where it makes no sense in the present one.
    pub fn request(&mut self, request: Request) -> bool {
        let next = match (self.mode, request) {
            (Mode::Idle | Mode::Stopping, Request::Start) => Mode::SwingUp,
            (Mode::SwingUp | Mode::Balance, Request::Stop) => Mode::Stopping,
            (Mode::Fault, Request::Reset) => Mode::Idle,
            _ => return false,
        };
        self.mode = next;
        self.fault = None;
        self.since_test = u32::MAX;
        self.resting = T::ZERO;
        true
    }
}
