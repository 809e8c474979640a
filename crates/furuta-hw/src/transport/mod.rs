//! Ways to reach a rig: one trait, one file each.
//!
//! The loop is generic over the trait, so that no call goes through a table of pointers and a test can put anything
//! that carries bytes in a rig's place.

mod emulated;
mod faulty;
mod serial;

use std::time::{Duration, Instant};

pub use emulated::EmulatedTransport;
pub use faulty::{FaultRates, FaultyTransport};
pub use serial::SerialTransport;

/// Carries bytes to and from a rig.
pub trait Transport {
    /// Waits at most `timeout` for bytes and returns how many were put into `buffer`; 0 where none came in time.
    ///
    /// # Errors
    /// [`TransportError`]: the other end is gone or the system refuses.
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, TransportError>;

    /// Sends all bytes.
    ///
    /// # Errors
    /// [`TransportError`]: the other end is gone or does not take them.
    fn write(&mut self, bytes: &[u8]) -> Result<(), TransportError>;

    /// Throws away what has arrived and was not read.
    ///
    /// # Errors
    /// [`TransportError`]: the other end is gone.
    fn discard_input(&mut self) -> Result<(), TransportError>;

    /// The time in which this way to the rig lives: [`Instant::now`], or that of an emulated rig which knows no other.
    fn now(&self) -> Instant;
}

impl<T: Transport> Transport for &mut T {
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, TransportError> {
        (**self).read(buffer, timeout)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        (**self).write(bytes)
    }

    fn discard_input(&mut self) -> Result<(), TransportError> {
        (**self).discard_input()
    }

    fn now(&self) -> Instant {
        (**self).now()
    }
}

/// The way to the rig is not there (any more).
#[derive(Debug, thiserror::Error)]
pub enum TransportError {
    /// No such port.
    #[error(
        "port {port} does not exist: plug the rig in, or give another port (present: {present})"
    )]
    NoSuchPort {
        /// The port asked for.
        port: String,
        /// Ports that are there, in words.
        present: String,
    },
    /// The path is that of something else.
    #[error("{port} is {what}, not a serial port: give the rig's port (present: {present})")]
    NotAPort {
        /// The path given.
        port: String,
        /// What is there.
        what: &'static str,
        /// Ports that are there, in words.
        present: String,
    },
    /// The port is there but cannot be used.
    #[error(
        "port {port} cannot be opened ({reason}): close other programs that use it, or see that you may \
         read and write it"
    )]
    Refused {
        /// The port asked for.
        port: String,
        /// What the system said.
        reason: String,
    },
    /// The port disappeared while in use.
    #[error(
        "port {port} is gone: the rig was unplugged or switched off, plug it in again and restart"
    )]
    Unplugged {
        /// The port.
        port: String,
    },
    /// The other end takes no bytes.
    #[error("port {port} takes no bytes: the rig has stopped reading")]
    Stuck {
        /// The port.
        port: String,
    },
    /// Anything else the system says.
    #[error("port {port}: {source}")]
    Io {
        /// The port.
        port: String,
        /// What the system said.
        source: std::io::Error,
    },
}
