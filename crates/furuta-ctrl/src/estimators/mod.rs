//! Estimators: what the sensors do not measure.

mod derivative;

pub use derivative::{Derivative, DerivativeState};
