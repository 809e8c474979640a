//! Estimators whose correction is a constant gain on the innovation.

use super::predictor::{Belief, Predictor};
use super::{Estimate, Measurement};
use crate::real::Real;
use nalgebra::SMatrix;

/// `xhat[k] = f(xhat[k-1], u) + L (y[k] - h(f(xhat[k-1], u)))`: the nonlinear model `f` predicts, the gain `L` (4 x 2)
/// corrects.
#[derive(Clone, Debug)]
pub(super) struct FixedGain<T: Real> {
    pub(super) predictor: Predictor<T>,
    /// Rows as the state, columns as the encoders.
    pub(super) gain: [[T; 2]; 4],
}

impl<T: Real> FixedGain<T> {
    pub(super) fn update(&self, belief: &mut Belief<T>, m: &Measurement<T>) -> Estimate<T> {
        if let Some([e, f]) = self.predictor.follow(belief, m, T::ZERO) {
            self.predictor
                .correct(belief, self.gain.map(|[a, b]| a * e + b * f));
        }
        self.predictor.estimate(belief, T::ZERO)
    }
}

/// What an estimator with the rig's model and a constant correction is near upright, for the poles of a whole loop.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct LinearEstimator {
    /// `L` (4 x 2): what the differences of the angles read from those expected add to the belief at the sample.
    pub correction: [[f64; 2]; 4],
    /// How many periods, beyond the one after which a command acts at the earliest, the law's state lies ahead of the
    /// sample.
    pub ahead: f64,
}

impl<T: Real> FixedGain<T> {
    pub(super) fn linear(&self) -> LinearEstimator {
        LinearEstimator {
            correction: self.gain.map(|row| row.map(|l| l.value())),
            ahead: self.predictor.ahead(),
        }
    }
}

/// Makes an estimator of a type that holds nothing but a [`FixedGain`].
macro_rules! estimates_with_fixed_gain {
    ($name:ident) => {
        impl<T: crate::real::Real> super::Estimator<T> for $name<T> {
            type State = super::Belief<T>;

            fn start(&self) -> Self::State {
                self.0.predictor.start()
            }

            fn update(
                &self,
                belief: &mut Self::State,
                m: &super::Measurement<T>,
            ) -> super::Estimate<T> {
                self.0.update(belief, m)
            }

            fn linear(&self) -> Option<super::LinearEstimator> {
                Some(self.0.linear())
            }

            fn numbers(
                &self,
                put: &mut impl FnMut(&'static str, crate::numbers::Number<'_, T>),
            ) -> bool {
                let gain = self.0.gain.as_flattened();
                put("ESTIMATOR_GAIN", crate::numbers::Number::Real(gain));
                true
            }
        }
    };
}
pub(super) use estimates_with_fixed_gain;

/// A matrix as the rows of a [`FixedGain`].
pub(super) fn rows<T: Real, const N: usize>(gain: &SMatrix<f64, N, 2>) -> [[T; 2]; N] {
    core::array::from_fn(|i| core::array::from_fn(|j| T::from_f64(gain[(i, j)])))
}
