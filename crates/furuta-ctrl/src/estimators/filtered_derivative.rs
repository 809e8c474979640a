//! Angles as measured, speeds by a filtered derivative of each.

use super::{Derivative, DerivativeState, Design, Estimate, Estimator, Measurement};
use crate::error::ConfigError;
use crate::numbers::Number;
use crate::real::Real;
use crate::section::{ParameterSpec, Settings, Spec};
use crate::site::Site;
use furuta_model::State;

/// The corner where none is given, over the pendulum's frequency: fast enough for balance, slow enough for a 2000-count
/// encoder.
const CORNER: f64 = 30.0;

/// What a controller file may say of it.
pub(super) static SPEC: Spec = Spec {
    id: "derivative",
    sentence: "Angles as measured, speeds by a filtered derivative: needs no model, lags behind, bridges \
        no lost samples",
    parameters: &[ParameterSpec::number(
        "corner",
        "rad/s",
        1.0,
        1e5,
        "corner frequency of the filter; 30 times the pendulum's if left out",
    )],
};

/// A [`Derivative`] for each axis.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct FilteredDerivative<T> {
    /// The same for both.
    pub speed: Derivative<T>,
}

impl<T: Real> Design for FilteredDerivative<T> {
    fn design(settings: &Settings, site: &Site<'_>) -> Result<Self, ConfigError> {
        let corner = settings
            .number(const { SPEC.parameter("corner").optional() })
            .unwrap_or(CORNER * site.frequency());
        Ok(Self {
            speed: Derivative::new(T::from_f64(corner), T::from_f64(site.period)),
        })
    }
}

impl<T: Real> Estimator<T> for FilteredDerivative<T> {
    type State = [DerivativeState<T>; 2];

    fn start(&self) -> Self::State {
        [self.speed.start(); 2]
    }

    fn update(&self, state: &mut Self::State, m: &Measurement<T>) -> Estimate<T> {
        let [arm, pendulum] = state;
        let now = State::new(
            m.theta,
            m.alpha,
            self.speed.update(arm, m.theta),
            self.speed.update(pendulum, m.alpha),
        );
        Estimate {
            now,
            ahead: now,
            disturbance: T::ZERO,
        }
    }

    fn numbers(&self, put: &mut impl FnMut(&'static str, Number<'_, T>)) -> bool {
        let [blend, rate] = self.speed.numbers();
        put("ESTIMATOR_BLEND", Number::Real(&[blend]));
        put("ESTIMATOR_RATE", Number::Real(&[rate]));
        true
    }
}
