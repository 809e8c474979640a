//! What a rig's microcontroller does, whatever the board: one loop ([`Server`]) over a [`Board`], led by a host over
//! the wire ([`HostLed`]) or by the control system on the chip ([`OnChip`]).
//!
//! The loop polls: nothing happens in interrupts but the collecting of bytes, so nothing is shared and nothing can be
//! torn. Allocates nothing.
#![no_std]

mod board;
mod describe;
mod emulated;
mod outbox;
mod pilot;
mod server;
pub mod the_rig;

pub use board::{Board, Clock};
pub use describe::hello;
pub use emulated::EmulatedMechanics;
pub use pilot::{HostLed, OnChip, Pilot};
pub use server::Server;
