//! Design: from a linear model and weights to gains. Fixed sizes, no allocation; the same code runs on the target.
//!
//! | task | function |
//! |---|---|
//! | algebraic Riccati equations | [`riccati::discrete`], [`riccati::continuous`] |
//! | Lyapunov equations | [`lyapunov::discrete`], [`lyapunov::continuous`] |
//! | linear-quadratic regulators | [`dlqr`], [`lqr`] |
//! | the same with the integral of an output | [`lqi`], [`sampled_lqi`], [`dlqi`], [`with_sum`], [`with_integral`] |
//! | pole placement for one input | [`place()`] |
//! | steady-state Kalman gains | [`dlqe`], [`lqe`] |
//! | a rig's standard balance gain | [`balance`] |
//! | what the input reaches, what the output shows | [`controllability()`], [`observability`], [`controllability_matrix`] |
//! | what a regulated system does, and what moves on top of the regulator change | [`Prediction`] |
//! | steady motion on which the pendulum follows a sine | [`SteadyMotion`] |
//! | poles, stability | [`poles`], [`spectral_radius`], [`is_schur`], [`is_hurwitz`] |

mod balance;
pub mod controllability;
mod elimination;
mod error;
mod integral;
mod kalman;
mod lqr;
pub mod lyapunov;
mod place;
mod prediction;
pub mod regulator_equation;
pub mod riccati;
mod scaling;
mod stability;

pub use balance::{balance, balance_weights, balance_weights_with_integral};
pub use controllability::{
    Controllability, controllability, controllability_matrix, observability,
};
pub use error::{DesignError, Entry};
pub use integral::{dlqi, integral_over_sample, lqi, sampled_lqi, with_integral, with_sum};
pub use kalman::{Estimator, Noise, dlqe, lqe};
pub use lqr::{Regulator, Weights, dlqr, lqr};
pub use place::place;
pub use prediction::{Predicted, Prediction};
pub use regulator_equation::{RegulatorError, SteadyMotion};
pub use stability::{is_hurwitz, is_schur, poles, spectral_radius};

use nalgebra::RealField;

/// Float types the designs are written for: `f32` and `f64`.
pub trait Float: RealField + Copy {}
impl<T: RealField + Copy> Float for T {}

/// The value as `f64`, for messages and comparisons.
fn as_f64<T: Float>(x: T) -> f64 {
    nalgebra::try_convert::<T, f64>(x).unwrap_or(f64::NAN)
}
