//! Angles and speeds from counts: the rig's model, corrected by what is measured.

use super::{Design, Estimate, Estimator, Measurement};
use crate::config::ConfigError;
use crate::real::Real;
use crate::settings::{ParameterSpec, Settings, Spec};
use crate::site::Site;
use furuta_model::{Plant, PlantState, State};

/// What a controller file may say of it.
pub(super) static SPEC: Spec = Spec {
    id: "observer",
    sentence: "The rig's model with its effects, corrected by what is measured; knows the state a period ahead, bridges lost samples",
    parameters: &[
        ParameterSpec::number(
            "bandwidth",
            "rad/s",
            1.0,
            1e5,
            "how quickly measurements correct the model: fast against the mechanics, slow against the counts",
        )
        .or(120.0),
    ],
};

/// Observer with the model as its predictor and fixed gains, such that the correction of each axis, taken alone, has a
/// double pole: angle by `1 - z^2`, speed by `(1 - z)^2 / h`, `z = exp(-bandwidth * h)`.
///
/// A differentiating filter alone would lag behind by the accelerations, which the model knows; and the model bridges
/// lost samples and the period's delay until a command acts.
#[derive(Clone, Debug)]
pub struct Observer<T: Real> {
    plant: Plant<T>,
    period: T,
    angle_gain: T,
    speed_gain: T,
}

/// What an [`Observer`] remembers.
#[derive(Clone, Debug)]
pub struct Belief<T: Real> {
    now: PlantState<T>,
    held: T,
    started: bool,
}

/// More lost samples than this are not bridged: the belief starts anew at the angles measured.
const BRIDGED: u32 = 50;

impl<T: Real> Observer<T> {
    /// With this model at the sample period `period` (s) and `bandwidth` (rad/s).
    pub fn new(plant: Plant<T>, period: T, bandwidth: T) -> Self {
        let z = (-bandwidth * period).exp();
        let slow = T::ONE - z;
        Self {
            plant,
            period,
            angle_gain: T::ONE - z * z,
            speed_gain: slow * slow / period,
        }
    }

    /// True angles behind measured ones, where the model knows of an offset.
    fn unread(&self, m: &Measurement<T>) -> [T; 2] {
        let [theta, alpha] = self.plant.reading([m.theta, m.alpha]);
        [m.theta + m.theta - theta, m.alpha + m.alpha - alpha]
    }

    /// The belief at this sample.
    fn correct(&self, belief: &mut Belief<T>, m: &Measurement<T>) {
        if !belief.started || m.periods > BRIDGED || !belief.now.x.is_finite() {
            belief.started = true;
            let [theta, alpha] = self.unread(m);
            belief.now = self.plant.rest(State::new(theta, alpha, T::ZERO, T::ZERO));
        } else {
            for _ in 0..m.periods {
                self.plant.step(&mut belief.now, belief.held, self.period);
            }
            let [theta, alpha] = self.plant.measure(&belief.now);
            let (e, f) = (m.theta - theta, m.alpha - alpha);
            let x = &mut belief.now.x;
            x.theta += self.angle_gain * e;
            x.alpha += self.angle_gain * f;
            x.theta_dot += self.speed_gain * e;
            x.alpha_dot += self.speed_gain * f;
        }
        belief.held = m.held;
    }
}

impl<T: Real> Design for Observer<T> {
    fn design(settings: &Settings, site: &Site<'_>) -> Result<Self, ConfigError> {
        let plant: Plant<f64> = Plant::new(site.params, site.effects)?;
        plant.check_period(site.period)?;
        let bandwidth = settings.number("bandwidth").unwrap_or(120.0);
        Ok(Self::new(
            plant.cast(),
            T::from_f64(site.period),
            T::from_f64(bandwidth),
        ))
    }
}

impl<T: Real> Estimator<T> for Observer<T> {
    type State = Belief<T>;

    fn start(&self) -> Belief<T> {
        Belief {
            now: self.plant.rest(State::hanging()),
            held: T::ZERO,
            started: false,
        }
    }

    fn update(&self, belief: &mut Belief<T>, m: &Measurement<T>) -> Estimate<T> {
        self.correct(belief, m);
        let mut next = belief.now.clone();
        self.plant.step(&mut next, belief.held, self.period);
        Estimate {
            now: belief.now.x,
            ahead: next.x,
        }
    }
}
