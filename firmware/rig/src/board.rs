//! What a board brings.

use furuta_wire::{ArmCounts, PendulumCounts};

/// How a board's clock drives the ticks.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Clock {
    /// Real mechanics: a tick that is due happens at once, and the samples carry the clock's time.
    Real,
    /// Emulated mechanics: time stands still where the emulation is late, and where a host that answered the last
    /// sample but one is late with the last, for at most 200 ms; the samples carry the emulated time. So a busy
    /// computer makes a run longer and not another one. A silent host meets the watchdog as ever.
    Emulated,
}

/// A board: its clock, encoders, motor and line to the host. Polled; nothing may wait but [`Board::idle`].
pub trait Board {
    /// How the clock drives the ticks.
    const CLOCK: Clock;

    /// Time since power-on, us.
    fn now_us(&mut self) -> u64;

    /// Both encoders' counts, wider than any hardware counter.
    fn counts(&mut self) -> (ArmCounts, PendulumCounts);

    /// What the motor gets from now on, V. 0 must also be what it gets if the program never runs.
    fn drive(&mut self, volts: f32);

    /// The next byte from the host.
    fn read(&mut self) -> Option<u8>;

    /// Hands a byte over to be sent; false where the line is still busy with the one before.
    fn write(&mut self, byte: u8) -> bool;

    /// Waits until something may have happened: at most a tenth of a period. Returning at once is correct, too.
    fn idle(&mut self) {}

    /// Feeds the hardware's watchdog: called once in each tick, so that a hang ends in a reset.
    fn alive(&mut self) {}
}
