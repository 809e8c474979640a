//! A control system of one rig, and its memory.

use super::brake::{Brake, Braking};
use super::catch::Catch;
use super::fault::Fault;
use super::mode::Mode;
use crate::compensation::Compensation;
use crate::config::Config;
use crate::controllers::{
    AnyController, AnyControllerState, Controller, Design, StateFeedback, SwingUp, SwingUpState,
    counts_delay_once,
};
use crate::design;
use crate::error::ConfigError;
use crate::estimators::{AnyEstimator, AnyEstimatorState, Estimator};
use crate::numbers::{Number, listed};
use crate::real::{Real, c};
use crate::site::Site;
use crate::thresholds::{SPEC, Thresholds, within};
use crate::trajectory::{Follower, FollowerState};
use furuta_model::Plant;
use furuta_model::linear_plant::smooth;

/// A jump of the command at the catch that is small enough, of the command limit.
pub(super) const SMALL_JUMP: f64 = 0.1;

/// Balancing is given up where full braking would stop the arm beyond this share of its limit.
pub(super) const LAST_BRAKE: f64 = 0.9;
/// No catch is tried where it would stop beyond this: the distance from the other is a hysteresis.
pub(super) const CATCH_BRAKE: f64 = 0.7;

/// Swing-up, catch and balance of one rig at one sample period. Configuration only: see [`SupervisorState`].
#[derive(Clone, Debug)]
pub struct Supervisor<T: Real> {
    /// From measurements to states.
    pub estimator: AnyEstimator<T>,
    /// Brings the pendulum up.
    pub swing_up: SwingUp<T>,
    /// Does so along a trajectory from hanging at rest, where the controller file has one.
    pub follower: Option<Follower<T>>,
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
    pub(super) h: T,
}

/// Memory of a [`Supervisor`].
#[derive(Clone, Debug)]
pub struct SupervisorState<T: Real> {
    pub(super) mode: Mode,
    pub(super) fault: Option<Fault>,
    pub(super) estimator: AnyEstimatorState<T>,
    pub(super) swing_up: SwingUpState<T>,
    pub(super) following: FollowerState<T>,
    pub(super) balance: AnyControllerState<T>,
    /// Where the balance controller is asked to hold the arm just now, rad.
    pub(super) arm_reference: T,
    /// The last command, V.
    pub(super) u: T,
    /// What is left of the commands' difference at the catch, V; `None` before the first command that balances.
    pub(super) bump: Option<T>,
    /// Samples since the last test of the catch.
    pub(super) since_test: u32,
    /// By how much the command would have jumped at the last test, had the pendulum been caught, V.
    pub(super) catch_jump: Option<T>,
    /// For how long both axes have been at rest, s.
    pub(super) resting: T,
    /// While in [`Mode::Braking`].
    pub(super) braking: Braking<T>,
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
        counts_delay_once(&config.controller, &config.estimator)?;
        let balance = AnyController::design(&config.controller, site)?;
        let surrogate = match balance.surrogate() {
            Some(feedback) => feedback,
            None => {
                let (a, b) = site.upright()?;
                let standard = design::dlqr(&a, &b, &design::balance_weights(site.params))?;
                StateFeedback::new(&standard, site.command_limit)
            }
        };
        let compensation = Compensation::design(&config.compensate, site)?;
        let number = |key| T::from_f64(config.supervisor.value(key));
        let smooth = smooth(&Plant::new(site.params, site.effects)?).cast();
        let holds = compensation.holds();
        let catch = Catch::new(&site.params.cast(), surrogate, swing_up.catch_range());
        let catch = catch.on(smooth, holds).within(
            number(const { SPEC.parameter("catch_angle").settled() }),
            number(const { SPEC.parameter("catch_error").settled() }),
        );
        Ok(Self {
            estimator: AnyEstimator::design(&config.estimator, site)?,
            swing_up: swing_up.aiming_at(catch.fastest()),
            follower: config
                .trajectory
                .clone()
                .map(|trajectory| Follower::new(trajectory, site)),
            balance,
            catch,
            compensation,
            thresholds: Thresholds::of(&config.supervisor, site),
            brake: Brake::new(site.params, site.command_limit, site.period),
            h: T::from_f64(site.period),
        })
    }

    /// Every number that its commands depend on, by name; what is not told so are the rig's effects, and the kinds of
    /// estimator and controller (`spec().id`). `false` where one of these cannot be told by numbers alone.
    pub fn numbers(&self, put: &mut impl FnMut(&'static str, Number<'_, T>)) -> bool {
        let t = &self.thresholds;
        let single = [
            ("PERIOD", self.h),
            ("ARM_ANGLE_LIMIT", t.arm_angle_limit),
            ("ARM_SPEED_LIMIT", t.arm_speed_limit),
            ("PENDULUM_SPEED_LIMIT", t.pendulum_speed_limit),
            ("COMMAND_LIMIT", t.command_limit),
            ("DOUBT_ANGLE", t.doubt_angle),
            ("RELEASE_ANGLE", t.release_angle),
            ("REFERENCE_SPEED", t.reference_speed),
            ("REST_SPEED", t.rest_speed),
            ("BLEND", t.blend),
            ("SMALL_JUMP", c::<T>(SMALL_JUMP) * t.command_limit),
            ("LAST_BRAKE", c::<T>(LAST_BRAKE) * t.arm_angle_limit),
            ("CATCH_BRAKE", c::<T>(CATCH_BRAKE) * t.arm_angle_limit),
        ];
        for (name, value) in single {
            put(name, Number::Real(&[value]));
        }
        put("CATCH_EVERY", Number::Whole(t.catch_every));
        let model = &self.catch.plant().coefficients;
        put("MODEL", Number::Real(&listed(model)));
        self.catch.numbers(put);
        self.swing_up.numbers(put);
        self.brake.numbers(put);
        self.compensation.numbers(put);
        let estimator = self.estimator.numbers(put);
        self.balance.numbers(put) && estimator && self.follower.is_none()
    }

    /// Idle, before the first sample.
    pub fn start(&self) -> SupervisorState<T> {
        SupervisorState {
            mode: Mode::Idle,
            fault: None,
            estimator: self.estimator.start(),
            swing_up: self.swing_up.start(),
            following: FollowerState::new(),
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
}

impl<T: Real> SupervisorState<T> {
    /// What the swing-up remembers.
    pub fn swing_up_state(&self) -> &SwingUpState<T> {
        &self.swing_up
    }

    /// How far the trajectory of the controller file has been followed.
    pub fn following(&self) -> &FollowerState<T> {
        &self.following
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
