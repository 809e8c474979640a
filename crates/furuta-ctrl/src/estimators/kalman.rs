//! The steady-state Kalman filter.

use super::Design;
use super::fixed_gain::{FixedGain, estimates_with_fixed_gain, rows};
use super::noise::{COMMAND, Noise, PENDULUM, READING};
use super::predictor::{PREDICT, Predictor};
use crate::error::ConfigError;
use crate::design::{self, DesignError, dlqe};
use crate::real::Real;
use crate::section::{Settings, Spec};
use crate::site::Site;
use nalgebra::{SMatrix, SVector};

/// What a controller file may say of it.
pub(super) static SPEC: Spec = Spec {
    id: "kalman",
    sentence: "Steady-state Kalman filter: the gain that errs least upright if model and encoders are as \
        far off as given; the nonlinear model predicts",
    parameters: &[COMMAND, PENDULUM, READING, PREDICT],
};

/// Steady-state Kalman filter with the nonlinear model as predictor.
///
/// The gain is that of [`dlqe`] (filter form) for the upright linearisation with two noises that are new in every
/// sample: a voltage beside the command, an acceleration of the pendulum; and white noise on the angles.
#[derive(Clone, Debug)]
pub struct Kalman<T: Real>(FixedGain<T>);

/// What a constant acceleration of the pendulum does in a period.
pub(super) fn pushed(period: f64) -> SVector<f64, 4> {
    SVector::from([0.0, 0.5 * period * period, 0.0, period])
}

/// The filter's gain for a system of which the first two states are measured.
pub(super) fn filter_gain<const N: usize>(
    a: &SMatrix<f64, N, N>,
    process: SMatrix<f64, N, N>,
    noise: &Noise,
) -> Result<SMatrix<f64, N, 2>, DesignError> {
    let mut c = SMatrix::<f64, 2, N>::zeros();
    c.fill_diagonal(1.0);
    let variance = SVector::from(noise.reading.map(|r| r * r));
    let noise = design::Noise::new(process, SMatrix::from_diagonal(&variance));
    dlqe(a, &c, &noise)?
        .filter_gain(&c, &noise)
        .ok_or(DesignError::NotDetectable)
}

impl<T: Real> Design for Kalman<T> {
    fn design(settings: &Settings, site: &Site<'_>) -> Result<Self, ConfigError> {
        let (a, b) = site.upright()?;
        let noise = Noise::of(settings, site);
        let (driven, pushed) = (b * noise.command, pushed(site.period) * noise.pendulum);
        let process = driven * driven.transpose() + pushed * pushed.transpose();
        Ok(Self(FixedGain {
            predictor: Predictor::design(settings, site)?,
            gain: rows(&filter_gain(&a, process, &noise)?),
        }))
    }
}

estimates_with_fixed_gain!(Kalman);
