//! Programs that link only if the control step they hold cannot panic.
//!
//! The panic handler calls a function that does not exist. Where the optimiser proves that no panic can be reached,
//! handler and call are dropped and the program links; otherwise the linker names the function. No program here is ever
//! run.
#![no_std]

// The linker is to name it.
#[cfg(target_os = "none")]
#[allow(unsafe_code)]
unsafe extern "C" {
    safe fn the_control_step_can_panic() -> !;
}

#[cfg(target_os = "none")]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    the_control_step_can_panic()
}

/// A value of which the optimiser knows nothing: whatever holds for it holds for every value of the type.
#[cfg(target_os = "none")]
#[allow(unsafe_code)]
pub fn any<T>() -> &'static mut T {
    let place: *mut T = core::hint::black_box(core::ptr::with_exposed_provenance_mut(0x2000_0000));
    // SAFETY: none is needed, as the program is linked and never run.
    unsafe { &mut *place }
}

/// A program of one step.
#[macro_export]
macro_rules! step {
    ($step:expr) => {
        #[cfg(target_os = "none")]
        #[cortex_m_rt::entry]
        fn main() -> ! {
            loop {
                core::hint::black_box($step);
            }
        }

        #[cfg(not(target_os = "none"))]
        fn main() {
            eprintln!("this program is only ever linked, for the target: make firmware");
        }
    };
}
