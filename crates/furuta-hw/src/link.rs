//! The host's end of the wire: messages in place of bytes.

use std::time::{Duration, Instant};

use furuta_wire::{
    Command, Decoder, FrameError, Hello, MAX_FRAME, Message, PROTOCOL_VERSION, Query, encode,
};

use crate::transport::{Transport, TransportError};

/// How often the rig is asked who it is until it answers.
const QUERY_PERIOD: Duration = Duration::from_millis(100);

/// No connection to a rig.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// The way to the rig.
    #[error(transparent)]
    Transport(#[from] TransportError),
    /// Nothing, or nothing that makes sense, was answered.
    #[error("no furuta rig answered within {waited:.1?} ({bytes} bytes came, {bad_frames} bad frames): {}", advice(*.bytes))]
    NoHello {
        /// How long was waited.
        waited: Duration,
        /// Bytes that came meanwhile.
        bytes: u64,
        /// Frames among them that were not valid.
        bad_frames: u64,
    },
    /// The rig speaks another version of the protocol.
    #[error(
        "the rig speaks protocol version {found}, this program {PROTOCOL_VERSION}: update the older of the two"
    )]
    Version {
        /// The rig's version.
        found: u16,
    },
    /// The rig says of itself what cannot be.
    #[error("the rig's {field} is {value}, must be {allowed}: correct its firmware's settings")]
    BadHello {
        /// Field of the Hello message.
        field: &'static str,
        /// Its value.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
}

fn advice(bytes: u64) -> &'static str {
    if bytes == 0 {
        "see that the rig is switched on and that this is its port"
    } else {
        "something talks on this port, but not a furuta rig, or at another baud rate"
    }
}

/// A connection to a rig.
#[derive(Debug)]
pub struct Link<T> {
    transport: T,
    decoder: Decoder,
    inbox: [u8; 512],
    unread: std::ops::Range<usize>,
    bytes: u64,
    bad_frames: u64,
}

impl<T: Transport> Link<T> {
    /// A link on which nobody has been asked yet who is at the other end.
    #[must_use]
    pub fn new(transport: T) -> Self {
        Self {
            transport,
            decoder: Decoder::new(),
            inbox: [0; 512],
            unread: 0..0,
            bytes: 0,
            bad_frames: 0,
        }
    }

    /// Asks the rig who it is, for at most `timeout` (rigs that reset when their port is opened need two seconds).
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn connect(transport: T, timeout: Duration) -> Result<(Self, Hello), LinkError> {
        let mut link = Self::new(transport);
        let hello = link.ask(timeout)?;
        Ok((link, hello))
    }

    /// Asks the rig again who it is. Whatever had arrived before is thrown away: after a pause that is old, and mostly
    /// incomplete.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn ask(&mut self, timeout: Duration) -> Result<Hello, LinkError> {
        self.transport.discard_input()?;
        self.unread = 0..0;
        self.decoder = Decoder::new();
        let start = Instant::now();
        let mut wrong_version = None;
        while start.elapsed() < timeout {
            self.transport.write(&[0])?; // separates our first frame from whatever the rig has half received
            self.send(&Message::Query(Query {
                version: PROTOCOL_VERSION,
            }))?;
            let deadline = Instant::now() + QUERY_PERIOD;
            loop {
                match self.next(deadline)? {
                    Some(Ok(Message::Hello(hello))) => {
                        check(&hello)?;
                        return Ok(hello);
                    }
                    Some(Err(FrameError::Version { found })) => wrong_version = Some(found),
                    Some(_) => {}
                    None => break,
                }
            }
            if let Some(found) = wrong_version {
                return Err(LinkError::Version { found });
            }
        }
        Err(LinkError::NoHello {
            waited: start.elapsed(),
            bytes: self.bytes,
            bad_frames: self.bad_frames,
        })
    }

    /// Next message, or `None` at the deadline. Bad frames are counted and skipped.
    ///
    /// # Errors
    /// [`TransportError`].
    pub fn receive(&mut self, deadline: Instant) -> Result<Option<Message>, TransportError> {
        loop {
            match self.next(deadline)? {
                Some(Ok(message)) => return Ok(Some(message)),
                Some(Err(_)) => {}
                None => return Ok(None),
            }
        }
    }

    /// Sends a message.
    ///
    /// # Errors
    /// [`TransportError`].
    pub fn send(&mut self, message: &Message) -> Result<(), TransportError> {
        let mut buffer = [0; MAX_FRAME];
        // MAX_FRAME holds every message; were that ever wrong, silence is what the rig's watchdog is there for.
        let frame = encode(message, &mut buffer).unwrap_or_default();
        self.transport.write(frame)
    }

    /// Answers sample `seq` with a motor voltage.
    ///
    /// # Errors
    /// [`TransportError`].
    pub fn command(&mut self, seq: u32, volts: f32) -> Result<(), TransportError> {
        self.send(&Message::Command(Command { seq, volts }))
    }

    /// Asks the rig who it is, without waiting for the answer.
    ///
    /// # Errors
    /// [`TransportError`].
    pub fn query(&mut self) -> Result<(), TransportError> {
        self.send(&Message::Query(Query {
            version: PROTOCOL_VERSION,
        }))
    }

    /// How long a query and its answer take, there and back; `None` where none comes within `timeout`. Samples that come meanwhile are
    /// thrown away: not for use while something moves.
    ///
    /// # Errors
    /// [`TransportError`].
    pub fn round_trip(&mut self, timeout: Duration) -> Result<Option<Duration>, TransportError> {
        let left = Instant::now();
        self.query()?;
        while let Some(message) = self.receive(left + timeout)? {
            if let Message::Hello(_) = message {
                return Ok(Some(left.elapsed()));
            }
        }
        Ok(None)
    }

    /// Frames received so far that were not valid.
    #[must_use]
    pub fn bad_frames(&self) -> u64 {
        self.bad_frames
    }

    fn next(
        &mut self,
        deadline: Instant,
    ) -> Result<Option<Result<Message, FrameError>>, TransportError> {
        loop {
            while let Some(i) = self.unread.next() {
                if let Some(result) = self.inbox.get(i).and_then(|&byte| self.decoder.push(byte)) {
                    self.bad_frames += u64::from(result.is_err());
                    return Ok(Some(result));
                }
            }
            let left = deadline.saturating_duration_since(Instant::now());
            let n = self.transport.read(&mut self.inbox, left)?;
            self.unread = 0..n;
            self.bytes += n as u64;
            if n == 0 && left.is_zero() {
                return Ok(None);
            }
        }
    }
}

fn check(hello: &Hello) -> Result<(), LinkError> {
    let bad = |field, value, allowed| {
        Err(LinkError::BadHello {
            field,
            value,
            allowed,
        })
    };
    if !(100..=1_000_000).contains(&hello.period_us) {
        return bad(
            "period_us",
            f64::from(hello.period_us),
            "between 100 and 1000000",
        );
    }
    for (field, value) in [
        ("arm_counts_per_rev", hello.arm_counts_per_rev),
        ("pendulum_counts_per_rev", hello.pendulum_counts_per_rev),
    ] {
        if !(value.is_finite() && value != 0.0) {
            return bad(field, value, "finite and not 0");
        }
    }
    if !(hello.command_limit.is_finite() && hello.command_limit > 0.0) {
        return bad(
            "command_limit",
            f64::from(hello.command_limit),
            "finite and above 0",
        );
    }
    Ok(())
}
