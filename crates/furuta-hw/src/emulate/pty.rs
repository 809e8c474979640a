//! The emulated rig behind a pseudo-terminal: a host opens its path as it would open `/dev/ttyACM0`.

use std::io::{ErrorKind, Read, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use furuta_wire::{MAX_FRAME, Message, encode};
use serialport::{SerialPort, TTYPort};

use super::EmulatedRig;

/// Bytes the host may leave unread before the rig drops frames, as a UART without flow control does. The terminal
/// itself would take more and then block the rig.
const UNREAD_LIMIT: u32 = 2048;
/// How long a rig that waits for its host (see [`Pace::HostLed`]) waits at a tick.
const HOST_LED_PATIENCE: Duration = Duration::from_secs(1);
/// Longest time between two looks at the stop flag.
const STOP_CHECK: Duration = Duration::from_millis(50);

/// What makes an emulated rig tick.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub enum Pace {
    /// The wall clock. A rig that the operating system keeps from running stops its own clock meanwhile (its thread
    /// is not a microcontroller), so that only the host can be late.
    #[default]
    RealTime,
    /// The host: the next tick comes as soon as the last sample is answered. As fast as both can, and the same every
    /// time.
    HostLed,
}

/// A pseudo-terminal cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum PtyError {
    /// The system gives none.
    #[error("no pseudo-terminal: {0}; see that /dev/ptmx and /dev/pts are there")]
    Open(#[source] serialport::Error),
    /// The system gives one without a name.
    #[error("the system does not tell the pseudo-terminal's name")]
    NoName,
    /// The system starts no thread.
    #[error("cannot start the rig's thread: {0}")]
    Thread(#[source] std::io::Error),
}

/// An emulated rig that runs in its own thread behind a pseudo-terminal, until it is unplugged or dropped.
#[derive(Debug)]
pub struct PtyRig {
    path: String,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<EmulatedRig>>,
}

impl PtyRig {
    /// Switches the rig on.
    ///
    /// # Errors
    /// [`PtyError`].
    pub fn start(rig: EmulatedRig, pace: Pace) -> Result<Self, PtyError> {
        let (master, slave) = TTYPort::pair().map_err(PtyError::Open)?;
        let path = slave.name().ok_or(PtyError::NoName)?;
        let stop = Arc::new(AtomicBool::new(false));
        let server = Server {
            rig,
            master,
            slave,
            stop: Arc::clone(&stop),
        };
        let thread = std::thread::Builder::new()
            .name("emulated-rig".to_owned())
            .spawn(move || server.run(pace))
            .map_err(PtyError::Thread)?;
        Ok(Self {
            path,
            stop,
            thread: Some(thread),
        })
    }

    /// Path of the port, to be opened by the host.
    #[must_use]
    pub fn path(&self) -> &str {
        &self.path
    }

    /// Pulls the cable: the port disappears under whoever has it open. Returns the rig as it then was; `None` if its
    /// thread had died.
    pub fn unplug(mut self) -> Option<EmulatedRig> {
        self.halt()
    }

    fn halt(&mut self) -> Option<EmulatedRig> {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.take().and_then(|thread| thread.join().ok())
    }
}

impl Drop for PtyRig {
    fn drop(&mut self) {
        self.halt();
    }
}

struct Server {
    rig: EmulatedRig,
    master: TTYPort,
    /// Kept open: a terminal whose other side nobody holds reports errors, and it tells what the host left unread.
    slave: TTYPort,
    stop: Arc<AtomicBool>,
}

impl Server {
    fn run(mut self, pace: Pace) -> EmulatedRig {
        let period = Duration::from_micros(u64::from(self.rig.period_us()));
        let mut due = Instant::now();
        while !self.stop.load(Ordering::Relaxed) {
            let deadline = match pace {
                Pace::RealTime => due,
                Pace::HostLed => Instant::now() + HOST_LED_PATIENCE,
            };
            if self.listen_until(deadline, pace).is_err() {
                break;
            }
            let sample = self.rig.tick();
            self.say(&Message::Sample(sample));
            due = (due + period).max(Instant::now());
        }
        self.rig
    }

    /// Takes what the host says until it is time for the next tick; answers queries at once.
    fn listen_until(&mut self, deadline: Instant, pace: Pace) -> std::io::Result<()> {
        let mut buffer = [0; 256];
        while !self.stop.load(Ordering::Relaxed) {
            let left = deadline.saturating_duration_since(Instant::now());
            self.master.set_timeout(left.min(STOP_CHECK))?;
            match self.master.read(&mut buffer) {
                Ok(n) => self.rig.receive(buffer.get(..n).unwrap_or_default()),
                Err(e) if matches!(e.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
                Err(e) => return Err(e),
            }
            let hello = self.rig.hello();
            if let Some(hello) = hello {
                self.say(&Message::Hello(hello));
            }
            // A host that has just come has no sample to answer yet: a host-led rig gives it one.
            let led = pace == Pace::HostLed && (self.rig.is_answered() || hello.is_some());
            if led || left.is_zero() {
                break;
            }
        }
        Ok(())
    }

    fn say(&mut self, message: &Message) {
        if self
            .slave
            .bytes_to_read()
            .is_ok_and(|unread| unread > UNREAD_LIMIT)
        {
            return; // nobody reads: like a UART, drop it
        }
        let mut buffer = [0; MAX_FRAME];
        if let Ok(frame) = encode(message, &mut buffer) {
            // A frame that the terminal does not take is lost on the wire: the host counts it.
            let _ = self.master.write_all(frame);
        }
    }
}
