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
mod fault;
mod modes;
mod thresholds;

pub use brake::{Brake, Braking};
pub use catch::Catch;
pub use fault::Fault;
pub use modes::{Mode, Request};
pub use thresholds::{LIMITS, SPEC, Thresholds};

use crate::compensation::{Compensation, Situation};
use crate::config::{Config, ConfigError};
use crate::controllers::{
    AnyController, AnyControllerState, Controller, Design, StateFeedback, SwingUp, SwingUpState,
};
use crate::design;
use crate::estimators::{AnyEstimator, AnyEstimatorState, Estimate, Estimator, Measurement};
use crate::real::{Real, command, is_finite};
use crate::site::Site;
use furuta_model::State;

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
        let site = &thresholds::within(&config.limits, site);
        let swing_up = SwingUp::design(&config.swing_up, site)?;
        let balance = AnyController::design(&config.controller, site)?;
        let stand_in = match balance.stand_in() {
            Some(feedback) => feedback,
            None => StateFeedback::new(
                &design::balance(site.params, site.period)?,
                site.command_limit,
            ),
        };
        let number = |key| T::from_f64(config.supervisor.value(key));
        let catch = Catch::new(&site.params.cast(), stand_in, swing_up.catch_range()).within(
            number(const { thresholds::SPEC.parameter("catch_angle").settled() }),
            number(const { thresholds::SPEC.parameter("catch_error").settled() }),
        );
        Ok(Self {
            estimator: AnyEstimator::design(&config.estimator, site)?,
            swing_up: swing_up.aiming_at(catch.fastest()),
            balance,
            catch,
            compensation: Compensation::design(&config.compensate, site)?,
            thresholds: Thresholds::of(&config.supervisor, site),
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
        if let Some(fault) = self.thresholds.violation(&now) {
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
}
