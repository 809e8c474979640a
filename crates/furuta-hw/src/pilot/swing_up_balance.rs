//! Swings the pendulum up by its energy and balances it with a linear-quadratic regulator.

use std::f64::consts::{PI, TAU};

use furuta_ctrl::design::{DesignError, Weights, dlqr};
use furuta_log::Mode;
use furuta_model::discretize::zero_order_hold;
use furuta_model::{Plant, PlantState, Rig, State, linearize};
use nalgebra::SMatrix;

use super::observer::{Belief, Observer};
use super::{Decision, Measurement, Pilot, Reference};

/// Bandwidth of the observer [rad/s].
const BANDWIDTH: f64 = 120.0;
/// Beyond this angle from upright a balancing pendulum counts as fallen [rad].
const FALLEN: f64 = 1.0;
/// Within this angle from upright it is asked, at every sample, whether the regulator would catch the pendulum [rad].
const CATCH_ZONE: f64 = 0.6;
/// The question is answered by simulating so long [s].
const CATCH_HORIZON: f64 = 0.6;
/// Step of that simulation [s].
const CATCH_STEP: f64 = 0.004;
/// The arm may move so far while catching [rad].
const CATCH_ARM: f64 = 2.0;
/// How much of the command limit draws the arm to its middle while swinging up [1/rad]: enough that it does not wander
/// off, little enough that it does not work against the pumping.
const ARM_PULL: f64 = 0.1;

/// Swings the pendulum up and balances it, the arm at a reference; again if it falls.
#[derive(Clone, Debug)]
pub struct SwingUpBalance {
    observer: Observer,
    plant: Plant<f64>,
    gain: [f64; 4],
    command_limit: f64,
    reference: Reference,
    /// Samples per second.
    rate: f64,
}

impl SwingUpBalance {
    /// Designs the regulator for a rig, its effects left out, at this sampling period [s]. Weights by Bryson's rule:
    /// 0.5 rad of the arm, 0.2 rad of the pendulum, 10 rad/s of each and half the command limit cost the same.
    ///
    /// # Errors
    /// [`DesignError`] where no gain stabilises the rig.
    pub fn design(rig: &Rig, period: f64, reference: Reference) -> Result<Self, DesignError> {
        let nominal = rig.nominal_plant();
        let upright = linearize(&nominal, State::default(), 0.0);
        let (a, b) = zero_order_hold(&upright.a, &upright.b, period);
        let command_limit = rig.params.motor.command_limit;
        let weights = Weights::bryson([0.5, 0.2, 10.0, 10.0], [0.5 * command_limit]);
        let gain: SMatrix<f64, 1, 4> = dlqr(&a, &b, &weights)?.gain;
        let plant = rig.plant();
        let observer = Observer::new(plant.clone(), period, BANDWIDTH);
        Ok(Self {
            observer,
            plant,
            gain: [gain[0], gain[1], gain[2], gain[3]],
            command_limit,
            reference,
            rate: 1.0 / period,
        })
    }

    /// The regulator's gain on `[theta, alpha, theta_dot, alpha_dot]` [V/rad, V s/rad].
    #[must_use]
    pub fn gain(&self) -> [f64; 4] {
        self.gain
    }

    /// In words, for the log.
    #[must_use]
    pub fn describe(&self) -> String {
        format!(
            "energy swing-up; LQR u = -K x, K = {:.3?}; reference {:?}",
            self.gain, self.reference
        )
    }

    fn clip(&self, volts: f64) -> f64 {
        volts.clamp(-self.command_limit, self.command_limit)
    }

    /// `u = hold(reference) - K (x - x_reference)`.
    fn regulate(&self, x: &State<f64>, reference: f64) -> f64 {
        let [k1, k2, k3, k4] = self.gain;
        let feedback = k1 * (x.theta - reference)
            + k2 * from_upright(x.alpha)
            + k3 * x.theta_dot
            + k4 * x.alpha_dot;
        self.clip(self.hold(reference) - feedback)
    }

    /// Voltage that holds the arm at `reference` with the pendulum upright, by the model: 0 unless the rig file knows
    /// an effect that pulls, such as a spring. Found from the arm's accelerations at 0 V and at 1 V.
    fn hold(&self, reference: f64) -> f64 {
        if self.plant.effects().is_empty() {
            return 0.0;
        }
        let x = State::new(reference, 0.0, 0.0, 0.0);
        let [free, pushed] = [0.0, 1.0].map(|u| {
            self.plant
                .rate(0.0, &x, self.plant.volts(u), self.rate)
                .theta_dot
        });
        let volts = -free / (pushed - free);
        // Where friction holds the arm by itself, no voltage is needed (and 1 V changes nothing).
        if volts.is_finite() { volts } else { 0.0 }
    }

    /// Pumps energy: `dE/dt = m L c cos(alpha) alpha_dot theta_ddot` (K. J. Astrom, K. Furuta, Automatica 36 (2000)
    /// 287), so the arm is accelerated along `alpha_dot cos(alpha)` while energy is missing, and drawn to its middle.
    fn pump(&self, x: &State<f64>) -> f64 {
        let c = &self.plant.coefficients;
        let full = 2.0 * c.weight; // from hanging to upright
        let energy =
            0.5 * c.pendulum * x.alpha_dot * x.alpha_dot + c.weight * (x.alpha.cos() - 1.0);
        // A little more than enough, for friction takes some on the way.
        let missing = (10.0 * (0.03 - energy / full)).clamp(-1.0, 1.0);
        let along = if x.alpha_dot * x.alpha.cos() >= 0.0 {
            1.0
        } else {
            -1.0
        };
        self.clip(self.command_limit * (missing * along - ARM_PULL * x.theta))
    }

    /// Whether the regulator would catch the pendulum from here: asked of the model.
    fn catches(&self, from: &PlantState<f64>) -> bool {
        let mut s = from.clone();
        let begin = s.x.theta;
        let mut t = 0.0;
        while t < CATCH_HORIZON {
            let u = self.regulate(&s.x, begin);
            self.plant.step(&mut s, u, CATCH_STEP);
            if from_upright(s.x.alpha).abs() > FALLEN || (s.x.theta - begin).abs() > CATCH_ARM {
                return false;
            }
            t += CATCH_STEP;
        }
        from_upright(s.x.alpha).abs() < 0.1
    }
}

impl Pilot for SwingUpBalance {
    type State = SwingUpBalanceState;

    fn start(&self) -> SwingUpBalanceState {
        SwingUpBalanceState {
            belief: self.observer.start(),
            balancing: None,
        }
    }

    fn process(&self, state: &mut SwingUpBalanceState, m: &Measurement) -> Decision {
        let x = self.observer.correct(&mut state.belief, m);
        // A command given now acts from the next sample on: decide for the state of then.
        let next = self.observer.predict(&state.belief);
        let angle = from_upright(next.x.alpha).abs();
        state.balancing = match state.balancing {
            Some(catch) if angle < FALLEN => Some(catch),
            None if angle < CATCH_ZONE && self.catches(&next) => Some(Catch {
                t: m.t,
                theta: next.x.theta,
            }),
            _ => None,
        };
        let (volts, reference, mode) = match &state.balancing {
            Some(catch) => {
                let reference = catch.reference(m.t, &self.reference);
                (self.regulate(&next.x, reference), reference, Mode::Balance)
            }
            None => (self.pump(&next.x), 0.0, Mode::SwingUp),
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
    balancing: Option<Catch>,
}

/// When and where the pendulum was caught.
#[derive(Copy, Clone, Debug)]
struct Catch {
    t: f64,
    theta: f64,
}

impl Catch {
    /// The arm is led from where it caught the pendulum to where it is to be within a second.
    fn reference(&self, t: f64, reference: &Reference) -> f64 {
        let since = t - self.t;
        reference.at(since) + self.theta * (1.0 - since).max(0.0)
    }
}

/// The angle from upright in (-pi, pi], turns left out.
fn from_upright(alpha: f64) -> f64 {
    let turned = alpha.rem_euclid(TAU);
    if turned > PI { turned - TAU } else { turned }
}
