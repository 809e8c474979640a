//! What stands between controllers and a motor: modes, the catch, limits, faults.
//!
//! | from | when | to | command |
//! |---|---|---|---|
//! | idle | [`Request::Start`] | swing-up | 0 while idle |
//! | swing-up | the balance controller would succeed from here (see below) | balance | energy swing-up |
//! | balance | the pendulum is further than [`Settings::release_angle`] from upright, or beyond [`Settings::doubt_angle`] and the model says that it will fall | swing-up | state feedback |
//! | swing-up, balance | [`Request::Stop`] | stopping | |
//! | stopping | both axes at rest for half a second | idle | 0 |
//! | any | an angle or speed beyond its limit, or not a number | fault | 0 |
//! | fault | [`Request::Reset`], measurements being sound again | idle | 0 while in fault |
//!
//! Started with the pendulum held upright, the catch succeeds at once: there is no separate mode for it.
//!
//! **The catch.** Whether the balance controller can take over depends on angle, both speeds, the arm's room, and the voltage at hand;
//! no fixed window around upright fits a light pendulum on a strong motor and a heavy one on a short arm. So the model is asked: the
//! balance loop, command limit included, is rolled out for a few of the pendulum's own time constants, and the switch is made where it
//! ends near upright. Near upright the switch back is not even considered: that is the hysteresis.

mod catch;

pub use catch::Catch;

use crate::controllers::{Controller, StateFeedback, SwingUp, SwingUpState};
use crate::design::{self, DesignError};
use crate::estimators::{Derivative, DerivativeState};
use crate::real::{Real, c, command, is_finite, wrap};
use furuta_model::{Params, State};

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
    /// A limit was passed or a measurement was no number; the motor is off until [`Request::Reset`].
    Fault,
}

impl Mode {
    /// Its name in logs: `idle`, `swing-up`, `balance`, `stopping`, `fault`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Idle => "idle",
            Self::SwingUp => "swing-up",
            Self::Balance => "balance",
            Self::Stopping => "stopping",
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

/// Where a run is stopped. `None`: a default from the model, wide enough for a sound run.
#[derive(Copy, Clone, Debug, PartialEq, Default)]
pub struct Limits {
    /// Largest arm angle either way, rad.
    pub arm_angle: Option<f64>,
    /// Largest arm speed, rad/s.
    pub arm_speed: Option<f64>,
    /// Largest pendulum speed, rad/s.
    pub pendulum_speed: Option<f64>,
}

/// Numbers of a [`Supervisor`] that one may want to change.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Settings<T> {
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
    /// How fast the arm is led back to its target after the catch, rad/s.
    pub reference_speed: T,
    /// Speed below which an axis counts as resting, rad/s.
    pub rest_speed: T,
    /// Samples from one test of the catch to the next.
    pub catch_every: u32,
}

/// Swing-up, catch and balance of one rig at one sample period. Configuration only: see [`SupervisorState`].
#[derive(Clone, Debug)]
pub struct Supervisor<T> {
    /// Speeds from the encoders' angles, one for each axis.
    pub speed: Derivative<T>,
    /// Brings the pendulum up.
    pub swing_up: SwingUp<T>,
    /// Keeps it there.
    pub balance: StateFeedback<T>,
    /// Decides when the second takes over from the first.
    pub catch: Catch<T>,
    /// Limits and thresholds.
    pub settings: Settings<T>,
    /// Sample period, s.
    h: T,
}

/// Memory of a [`Supervisor`].
#[derive(Clone, Debug)]
pub struct SupervisorState<T> {
    mode: Mode,
    fault: Option<Fault>,
    speeds: [DerivativeState<T>; 2],
    swing_up: SwingUpState<T>,
    /// Where the balance controller is asked to hold the arm just now, rad.
    arm_reference: T,
    /// Samples since the last test of the catch.
    since_test: u32,
    /// For how long both axes have been at rest, s.
    resting: T,
}

/// One sample's answer.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Output<T> {
    /// Command for the motor, V.
    pub u: T,
    /// Mode that gave it.
    pub mode: Mode,
    /// Estimated state: measured angles, filtered speeds.
    pub x: State<T>,
}

// Half of the arm's travel during swing-up, rad, where the rig leaves it free.
const ARM_RANGE: f64 = 2.16;
// How far the arm may go in the prediction of a catch, of that.
const CATCH_RANGE: f64 = 1.82;
// The estimator's corner, over the pendulum's frequency: fast enough for balance, slow enough for a 2000-count encoder.
const ESTIMATOR: f64 = 30.0;

impl<T: Real> Supervisor<T> {
    /// The standard supervisor of a rig at the sample period `h` (s): balance gain by [`design::balance`], everything else from the
    /// rig's parameters. Limits that the rig does not give: arm angle 2 pi, speeds well above what a sound run reaches.
    ///
    /// # Errors
    /// Those of [`design::balance`].
    pub fn new(params: &Params<f64>, limits: &Limits, h: f64) -> Result<Self, DesignError> {
        let regulator = design::balance(params, h)?;
        let k = params.coefficients();
        let frequency = libm::sqrt(k.weight / k.pendulum);
        let free_speed = k.drive * params.motor.command_limit / k.arm_damping.max(1e-9);
        let arm_angle = limits.arm_angle.unwrap_or(core::f64::consts::TAU);
        let arm_range = ARM_RANGE.min(arm_angle / CATCH_RANGE);
        let balance = StateFeedback::new(&regulator, params.motor.command_limit);
        let cast = params.cast::<T>();
        Ok(Self {
            speed: Derivative::new(T::from_f64(ESTIMATOR * frequency), T::from_f64(h)),
            swing_up: SwingUp::new(&cast, T::from_f64(arm_range)),
            balance,
            catch: Catch::new(&cast, T::from_f64(CATCH_RANGE * arm_range)),
            settings: Settings {
                arm_angle_limit: T::from_f64(arm_angle),
                arm_speed_limit: T::from_f64(limits.arm_speed.unwrap_or(1.5 * free_speed)),
                pendulum_speed_limit: T::from_f64(
                    limits.pendulum_speed.unwrap_or(10.0 * frequency),
                ),
                command_limit: T::from_f64(params.motor.command_limit),
                doubt_angle: c(0.4),
                release_angle: c(1.6),
                reference_speed: T::ONE,
                rest_speed: T::from_f64(0.05 * frequency),
                catch_every: 4,
            },
            h: T::from_f64(h),
        })
    }

    /// Idle, before the first sample.
    pub fn start(&self) -> SupervisorState<T> {
        SupervisorState {
            mode: Mode::Idle,
            fault: None,
            speeds: [self.speed.start(); 2],
            swing_up: self.swing_up.start(),
            arm_reference: T::ZERO,
            since_test: u32::MAX,
            resting: T::ZERO,
        }
    }

    /// The command for one sample: `theta`, `alpha` as measured (rad), the arm to go to `target` (rad) once the pendulum is up.
    ///
    /// Always a finite number within the command limit; 0 in the modes idle, stopping and fault.
    pub fn update(
        &self,
        state: &mut SupervisorState<T>,
        theta: T,
        alpha: T,
        target: T,
    ) -> Output<T> {
        let theta_dot = self.speed.update(&mut state.speeds[0], theta);
        let alpha_dot = self.speed.update(&mut state.speeds[1], alpha);
        let x = State::new(theta, alpha, theta_dot, alpha_dot);
        if state.mode != Mode::Fault
            && let Some(fault) = self.violation(&x)
        {
            state.mode = Mode::Fault;
            state.fault = Some(fault);
        }
        let target = if is_finite(target) { target } else { T::ZERO };
        let mode = self.next_mode(state, &x);
        if mode != state.mode {
            self.enter(state, mode, &x);
        }
        let u = match mode {
            Mode::SwingUp => {
                let centre = State::new(target, T::ZERO, T::ZERO, T::ZERO);
                self.swing_up
                    .update(&mut state.swing_up, &x, &centre, self.h)
            }
            Mode::Balance => {
                let step = self.settings.reference_speed * self.h;
                state.arm_reference += (target - state.arm_reference).clamp(-step, step);
                let reference = State::new(state.arm_reference, T::ZERO, T::ZERO, T::ZERO);
                self.balance.update(&mut (), &x, &reference, self.h)
            }
            Mode::Idle | Mode::Stopping | Mode::Fault => T::ZERO,
        };
        Output {
            u: command(u, self.settings.command_limit),
            mode,
            x,
        }
    }

    fn next_mode(&self, state: &mut SupervisorState<T>, x: &State<T>) -> Mode {
        match state.mode {
            Mode::SwingUp => {
                state.since_test = state.since_test.saturating_add(1);
                if state.since_test < self.settings.catch_every {
                    return Mode::SwingUp;
                }
                state.since_test = 0;
                if self.catch.succeeds(&self.balance, x) {
                    Mode::Balance
                } else {
                    Mode::SwingUp
                }
            }
            Mode::Balance => {
                let angle = wrap(x.alpha).abs();
                // Lost: let the swing-up brake the arm before it has run after the pendulum at full speed.
                let lost = angle > self.settings.doubt_angle
                    && !self.catch.holds(&self.balance, x, state.arm_reference);
                if lost || angle > self.settings.release_angle {
                    Mode::SwingUp
                } else {
                    Mode::Balance
                }
            }
            Mode::Stopping => {
                let rest = self.settings.rest_speed;
                let moving = x.theta_dot.abs() > rest || x.alpha_dot.abs() > rest;
                state.resting = if moving {
                    T::ZERO
                } else {
                    state.resting + self.h
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

    fn enter(&self, state: &mut SupervisorState<T>, mode: Mode, x: &State<T>) {
        state.mode = mode;
        match mode {
            // From where the arm is: no jump in the command.
            Mode::Balance => state.arm_reference = x.theta,
            Mode::SwingUp => state.swing_up = self.swing_up.start(),
            Mode::Idle | Mode::Stopping | Mode::Fault => {}
        }
    }

    fn violation(&self, x: &State<T>) -> Option<Fault> {
        let s = &self.settings;
        if !x.is_finite() {
            return Some(Fault::NotANumber);
        }
        if x.theta.abs() > s.arm_angle_limit {
            return Some(Fault::ArmAngle {
                angle: x.theta.value(),
                limit: s.arm_angle_limit.value(),
            });
        }
        if x.theta_dot.abs() > s.arm_speed_limit {
            return Some(Fault::ArmSpeed {
                speed: x.theta_dot.value(),
                limit: s.arm_speed_limit.value(),
            });
        }
        if x.alpha_dot.abs() > s.pendulum_speed_limit {
            return Some(Fault::PendulumSpeed {
                speed: x.alpha_dot.value(),
                limit: s.pendulum_speed_limit.value(),
            });
        }
        None
    }
}

impl<T: Real> SupervisorState<T> {
    /// The present mode.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Why the motor was switched off, while in [`Mode::Fault`].
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
