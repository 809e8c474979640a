//! An emulated rig without a port, a thread or a clock: it ticks when the host waits for it. As fast as the host, and
//! the same every time.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use furuta_wire::{MAX_FRAME, Message, encode};

use super::{Transport, TransportError};
use crate::emulate::EmulatedRig;

/// Bytes the host may leave unread before frames are dropped, as a UART without flow control does.
const UNREAD_LIMIT: usize = 4096;

/// An emulated rig as a transport. Each read on an empty line is a tick: a host that only waits finds that time passes,
/// that of the host included.
///
/// ```
/// use furuta_hw::{EmulatedRig, EmulatedTransport, Emulation, Link};
/// let rig = furuta_model::Rig::builtin("qube-servo-2").ok_or("no such rig")?;
/// let transport = EmulatedTransport::new(EmulatedRig::new(&rig, &Emulation::default())?);
/// let (_, hello) = Link::connect(transport, std::time::Duration::from_secs(1))?;
/// assert_eq!(hello.rig.as_str(), "qube-servo-2");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct EmulatedTransport {
    rig: EmulatedRig,
    line: VecDeque<u8>,
    now: Instant,
}

impl EmulatedTransport {
    /// Switches the rig on.
    #[must_use]
    pub fn new(rig: EmulatedRig) -> Self {
        Self {
            rig,
            line: VecDeque::with_capacity(UNREAD_LIMIT + MAX_FRAME),
            now: Instant::now(),
        }
    }

    /// The rig at the other end: to look at it, to push its pendulum, or to put another in its place.
    pub fn rig(&mut self) -> &mut EmulatedRig {
        &mut self.rig
    }

    fn say(&mut self, message: &Message) {
        let mut buffer = [0; MAX_FRAME];
        if self.line.len() <= UNREAD_LIMIT
            && let Ok(frame) = encode(message, &mut buffer)
        {
            self.line.extend(frame);
        }
    }
}

impl Transport for EmulatedTransport {
    fn read(&mut self, buffer: &mut [u8], _: Duration) -> Result<usize, TransportError> {
        if let Some(hello) = self.rig.hello() {
            self.say(&Message::Hello(hello));
        }
        if self.line.is_empty() {
            let sample = self.rig.tick();
            self.now += Duration::from_micros(self.rig.period_us().into());
            self.say(&Message::Sample(sample));
        }
        let filled = buffer.len().min(self.line.len());
        for (slot, byte) in buffer.iter_mut().zip(self.line.drain(..filled)) {
            *slot = byte;
        }
        Ok(filled)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        self.rig.receive(bytes);
        Ok(())
    }

    fn discard_input(&mut self) -> Result<(), TransportError> {
        self.line.clear();
        Ok(())
    }

    /// The rig's time, as far as it has ticked.
    fn now(&self) -> Instant {
        self.now
    }
}
