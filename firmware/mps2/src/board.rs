//! The board for the loop.

use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::NVIC;
use furuta_wire::{ArmCounts, PendulumCounts};
use rig::{Board, Clock, EmulatedMechanics};

use crate::registers as r;

/// The first LED is what would be the motor driver's enable line.
const MOTOR_LED: u32 = 1;

/// The board, its timers and UART running.
#[derive(Debug)]
pub struct Mps2 {
    mechanics: EmulatedMechanics,
    volts: f32,
    /// Whether a period has been begun: the first tick reads the encoders before any time has passed.
    ticking: bool,
    last: u32,
    ticks: u64,
}

#[derive(Copy, Clone)]
struct Irq(u16);

// The numbers are those of the board's manual (Application Note AN386); the trait is unsafe because a wrong one would
// unmask something else.
#[allow(unsafe_code)]
// SAFETY: constants of the board.
unsafe impl InterruptNumber for Irq {
    fn number(self) -> u16 {
        self.0
    }
}

impl Mps2 {
    /// Switches timers and UART on.
    ///
    /// Interrupts are unmasked in the controller and masked in the processor: one that is pending ends the wait of
    /// `idle`, none is ever taken.
    #[allow(unsafe_code)]
    pub fn new(mechanics: EmulatedMechanics) -> Self {
        cortex_m::interrupt::disable();
        r::TIMER0.reload.write(u32::MAX);
        r::TIMER0.value.write(u32::MAX);
        r::TIMER0.control.write(r::TIMER_ENABLE);
        // Wakes the loop often enough for a tick to be at most a quarter of a millisecond late.
        let wake = r::CLOCK_HZ / 4000;
        r::TIMER1.reload.write(wake);
        r::TIMER1.value.write(wake);
        r::TIMER1
            .control
            .write(r::TIMER_ENABLE | r::TIMER_INTERRUPT);
        r::UART_DIVIDER.write(r::CLOCK_HZ / 921_600);
        r::UART_CONTROL.write(r::UART_SEND | r::UART_RECEIVE | r::UART_RECEIVE_INTERRUPT);
        // SAFETY: interrupts are disabled in the processor, so no handler can break a critical section.
        unsafe {
            NVIC::unmask(Irq(r::TIMER1_IRQ));
            NVIC::unmask(Irq(r::UART_RECEIVE_IRQ));
        }
        Self {
            mechanics,
            volts: 0.0,
            ticking: false,
            last: r::TIMER0.value.read(),
            ticks: 0,
        }
    }

    /// The mechanics.
    #[must_use]
    pub fn mechanics(&self) -> &EmulatedMechanics {
        &self.mechanics
    }
}

impl Board for Mps2 {
    const CLOCK: Clock = Clock::Emulated;

    fn now_us(&mut self) -> u64 {
        let now = r::TIMER0.value.read();
        // It counts down. Read at least every 171 s, it never wraps twice.
        self.ticks += u64::from(self.last.wrapping_sub(now));
        self.last = now;
        self.ticks / u64::from(r::CLOCK_HZ / 1_000_000)
    }

    fn counts(&mut self) -> (ArmCounts, PendulumCounts) {
        if self.ticking {
            self.mechanics.advance(self.volts);
        }
        self.ticking = true;
        self.mechanics.counts()
    }

    fn drive(&mut self, volts: f32) {
        self.volts = volts;
        let on = if volts == 0.0 { 0 } else { MOTOR_LED };
        r::LEDS.write(r::LEDS.read() & !MOTOR_LED | on);
    }

    fn read(&mut self) -> Option<u8> {
        let full = r::UART_STATE.read() & r::UART_RECEIVE_FULL != 0;
        full.then(|| r::UART_DATA.read() as u8)
    }

    fn write(&mut self, byte: u8) -> bool {
        let free = r::UART_STATE.read() & r::UART_SEND_FULL == 0;
        if free {
            r::UART_DATA.write(u32::from(byte));
        }
        free
    }

    fn idle(&mut self) {
        cortex_m::asm::wfi();
        // Both are looked at by the loop anyway.
        r::TIMER1.interrupt.write(1);
        r::UART_INTERRUPT.write(r::UART_RECEIVE);
        NVIC::unpend(Irq(r::TIMER1_IRQ));
        NVIC::unpend(Irq(r::UART_RECEIVE_IRQ));
    }
}

/// Takes the voltage from the motor, from wherever the program is.
pub fn motor_off() {
    r::LEDS.write(r::LEDS.read() & !MOTOR_LED);
}

/// Whether the motor driver is enabled.
pub fn motor_is_on() -> bool {
    r::LEDS.read() & MOTOR_LED != 0
}
