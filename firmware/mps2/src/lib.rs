//! The board mps2-an386 as QEMU emulates it: CMSDK UART and timers, two LEDs; a model of a rig in the place of motor,
//! arm and pendulum.
#![cfg(target_os = "none")]
#![no_std]

mod board;
pub mod measure;
mod registers;

pub use board::{Mps2, motor_is_on, motor_off};
pub use rig::the_rig;
pub use semihosting;

/// Prints a line on the debugger's console (QEMU's standard output).
#[macro_export]
macro_rules! say {
    ($($arg:tt)*) => {
        $crate::semihosting::println!($($arg)*)
    };
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo<'_>) -> ! {
    motor_off();
    say!("{info}");
    say!("motor {}", if motor_is_on() { "ON" } else { "off" });
    semihosting::process::exit(101)
}

// A stack overflow or a stray address ends the program instead of looping for ever. The runtime wants an `unsafe fn`;
// its body is safe.
#[allow(unsafe_code)]
#[cortex_m_rt::exception]
unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
    motor_off();
    semihosting::process::exit(102)
}
