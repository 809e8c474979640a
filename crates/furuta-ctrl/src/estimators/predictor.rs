//! What the estimators that know the rig's model have in common: they carry it along, and look ahead with it.

use super::{Estimate, Measurement};
use crate::error::ConfigError;
use crate::real::Real;
use crate::section::{ParameterSpec, Settings};
use crate::site::Site;
use furuta_model::{Plant, PlantState, State};

/// More lost samples than this are not bridged: the belief starts anew at the angles measured.
const BRIDGED: u32 = 50;

/// The setting that every estimator with a model has.
pub(super) const PREDICT: ParameterSpec = ParameterSpec::switch(
    "predict",
    true,
    "whether to look ahead over the delay of the command that the rig file names, too",
);

/// The rig's model with its effects, stepped from sample to sample.
#[derive(Clone, Debug)]
pub(super) struct Predictor<T: Real> {
    pub(super) plant: Plant<T>,
    pub(super) period: T,
    /// How late a command acts after the sample from which it is held: in whole periods, and the rest as a share of
    /// one.
    late: (u32, T),
}

/// What an estimator with a model remembers.
#[derive(Clone, Debug)]
pub struct Belief<T: Real> {
    now: PlantState<T>,
    held: T,
    started: bool,
}

impl<T: Real> Predictor<T> {
    pub(super) fn new(plant: Plant<T>, period: T, predict: bool) -> Self {
        let delay = if predict { plant.delay() } else { T::ZERO };
        let periods = delay.value() / period.value();
        // A plant whose delay spans more samples than it can remember cannot be stepped at all.
        let whole = libm::floor(periods).clamp(0.0, 1e3);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let late = (whole as u32, T::from_f64(periods.min(1e3) - whole));
        Self {
            plant,
            period,
            late,
        }
    }

    pub(super) fn design(settings: &Settings, site: &Site<'_>) -> Result<Self, ConfigError> {
        let plant: Plant<f64> = Plant::new(site.params, site.effects)?;
        plant.check_period(site.period)?;
        Ok(Self::new(
            plant.cast(),
            T::from_f64(site.period),
            settings.is_on(const { PREDICT.settled() }),
        ))
    }

    /// How many periods beyond the next sample an estimate lies ahead.
    pub(super) fn ahead(&self) -> f64 {
        f64::from(self.late.0) + self.late.1.value()
    }

    pub(super) fn start(&self) -> Belief<T> {
        Belief {
            now: self.plant.rest(State::hanging()),
            held: T::ZERO,
            started: false,
        }
    }

    /// Carries the belief to this sample with what the motor held and `extra` volts beside it, and returns by how much
    /// the angles measured differ from those expected; `None` where the belief begins anew at the angles measured.
    pub(super) fn follow(
        &self,
        belief: &mut Belief<T>,
        m: &Measurement<T>,
        extra: T,
    ) -> Option<[T; 2]> {
        let innovation = if belief.started && m.periods <= BRIDGED && belief.now.x.is_finite() {
            for _ in 0..m.periods {
                self.plant
                    .step(&mut belief.now, belief.held + extra, self.period);
            }
            let [theta, alpha] = self.plant.expected(&belief.now);
            Some([m.theta - theta, m.alpha - alpha])
        } else {
            belief.started = true;
            let [theta, alpha] = self.unread(m);
            belief.now = self.plant.rest(State::new(theta, alpha, T::ZERO, T::ZERO));
            None
        };
        belief.held = m.held;
        innovation
    }

    /// True angles behind measured ones, where the model knows of an offset.
    fn unread(&self, m: &Measurement<T>) -> [T; 2] {
        let [theta, alpha] = self.plant.reading([m.theta, m.alpha]);
        [m.theta + m.theta - theta, m.alpha + m.alpha - alpha]
    }

    /// Adds to the state, in the order `[theta, alpha, theta_dot, alpha_dot]` of what the encoders are mounted on.
    pub(super) fn correct(&self, belief: &mut Belief<T>, by: [T; 4]) {
        let mut x = self.seen(belief).to_array();
        for (x, by) in x.iter_mut().zip(by) {
            *x += by;
        }
        self.plant.place(&mut belief.now, State::from(x));
    }

    /// The state of what the encoders are mounted on.
    pub(super) fn seen(&self, belief: &Belief<T>) -> State<T> {
        self.plant.seen(&belief.now)
    }

    /// The state at the sample, and at the time from which a command given now can act.
    pub(super) fn estimate(&self, belief: &Belief<T>, extra: T) -> Estimate<T> {
        let (whole, part) = self.late;
        let mut next = belief.now.clone();
        let mut step = || {
            self.plant.step(&mut next, belief.held + extra, self.period);
            next.x
        };
        let mut ahead = step();
        // What acts meanwhile was commanded before now, and the model remembers it.
        for _ in 0..whole {
            ahead = step();
        }
        if part > T::ZERO {
            let (from, to) = (ahead.to_array(), step().to_array());
            ahead = State::from(core::array::from_fn(|i| from[i] + part * (to[i] - from[i])));
        }
        Estimate {
            now: belief.now.x,
            ahead,
            disturbance: extra,
        }
    }
}
