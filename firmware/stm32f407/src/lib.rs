//! A rig on an STM32F407 (for example the board STM32F4DISCOVERY): two quadrature timers, a PWM timer, a USART. Wiring:
//! docs/firmware.md.
#![cfg(target_os = "none")]
#![no_std]

mod board;
mod receiver;

pub use board::{Button, Stm32f407, start};

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    board::motor_off();
    // The independent watchdog, which is not fed any more, resets the chip; after a reset the motor is off until a host
    // commands.
    loop {
        cortex_m::asm::nop();
    }
}

// A stack overflow or a stray address. The runtime wants an `unsafe fn`; its body is safe.
#[allow(unsafe_code)]
#[cortex_m_rt::exception]
unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
    board::motor_off();
    loop {
        cortex_m::asm::nop();
    }
}
