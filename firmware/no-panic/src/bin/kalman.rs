//! Steady-state Kalman filter.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
use {
    furuta_ctrl::estimators::{Estimator, Kalman},
    no_panic::any,
};

no_panic::step!(any::<Kalman<f32>>().update(any(), any()));
