//! The observer that learns what else drives the arm.

use super::fixed_gain::rows;
use super::kalman::{filter_gain, pushed};
use super::noise::{COMMAND, Noise, PENDULUM, READING};
use super::predictor::{Belief, PREDICT, Predictor};
use super::{Design, Estimate, Estimator, Measurement};
use crate::error::ConfigError;
use crate::numbers::Number;
use crate::real::{Real, is_finite};
use crate::section::{ParameterSpec, Settings, Spec};
use crate::site::Site;
use nalgebra::SMatrix;

/// What a controller file may say of it.
pub(super) static SPEC: Spec = Spec {
    id: "disturbance_observer",
    sentence: "Kalman filter that also estimates a slowly changing voltage beside the command: friction, \
        cables, whatever the model lacks; it is then compensated",
    parameters: &[
        ParameterSpec::number(
            "wander",
            "V/s^0.5",
            1e-6,
            1e6,
            "how far that voltage wanders in a second, RMS: larger learns faster and shakes more; a fifth \
             of the largest command if left out",
        ),
        COMMAND,
        PENDULUM,
        READING,
        PREDICT,
    ],
};

/// Of the command that the disturbance may be worth: what is left must balance.
const AT_MOST: f64 = 0.5;

/// Steady-state Kalman filter for `[x, d]`, where `d` (V) acts beside the command and is a random walk.
///
/// The model predicts with its effects; `d` is what they do not explain. [`crate::compensation`] takes it off the
/// command again.
#[derive(Clone, Debug)]
pub struct DisturbanceObserver<T: Real> {
    predictor: Predictor<T>,
    gain: [[T; 2]; 5],
    limit: T,
}

/// A belief and the disturbance.
#[derive(Clone, Debug)]
pub struct DisturbedBelief<T: Real> {
    belief: Belief<T>,
    /// V.
    disturbance: T,
}

impl<T: Real> Design for DisturbanceObserver<T> {
    fn design(settings: &Settings, site: &Site<'_>) -> Result<Self, ConfigError> {
        let (a, b) = site.upright()?;
        let noise = Noise::of(settings, site);
        let wander = settings
            .number(const { SPEC.parameter("wander").optional() })
            .unwrap_or(0.2 * site.command_limit);
        let (driven, pushed) = (b * noise.command, pushed(site.period) * noise.pendulum);
        let mut process = SMatrix::<f64, 5, 5>::zeros();
        process
            .fixed_view_mut::<4, 4>(0, 0)
            .copy_from(&(driven * driven.transpose() + pushed * pushed.transpose()));
        process[(4, 4)] = wander * wander * site.period;
        let mut with = SMatrix::<f64, 5, 5>::identity();
        with.fixed_view_mut::<4, 4>(0, 0).copy_from(&a);
        with.fixed_view_mut::<4, 1>(0, 4).copy_from(&b);
        Ok(Self {
            predictor: Predictor::design(settings, site)?,
            gain: rows(&filter_gain(&with, process, &noise)?),
            limit: T::from_f64(AT_MOST * site.command_limit),
        })
    }
}

impl<T: Real> Estimator<T> for DisturbanceObserver<T> {
    type State = DisturbedBelief<T>;

    fn start(&self) -> DisturbedBelief<T> {
        DisturbedBelief {
            belief: self.predictor.start(),
            disturbance: T::ZERO,
        }
    }

    fn update(&self, s: &mut DisturbedBelief<T>, m: &Measurement<T>) -> Estimate<T> {
        match self.predictor.follow(&mut s.belief, m, s.disturbance) {
            Some([e, f]) => {
                let [x @ .., d] = self.gain.map(|[a, b]| a * e + b * f);
                self.predictor.correct(&mut s.belief, x);
                let d = s.disturbance + d;
                s.disturbance = if is_finite(d) {
                    d.clamp(-self.limit, self.limit)
                } else {
                    T::ZERO
                };
            }
            None => s.disturbance = T::ZERO,
        }
        self.predictor.estimate(&s.belief, s.disturbance)
    }

    fn numbers(&self, put: &mut impl FnMut(&'static str, Number<'_, T>)) -> bool {
        put("ESTIMATOR_GAIN", Number::Real(self.gain.as_flattened()));
        put("ESTIMATOR_LIMIT", Number::Real(&[self.limit]));
        true
    }
}
