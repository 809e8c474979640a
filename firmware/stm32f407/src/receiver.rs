//! Bytes from the host: an interrupt collects them, for the USART itself holds but one.

use core::sync::atomic::{AtomicU8, AtomicUsize, Ordering};

use stm32f4xx_hal::pac::{self, interrupt};

/// At 921,600 baud, 2.7 ms.
const CAPACITY: usize = 256;

static BYTES: [AtomicU8; CAPACITY] = [const { AtomicU8::new(0) }; CAPACITY];
/// Bytes received so far; only the interrupt writes it.
static RECEIVED: AtomicUsize = AtomicUsize::new(0);
/// Bytes taken so far; only the loop writes it.
static TAKEN: AtomicUsize = AtomicUsize::new(0);

/// The next byte from the host.
pub(crate) fn take() -> Option<u8> {
    let taken = TAKEN.load(Ordering::Relaxed);
    if taken == RECEIVED.load(Ordering::Acquire) {
        return None;
    }
    let byte = BYTES.get(taken % CAPACITY)?.load(Ordering::Relaxed);
    TAKEN.store(taken.wrapping_add(1), Ordering::Release);
    Some(byte)
}

#[allow(unsafe_code)]
#[interrupt]
fn USART2() {
    // SAFETY: nothing else reads the data register; the loop's half of the USART only writes to it, which on this chip
    // is another register at the same address.
    let usart = unsafe { pac::USART2::steal() };
    let status = usart.sr().read();
    // Reading status, then data, also clears the overrun of bytes that came while the interrupt was masked.
    if status.rxne().bit_is_set() || status.ore().bit_is_set() {
        let byte = usart.dr().read().bits() as u8;
        let received = RECEIVED.load(Ordering::Relaxed);
        let room = received.wrapping_sub(TAKEN.load(Ordering::Acquire)) < CAPACITY;
        if let Some(slot) = BYTES.get(received % CAPACITY).filter(|_| room) {
            slot.store(byte, Ordering::Relaxed);
            RECEIVED.store(received.wrapping_add(1), Ordering::Release);
        }
    }
}
