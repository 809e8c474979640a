//! The observer of given poles.

use super::Design;
use super::fixed_gain::{FixedGain, estimates_with_fixed_gain, rows};
use super::predictor::{PREDICT, Predictor};
use crate::error::ConfigError;
use crate::real::Real;
use crate::section::{ParameterSpec, Settings, Spec};
use crate::site::Site;
use nalgebra::{Matrix2, SMatrix};

/// What a controller file may say of it.
pub(super) static SPEC: Spec = Spec {
    id: "luenberger",
    sentence: "Luenberger observer: its error upright dies out with the rates given, exactly; away from \
        upright the nonlinear model predicts",
    parameters: &[
        ParameterSpec::numbers(
            "rates",
            4,
            "rad/s",
            1.0,
            1e4,
            "two real poles of the arm's error and two of the pendulum's, as rates: 120 rad/s each if left out",
        ),
        PREDICT,
    ],
};

/// Rate of each pole where none is given, rad/s: as of the standard observer.
const RATE: f64 = 120.0;

/// Luenberger observer of the current state (D. Luenberger, *An introduction to observers*, IEEE Trans. Automatic
/// Control 16, 1971).
///
/// Upright, the error of its prediction obeys `e[k+1] = (A - A L C) e[k]`, whose eigenvalues are `exp(-rate h)`.
#[derive(Clone, Debug)]
pub struct Luenberger<T: Real>(FixedGain<T>);

/// The gain `L` (4 x 2) of the observer of the current state for `x[k+1] = A x[k] + B u[k]` with the first two states
/// measured, such that `A - A L C` has the eigenvalues `[p, q]` for one axis and `[r, s]` for the other; `None` where
/// the speeds do not show in the angles.
///
/// With `A` in 2 x 2 blocks and `f = A12 v`, the error's angles `e` and speeds `v` obey `e+ = X e + f`,
/// `f+ = Y e + W f` where `W = A12 A22 A12^-1`, hence `e++ = (X + W) e+ + (Y - W X) e`. Choosing
/// `X + W = diag(p + q, r + s)` and `W X - Y = diag(p q, r s)` leaves two equations that know nothing of each other.
fn gain(a: &SMatrix<f64, 4, 4>, poles: [[f64; 2]; 2]) -> Option<SMatrix<f64, 4, 2>> {
    let block = |i, j| a.fixed_view::<2, 2>(i, j).into_owned();
    let shows = block(0, 2);
    let hides = shows.try_inverse()?;
    let w = shows * block(2, 2) * hides;
    let [sum, product] = [
        poles.map(|[p, q]| p + q),
        poles.map(|[p, q]| p * q),
    ]
    .map(|d| Matrix2::from_diagonal(&d.into()));
    let x = sum - w;
    let y = w * x - product;
    let mut predicting = SMatrix::<f64, 4, 2>::zeros();
    predicting
        .fixed_view_mut::<2, 2>(0, 0)
        .copy_from(&(block(0, 0) - x));
    predicting
        .fixed_view_mut::<2, 2>(2, 0)
        .copy_from(&(block(2, 0) - hides * y));
    let gain = a.try_inverse()? * predicting;
    gain.iter().all(|g| g.is_finite()).then_some(gain)
}

impl<T: Real> Design for Luenberger<T> {
    fn design(settings: &Settings, site: &Site<'_>) -> Result<Self, ConfigError> {
        let (a, _) = site.upright()?;
        let rates = settings.vector(const { SPEC.parameter("rates").several::<4>() }).unwrap_or([RATE; 4]);
        let [p, q, r, s] = rates.map(|rate| libm::exp(-rate * site.period));
        let gain = gain(&a, [[p, q], [r, s]]).ok_or(ConfigError::Unsuitable {
            section: SPEC.id,
            problem: "over one sample period the speeds do not show in the angles",
        })?;
        Ok(Self(FixedGain {
            predictor: Predictor::design(settings, site)?,
            gain: rows(&gain),
        }))
    }
}

estimates_with_fixed_gain!(Luenberger);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::poles;
    use furuta_model::Rig;

    #[test]
    fn the_error_has_the_poles_that_were_asked_for() {
        for name in Rig::VOLTAGE {
            let rig = Rig::builtin(name).expect("built in");
            let (a, _) = Site::of(&rig, 0.002).upright().expect("a rig");
            let wanted = [[0.9, 0.8], [0.7, 0.5]];
            let gain = gain(&a, wanted).expect("observable");
            let mut c = SMatrix::<f64, 2, 4>::zeros();
            c.fill_diagonal(1.0);
            let mut found = poles(&(a - a * gain * c)).expect("finite").map(|p| p.re);
            found.sort_by(f64::total_cmp);
            for (found, wanted) in found.into_iter().zip([0.5, 0.7, 0.8, 0.9]) {
                // Eigenvalues of a matrix whose entries differ by 1/h.
                assert!((found - wanted).abs() < 1e-9, "{name}: {found}");
            }
        }
    }
}
