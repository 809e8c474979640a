//! The whole control system: estimator, swing-up, catch, balance, limits.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
use {furuta_ctrl::supervisor::Supervisor, no_panic::any};

no_panic::step!(any::<Supervisor<f32>>().update(any(), any(), *any()));
