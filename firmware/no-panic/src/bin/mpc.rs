//! Model predictive control (active set).
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
use {
    furuta_ctrl::controllers::{Controller, Mpc},
    no_panic::any,
};

no_panic::step!(any::<Mpc<f32>>().update(any(), any(), any(), *any()));
