//! The wire between a rotary pendulum rig and its host: what is said ([`Message`]) and how it is framed
//! ([`encode`], [`Decoder`]), and what the rig must do about it ([`RigEnd`]).
//!
//! The rig's clock leads. At every tick `k` of its period the rig
//!
//! 1. latches the newest valid [`Command`] into the motor and reads both encoders,
//! 2. sends [`Sample`] `k` with the counts and the voltage that it now holds until tick `k + 1`.
//!
//! The host answers each sample with a command, which therefore acts one period after the sample it answers: a delay
//! that is always the same, whatever the serial line's latency, as long as the answer arrives within the period. An
//! answer that does not is visible in the next sample ([`Status::HELD`]), and after a few silent periods the rig
//! switches its motor off ([`Status::WATCHDOG`]). A [`Query`] asks the rig who it is; it answers with [`Hello`].
//!
//! A frame is the postcard encoding of one message, followed by its CRC-32 (ISO-HDLC, the one of zlib; least
//! significant byte first), the whole COBS-encoded and ended by a zero byte. A receiver that joins late, or reads
//! garbage, is in step again after the next zero.
//!
//! The crate does no I/O, allocates nothing and runs on a microcontroller.
//!
//! ```
//! use furuta_wire::{Command, Decoder, MAX_FRAME, Message, encode};
//!
//! let message = Message::Command(Command { seq: 7, volts: -1.5 });
//! let mut buffer = [0; MAX_FRAME];
//! let frame = encode(&message, &mut buffer)?;
//!
//! let mut decoder = Decoder::new();
//! let mut received = frame.iter().filter_map(|&byte| decoder.push(byte));
//! assert_eq!(received.next(), Some(Ok(message)));
//! # Ok::<(), furuta_wire::EncodeError>(())
//! ```
#![no_std]

mod cobs;
mod counts;
mod frame;
mod message;
mod rig_end;

pub use counts::{ArmCounts, PendulumCounts};
pub use frame::{Decoder, EncodeError, FrameError, MAX_FRAME, encode};
pub use message::{
    Command, Hello, Message, PROTOCOL_VERSION, Query, RIG_NAME_CAPACITY, RigLimits, RigName,
    Sample, Status,
};
pub use rig_end::RigEnd;
