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
/// How long a host-led rig (see [`Pace::HostLed`]) waits at a tick.
const HOST_LED_PATIENCE: Duration = Duration::from_secs(1);
/// How long a patient rig (see [`Pace::Patient`]) puts off a tick: long against what a busy machine does to a thread,
/// short against the silence after which a host gives up ([`crate::LoopSettings::SILENCE`]).
const PATIENCE: Duration = Duration::from_millis(200);
/// Longest time between two looks at the stop flag.
const STOP_CHECK: Duration = Duration::from_millis(50);

/// What makes an emulated rig tick.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub enum Pace {
    /// The wall clock. A rig that the operating system keeps from running stops its own clock meanwhile (its thread
    /// is not a microcontroller), so that only the host can be late: it always has half a period at least.
    #[default]
    RealTime,
    /// The wall clock, but a host that answered the last sample but one is waited for if its answer to the last one is
    /// late: the emulated time stands still. For a host on the same machine, whose lateness says what else the machine
    /// does and nothing about the control. A host that stays silent meets the watchdog as ever.
    Patient,
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
    /// Kept open: a terminal whose other side is closed reports errors, and it tells what the host left unread.
    slave: TTYPort,
    stop: Arc<AtomicBool>,
}

impl Server {
    fn run(mut self, pace: Pace) -> EmulatedRig {
        let period = Duration::from_micros(u64::from(self.rig.period_us()));
        let mut due = Instant::now();
        let mut answered = false;
        while !self.stop.load(Ordering::Relaxed) {
            let (from, patience) = match pace {
                Pace::HostLed => (Instant::now(), HOST_LED_PATIENCE),
                Pace::Patient if answered => (due, PATIENCE),
                Pace::Patient | Pace::RealTime => (due, Duration::ZERO),
            };
            if self.listen(from, from + patience).is_err() {
                break;
            }
            answered = self.rig.is_answered();
            let sample = self.rig.tick();
            self.say(&Message::Sample(sample));
            // A tick that came late puts off the next ones: two in a row would leave the host no time to answer.
            due = (due + period).max(Instant::now() + period / 2);
        }
        self.rig
    }

    /// Takes what the host says until `due` has passed and the last sample is answered, or `deadline` has passed;
    /// answers queries at once.
    fn listen(&mut self, due: Instant, deadline: Instant) -> std::io::Result<()> {
        let mut buffer = [0; 256];
        // A host that has just come has no sample to answer yet: it is given one.
        let mut ready = self.rig.is_answered();
        while !self.stop.load(Ordering::Relaxed) {
            let until = if ready { due } else { deadline };
            let left = until.saturating_duration_since(Instant::now());
            self.master.set_timeout(left.min(STOP_CHECK))?;
            match self.master.read(&mut buffer) {
                Ok(n) => self.rig.receive(buffer.get(..n).unwrap_or_default()),
                Err(e) if matches!(e.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
                Err(e) => return Err(e),
            }
            if let Some(hello) = self.rig.hello() {
                ready = true;
                self.say(&Message::Hello(hello));
            }
            ready |= self.rig.is_answered();
            let until = if ready { due } else { deadline };
            if until <= Instant::now() {
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
            return; // no reader: like a UART, drop it
        }
        let mut buffer = [0; MAX_FRAME];
        if let Ok(frame) = encode(message, &mut buffer) {
            // A frame that the terminal does not take is lost on the wire: the host counts it.
            let _ = self.master.write_all(frame);
        }
    }
}
