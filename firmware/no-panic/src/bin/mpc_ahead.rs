//! Model predictive control with a reference that is known ahead.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
use {
    furuta_ctrl::controllers::{Controller, Mpc},
    furuta_ctrl::reference::ArmSteps,
    no_panic::any,
};

no_panic::step!(any::<Mpc<f32>>().update_ahead(
    any(),
    any(),
    any::<ArmSteps<'static, f32>>(),
    *any()
));
