//! The check's own check: with the feature `negative-control` this step can panic, and must not link.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
use no_panic::any;

no_panic::step!({
    let (numbers, index): (&[f32; 4], usize) = (any(), *any());
    if cfg!(feature = "negative-control") {
        numbers[index]
    } else {
        numbers.get(index).copied().unwrap_or_default()
    }
});
