//! The board for the loop.

use cortex_m::peripheral::DWT;
use furuta_wire::{ArmCounts, PendulumCounts};
use rig::{Board, Clock};
use stm32f4xx_hal::gpio::{Input, Output, PA0, PE13};
use stm32f4xx_hal::pac::{self, TIM1, TIM3, TIM4, USART2};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::qei::Qei;
use stm32f4xx_hal::rcc::Config as Clocks;
use stm32f4xx_hal::serial::{self, Serial, Tx};
use stm32f4xx_hal::timer::PwmChannel;
use stm32f4xx_hal::watchdog::IndependentWatchdog;

use crate::receiver;

/// Clock of the processor, MHz.
const CLOCK_MHZ: u32 = 168;
/// Voltage at the motor driver's supply, V: what full PWM gives the motor.
const SUPPLY: f32 = 12.0;
/// Bits per second of the line to the host.
const BAUD: u32 = 921_600;
/// A loop that hangs is reset after so long, ms.
const HANG_MS: u32 = 20;

/// The user button.
pub type Button = PA0<Input>;

/// The board, everything running, the motor off.
pub struct Stm32f407 {
    encoders: (Qei<TIM3>, Qei<TIM4>),
    /// What they have counted since power-on.
    totals: (Wide, Wide),
    forward: PwmChannel<TIM1, 0>,
    backward: PwmChannel<TIM1, 1>,
    enable: PE13<Output>,
    line: Tx<USART2>,
    watchdog: IndependentWatchdog,
    last: u32,
    cycles: u64,
}

/// Sets clocks, pins and peripherals up. `None` if it was called before, or the peripherals do not take their settings.
pub fn start() -> Option<(Stm32f407, Button)> {
    let device = pac::Peripherals::take()?;
    let mut core = cortex_m::Peripherals::take()?;
    // The discovery board's crystal has 8 MHz.
    let clocks = Clocks::hse(8.MHz()).sysclk(CLOCK_MHZ.MHz());
    let mut rcc = device.RCC.freeze(clocks);
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();

    let a = device.GPIOA.split(&mut rcc);
    let b = device.GPIOB.split(&mut rcc);
    let e = device.GPIOE.split(&mut rcc);
    let mut enable = e.pe13.into_push_pull_output();
    enable.set_low();

    let (_, (forward, backward, ..)) = device.TIM1.pwm_hz(20.kHz(), &mut rcc);
    let (mut forward, mut backward) = (forward.with(e.pe9), backward.with(e.pe11));
    forward.set_duty(0);
    backward.set_duty(0);
    forward.enable();
    backward.enable();

    let line = serial::config::Config::default().baudrate(BAUD.bps());
    let (line, mut receiver) = Serial::new(device.USART2, (a.pa2, a.pa3), line, &mut rcc)
        .ok()?
        .split();
    receiver.listen();
    // SAFETY: the handler touches nothing that is protected by a critical section.
    #[allow(unsafe_code)]
    unsafe {
        cortex_m::peripheral::NVIC::unmask(pac::Interrupt::USART2);
    }

    let board = Stm32f407 {
        // Both begin at 0. PB4 is the reset line of JTAG at first: the debugger uses SWD.
        encoders: (
            Qei::new(device.TIM3, (b.pb4.into_floating_input(), b.pb5), &mut rcc),
            Qei::new(device.TIM4, (b.pb6, b.pb7), &mut rcc),
        ),
        totals: (Wide::ZERO, Wide::ZERO),
        forward,
        backward,
        enable,
        line,
        watchdog: IndependentWatchdog::new(device.IWDG),
        last: DWT::cycle_count(),
        cycles: 0,
    };
    Some((board, a.pa0.into_pull_down_input()))
}

impl Stm32f407 {
    /// From now on, a loop that does not tick for 20 ms is reset. Not before everything that takes long is done.
    pub fn start_watchdog(&mut self) {
        self.watchdog.start(HANG_MS.millis());
    }
}

impl Board for Stm32f407 {
    const CLOCK: Clock = Clock::Real;

    fn now_us(&mut self) -> u64 {
        let now = DWT::cycle_count();
        // Read at least every 25 s, it never wraps twice.
        self.cycles += u64::from(now.wrapping_sub(self.last));
        self.last = now;
        self.cycles / u64::from(CLOCK_MHZ)
    }

    fn counts(&mut self) -> (ArmCounts, PendulumCounts) {
        (
            ArmCounts(self.totals.0.follow(self.encoders.0.count())),
            PendulumCounts(self.totals.1.follow(self.encoders.1.count())),
        )
    }

    fn drive(&mut self, volts: f32) {
        let full = self.forward.get_max_duty();
        // A cast saturates, and makes 0 of what is not a number.
        let duty = |volts: f32| ((volts / SUPPLY * f32::from(full)) as u16).min(full);
        // Between its pulses the motor is shorted by two inputs that are high, so that its mean voltage is the command.
        // Two inputs that are low would open it at a DRV8871 or DRV8874: their data sheets call that "coast".
        self.forward.set_duty(full - duty(-volts));
        self.backward.set_duty(full - duty(volts));
        // A program that has not come here leaves the driver off.
        self.enable.set_high();
    }

    fn read(&mut self) -> Option<u8> {
        receiver::take()
    }

    fn write(&mut self, byte: u8) -> bool {
        self.line.write(byte).is_ok()
    }

    fn alive(&mut self) {
        self.watchdog.feed();
    }
}

/// A timer's 16 bits, made wider: between two ticks no encoder turns by half of them.
struct Wide {
    last: u16,
    total: i32,
}

impl Wide {
    const ZERO: Self = Self { last: 0, total: 0 };

    fn follow(&mut self, now: u16) -> i32 {
        let moved = now.wrapping_sub(self.last).cast_signed();
        self.last = now;
        self.total = self.total.wrapping_add(i32::from(moved));
        self.total
    }
}

/// Takes the driver's enable line down and stops the PWM, from wherever the program is.
#[allow(unsafe_code)]
pub(crate) fn motor_off() {
    // SAFETY: two writes that leave the driver off, in whatever state the program left the peripherals; nothing of it
    // runs afterwards.
    unsafe {
        pac::GPIOE::steal().bsrr().write(|w| w.br13().set_bit());
        pac::TIM1::steal().bdtr().modify(|_, w| w.moe().clear_bit());
    }
}
