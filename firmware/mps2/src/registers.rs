//! The board's registers. The one place with raw addresses.

/// One register of 32 bits.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Register(usize);

impl Register {
    #[allow(unsafe_code)]
    pub(crate) fn read(self) -> u32 {
        // SAFETY: only the constants below are made, each the address of a register of this board; reading it has no
        // effect on memory.
        unsafe { core::ptr::with_exposed_provenance::<u32>(self.0).read_volatile() }
    }

    #[allow(unsafe_code)]
    pub(crate) fn write(self, value: u32) {
        // SAFETY: as above; none of these devices writes to memory.
        unsafe { core::ptr::with_exposed_provenance_mut::<u32>(self.0).write_volatile(value) }
    }
}

/// Clock of processor and timers, Hz.
pub(crate) const CLOCK_HZ: u32 = 25_000_000;

/// Arm's CMSDK timer: counts down from its reload value and begins anew.
pub(crate) struct Timer {
    pub(crate) control: Register,
    pub(crate) value: Register,
    pub(crate) reload: Register,
    pub(crate) interrupt: Register,
}

const fn timer(base: usize) -> Timer {
    Timer {
        control: Register(base),
        value: Register(base + 4),
        reload: Register(base + 8),
        interrupt: Register(base + 12),
    }
}

pub(crate) const TIMER0: Timer = timer(0x4000_0000);
pub(crate) const TIMER1: Timer = timer(0x4000_1000);
pub(crate) const TIMER_ENABLE: u32 = 1 << 0;
pub(crate) const TIMER_INTERRUPT: u32 = 1 << 3;
pub(crate) const TIMER1_IRQ: u16 = 9;

/// Arm's CMSDK UART: one byte of buffer either way.
pub(crate) const UART_DATA: Register = Register(0x4000_4000);
pub(crate) const UART_STATE: Register = Register(0x4000_4004);
pub(crate) const UART_CONTROL: Register = Register(0x4000_4008);
pub(crate) const UART_INTERRUPT: Register = Register(0x4000_400c);
pub(crate) const UART_DIVIDER: Register = Register(0x4000_4010);
pub(crate) const UART_SEND_FULL: u32 = 1 << 0;
pub(crate) const UART_RECEIVE_FULL: u32 = 1 << 1;
pub(crate) const UART_SEND: u32 = 1 << 0;
pub(crate) const UART_RECEIVE: u32 = 1 << 1;
pub(crate) const UART_RECEIVE_INTERRUPT: u32 = 1 << 3;
pub(crate) const UART_RECEIVE_IRQ: u16 = 0;

/// The board's two LEDs.
pub(crate) const LEDS: Register = Register(0x4002_8000);
