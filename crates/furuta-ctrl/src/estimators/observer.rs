//! Angles and speeds from counts: the rig's model, corrected by what is measured.

use super::Design;
use super::fixed_gain::{FixedGain, estimates_with_fixed_gain};
use super::predictor::{PREDICT, Predictor};
use crate::error::ConfigError;
use crate::real::Real;
use crate::section::{ParameterSpec, Settings, Spec};
use crate::site::Site;
use furuta_model::Plant;

/// What a controller file may say of it.
pub(super) static SPEC: Spec = Spec {
    id: "observer",
    sentence: "The rig's model with its effects, corrected by what is measured; knows the state ahead, \
        bridges lost samples",
    parameters: &[
        ParameterSpec::number(
            "bandwidth",
            "rad/s",
            1.0,
            1e5,
            "how quickly measurements correct the model: fast against the mechanics, slow against the counts",
        )
        .or(120.0),
        PREDICT,
    ],
};

/// Observer with the model as its predictor and fixed gains, such that the correction of each axis, taken alone, has a
/// double pole: angle by `1 - z^2`, speed by `(1 - z)^2 / h`, `z = exp(-bandwidth * h)`.
///
/// A differentiating filter alone would lag behind by the accelerations, which the model knows; and the model bridges
/// lost samples and the time until a command acts.
#[derive(Clone, Debug)]
pub struct Observer<T: Real>(FixedGain<T>);

impl<T: Real> Observer<T> {
    /// With this model at the sample period `period` (s) and `bandwidth` (rad/s).
    pub fn new(plant: Plant<T>, period: T, bandwidth: T) -> Self {
        Self::with(Predictor::new(plant, period, true), bandwidth)
    }

    fn with(predictor: Predictor<T>, bandwidth: T) -> Self {
        let z = (-bandwidth * predictor.period).exp();
        let slow = T::ONE - z;
        let (angle, speed) = (T::ONE - z * z, slow * slow / predictor.period);
        Self(FixedGain {
            predictor,
            gain: [
                [angle, T::ZERO],
                [T::ZERO, angle],
                [speed, T::ZERO],
                [T::ZERO, speed],
            ],
        })
    }
}

impl<T: Real> Design for Observer<T> {
    fn design(settings: &Settings, site: &Site<'_>) -> Result<Self, ConfigError> {
        let bandwidth = settings.value(const { SPEC.parameter("bandwidth").settled() });
        Ok(Self::with(
            Predictor::design(settings, site)?,
            T::from_f64(bandwidth),
        ))
    }
}

estimates_with_fixed_gain!(Observer);
