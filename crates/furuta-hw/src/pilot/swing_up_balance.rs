//! Swings the pendulum up by its energy and balances it: design, controllers and catch of `furuta-ctrl`, on the
//! estimates of an observer that knows the rig's model.

use furuta_ctrl::controllers::{Controller, StateFeedback, SwingUpState};
use furuta_ctrl::design::DesignError;
use furuta_ctrl::supervisor::{Limits, Supervisor};
use furuta_ctrl::wrap;
use furuta_log::Mode;
use furuta_model::{Plant, Rig, State};

use super::observer::{Belief, Observer};
use super::{Decision, Measurement, Pilot, Reference};

/// Bandwidth of the observer (rad/s).
const BANDWIDTH: f64 = 120.0;

/// Swings the pendulum up and balances it, the arm at a reference; again if it falls.
#[derive(Clone, Debug)]
pub struct SwingUpBalance {
    observer: Observer,
    plant: Plant<f64>,
    control: Supervisor<f64>,
    reference: Reference,
    period: f64,
}

impl SwingUpBalance {
    /// Designs the controllers for a rig at this sampling period (s). Effects of the rig file are left out of the
    /// design, but the observer knows them, and so does the voltage that holds the arm.
    ///
    /// # Errors
    /// [`DesignError`] where no gain stabilises the rig.
    pub fn design(rig: &Rig, period: f64, reference: Reference) -> Result<Self, DesignError> {
        let furuta_model::Limits {
            arm_angle,
            arm_speed,
            pendulum_speed,
        } = rig.limits;
        let limits = Limits {
            arm_angle,
            arm_speed,
            pendulum_speed,
        };
        let control = Supervisor::new(&rig.params, &limits, period)?;
        let plant = rig.plant();
        let observer = Observer::new(plant.clone(), period, BANDWIDTH);
        Ok(Self {
            observer,
            plant,
            control,
            reference,
            period,
        })
    }

    /// The balance controller's gain on `[theta, alpha, theta_dot, alpha_dot]` (V/rad, V s/rad).
    #[must_use]
    pub fn gain(&self) -> [f64; 4] {
        self.control.balance.gain
    }

    /// In words, for the log.
    #[must_use]
    pub fn describe(&self) -> String {
        format!(
            "energy swing-up; LQR u = -K x, K = {:.3?}; {}",
            self.gain(),
            self.reference
        )
    }

    /// Whether the pendulum falls whatever the balance controller does: better swing it up again than let the arm run
    /// after it. While it still rises, nothing is lost: a catch at the edge of what the model promises would be given
    /// up and tried again at every other sample.
    fn is_lost(&self, x: &State<f64>, reference: f64) -> bool {
        let settings = &self.control.settings;
        let alpha = wrap(x.alpha);
        let falling = alpha * x.alpha_dot > 0.0;
        let doubtful = falling && alpha.abs() > settings.doubt_angle;
        alpha.abs() > settings.release_angle
            || doubtful
                && !self
                    .control
                    .catch
                    .holds(&self.control.balance, x, reference)
    }

    /// `u = hold(reference) - K (x - x_reference)`.
    fn regulate(&self, x: &State<f64>, reference: f64) -> f64 {
        let StateFeedback { command_limit, .. } = self.control.balance;
        let feedback = self.control.balance.unlimited(x, &arm_at(reference));
        (self.hold(reference) + feedback).clamp(-command_limit, command_limit)
    }

    /// Voltage that holds the arm at `reference` with the pendulum upright, by the model: 0 unless the rig file knows
    /// an effect that pulls, such as a spring. Found from the arm's accelerations at 0 V and at 1 V.
    fn hold(&self, reference: f64) -> f64 {
        if self.plant.effects().is_empty() {
            return 0.0;
        }
        let x = arm_at(reference);
        let stick_rate = 1.0 / self.period;
        let [free, pushed] = [0.0, 1.0].map(|u| {
            self.plant
                .rate(0.0, &x, self.plant.volts(u), stick_rate)
                .theta_dot
        });
        let volts = -free / (pushed - free);
        // Where friction holds the arm by itself, no voltage is needed (and 1 V changes nothing).
        if volts.is_finite() { volts } else { 0.0 }
    }
}

impl Pilot for SwingUpBalance {
    type State = SwingUpBalanceState;

    fn start(&self) -> SwingUpBalanceState {
        SwingUpBalanceState {
            belief: self.observer.start(),
            swing_up: self.control.swing_up.start(),
            balancing: None,
        }
    }

    fn process(&self, state: &mut SwingUpBalanceState, m: &Measurement) -> Decision {
        let x = self.observer.correct(&mut state.belief, m);
        // A command given now acts from the next sample on: decide for the state of then.
        let next = self.observer.predict(&state.belief).x;
        state.balancing = match state.balancing {
            Some(b) if !self.is_lost(&next, b.arm) => Some(b),
            Some(_) => {
                state.swing_up = self.control.swing_up.start();
                None
            }
            None if self.control.catch.succeeds(&self.control.balance, &next) => Some(Balancing {
                since: m.t,
                arm: next.theta,
            }),
            None => None,
        };
        let (volts, reference, mode) = match &mut state.balancing {
            Some(b) => {
                // From where the arm caught the pendulum to where it is to be, at a speed that does not upset it.
                let step =
                    self.control.settings.reference_speed * self.period * f64::from(m.periods);
                let target = self.reference.at(m.t - b.since);
                b.arm += (target - b.arm).clamp(-step, step);
                (self.regulate(&next, b.arm), b.arm, Mode::Balance)
            }
            None => {
                let volts = self.control.swing_up.update(
                    &mut state.swing_up,
                    &next,
                    &arm_at(0.0),
                    self.period,
                );
                (volts, 0.0, Mode::SwingUp)
            }
        };
        Decision {
            volts,
            theta_dot: x.theta_dot,
            alpha_dot: x.alpha_dot,
            reference,
            mode,
        }
    }
}

/// What a [`SwingUpBalance`] remembers.
#[derive(Clone, Debug)]
pub struct SwingUpBalanceState {
    belief: Belief,
    swing_up: SwingUpState<f64>,
    balancing: Option<Balancing>,
}

/// Since when the pendulum is balanced (s), and where the arm is asked to be just now (rad).
#[derive(Copy, Clone, Debug)]
struct Balancing {
    since: f64,
    arm: f64,
}

fn arm_at(theta: f64) -> State<f64> {
    State::new(theta, 0.0, 0.0, 0.0)
}
