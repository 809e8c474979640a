//! Swings the pendulum up and balances it: the control system of a controller file, on the loop's measurements.

use furuta_ctrl::estimators::Measurement as Sampled;
use furuta_ctrl::supervisor::{Mode as Doing, Request, Supervisor, SupervisorState};
use furuta_ctrl::{Config, ConfigError, Site};
use furuta_log::Mode;
use furuta_model::Rig;

use super::{Decision, Measurement, Pilot, Reference};

/// Swings the pendulum up and balances it, the arm at a reference; again if it falls.
#[derive(Clone, Debug)]
pub struct SwingUpBalance {
    supervisor: Supervisor<f64>,
    reference: Reference,
}

impl SwingUpBalance {
    /// The standard control system of a rig at this sampling period (s). Effects of the rig file are left out of the
    /// design, but the observer knows them, and so does the voltage that holds the arm.
    ///
    /// # Errors
    /// [`ConfigError`] where no gain stabilises the rig.
    pub fn design(rig: &Rig, period: f64, reference: Reference) -> Result<Self, ConfigError> {
        Self::from_config(&Config::default(), rig, period, reference)
    }

    /// What a controller file says, for a rig at this sampling period (s).
    ///
    /// # Errors
    /// [`ConfigError`] where this rig has no such controller.
    pub fn from_config(
        config: &Config,
        rig: &Rig,
        period: f64,
        reference: Reference,
    ) -> Result<Self, ConfigError> {
        let supervisor = Supervisor::design(config, &Site::of(rig, period))?;
        Ok(Self {
            supervisor,
            reference,
        })
    }

    /// The control system that decides.
    #[must_use]
    pub fn supervisor(&self) -> &Supervisor<f64> {
        &self.supervisor
    }

    /// In words, for the log.
    #[must_use]
    pub fn describe(&self) -> String {
        let spec = self.supervisor.balance.spec();
        let gain = match self.supervisor.catch.feedback.gain {
            k if spec.id == "lqr" => format!("LQR u = -K x, K = {k:.3?}"),
            _ => spec.id.to_owned(),
        };
        let swing_up = match &self.supervisor.follower {
            Some(_) => "swing-up along a trajectory, else by energy",
            None => "energy swing-up",
        };
        format!("{swing_up}; {gain}; {}", self.reference)
    }
}

impl Pilot for SwingUpBalance {
    type State = SwingUpBalanceState;

    fn start(&self) -> SwingUpBalanceState {
        let mut supervisor = self.supervisor.start();
        supervisor.request(Request::Start);
        SwingUpBalanceState {
            supervisor,
            since: None,
        }
    }

    fn process(&self, state: &mut SwingUpBalanceState, m: &Measurement) -> Decision {
        let target = self
            .reference
            .at(state.since.map_or(0.0, |since| m.t - since));
        let sampled = Sampled {
            theta: m.theta,
            alpha: m.alpha,
            held: m.held,
            periods: m.periods,
        };
        let out = self
            .supervisor
            .update(&mut state.supervisor, &sampled, target);
        state.since = match out.mode {
            Doing::Balance => state.since.or(Some(m.t)),
            _ => None,
        };
        Decision {
            volts: out.u,
            theta_dot: out.x.theta_dot,
            alpha_dot: out.x.alpha_dot,
            reference: out.reference,
            mode: match out.mode {
                Doing::SwingUp => Mode::SwingUp,
                Doing::Balance => Mode::Balance,
                Doing::Braking => Mode::Brake,
                Doing::Idle | Doing::Stopping | Doing::Fault => Mode::Off,
            },
            fault: state.supervisor.fault(),
        }
    }
}

/// What a [`SwingUpBalance`] remembers.
#[derive(Clone, Debug)]
pub struct SwingUpBalanceState {
    supervisor: SupervisorState<f64>,
    /// Since when the pendulum is balanced, s.
    since: Option<f64>,
}
