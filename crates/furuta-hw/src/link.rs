//! The host's end of the wire: messages in place of bytes.

use std::time::{Duration, Instant};

use furuta_model::Actuation;
use furuta_wire::{
    Command, Decoder, FrameError, Hello, MAX_FRAME, Message, PROTOCOL_VERSION, Query, RigLimits,
    encode,
};

use crate::transport::{Transport, TransportError};

/// How often the rig is asked who it is until it answers.
const QUERY_PERIOD: Duration = Duration::from_millis(100);
/// Reads after a deadline: more than a port holds back for a host that was busy.
const OVERTIME: u32 = 32;

/// No connection to a rig.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// The way to the rig.
    #[error(transparent)]
    Transport(#[from] TransportError),
    /// Nothing, or nothing that makes sense, was answered.
    #[error("no furuta rig answered within {waited:.1?} ({bytes} bytes came, {bad_frames} bad frames): {}",
        advice(*.bytes))]
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
        value: String,
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
    /// A link whose other end has not been asked yet who it is.
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
        let start = self.now();
        let mut wrong_version = None;
        while self.now().duration_since(start) < timeout {
            self.transport.write(&[0])?; // separates our first frame from whatever the rig has half received
            self.send(&Message::Query(Query {
                version: PROTOCOL_VERSION,
            }))?;
            let deadline = self.now() + QUERY_PERIOD;
            let mut overtime = OVERTIME;
            loop {
                match self.next(deadline, &mut overtime)? {
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
            waited: self.now().duration_since(start),
            bytes: self.bytes,
            bad_frames: self.bad_frames,
        })
    }

    /// Next message, or `None` at the deadline ([`Self::now`]), however much comes that is none. Bad frames are counted
    /// and skipped.
    ///
    /// # Errors
    /// [`TransportError`].
    pub fn receive(&mut self, deadline: Instant) -> Result<Option<Message>, TransportError> {
        let mut overtime = OVERTIME;
        loop {
            match self.next(deadline, &mut overtime)? {
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

    /// How long a query and its answer take, there and back; `None` where none comes within `timeout`. Samples that
    /// come meanwhile are thrown away: not for use while something moves.
    ///
    /// # Errors
    /// [`TransportError`].
    pub fn round_trip(&mut self, timeout: Duration) -> Result<Option<Duration>, TransportError> {
        let left = self.now();
        self.query()?;
        loop {
            match self.receive(left + timeout)? {
                Some(Message::Hello(_)) => return Ok(Some(self.now().duration_since(left))),
                Some(_) if self.now() < left + timeout => {}
                _ => return Ok(None),
            }
        }
    }

    /// Frames received so far that were not valid.
    #[must_use]
    pub fn bad_frames(&self) -> u64 {
        self.bad_frames
    }

    /// The time in which the way to the rig lives: [`Transport::now`].
    #[must_use]
    pub fn now(&self) -> Instant {
        self.transport.now()
    }

    fn next(
        &mut self,
        deadline: Instant,
        overtime: &mut u32,
    ) -> Result<Option<Result<Message, FrameError>>, TransportError> {
        loop {
            while let Some(i) = self.unread.next() {
                if let Some(result) = self.inbox.get(i).and_then(|&byte| self.decoder.push(byte)) {
                    self.bad_frames += u64::from(result.is_err());
                    return Ok(Some(result));
                }
            }
            let left = deadline.saturating_duration_since(self.now());
            if left.is_zero() {
                // What had come in time is still read; what never ends is not.
                let Some(reads) = overtime.checked_sub(1) else {
                    return Ok(None);
                };
                *overtime = reads;
            }
            let n = self.transport.read(&mut self.inbox, left)?;
            self.unread = 0..n;
            self.bytes += n as u64;
            if n == 0 && left.is_zero() {
                return Ok(None);
            }
        }
    }
}

/// Refuses a rig with which no run could be safe, or make sense.
fn check(hello: &Hello) -> Result<(), LinkError> {
    let counts = |value: f64| value.is_finite() && value != 0.0;
    let positive = |value: f32| value.is_finite() && value > 0.0;
    let limit = |value: Option<f32>| value.is_none_or(positive);
    let shown = |value: Option<f32>| value.map_or("none".to_owned(), |value| value.to_string());
    let RigLimits {
        arm_angle,
        arm_speed,
        pendulum_speed,
    } = hello.limits;
    const COUNTS: &str = "finite and not 0";
    const POSITIVE: &str = "finite and above 0";
    const LIMIT: &str = "finite and above 0, or none";
    let fields = [
        (
            "name",
            !hello.rig.trim().is_empty(),
            format!("{:?}", hello.rig.as_str()),
            "that of its rig file",
        ),
        (
            "period_us",
            (100..=1_000_000).contains(&hello.period_us),
            hello.period_us.to_string(),
            "between 100 and 1000000",
        ),
        (
            "arm_counts_per_rev",
            counts(hello.arm_counts_per_rev),
            hello.arm_counts_per_rev.to_string(),
            COUNTS,
        ),
        (
            "pendulum_counts_per_rev",
            counts(hello.pendulum_counts_per_rev),
            hello.pendulum_counts_per_rev.to_string(),
            COUNTS,
        ),
        (
            "command_limit",
            positive(hello.command_limit),
            hello.command_limit.to_string(),
            POSITIVE,
        ),
        ("limit arm_angle", limit(arm_angle), shown(arm_angle), LIMIT),
        ("limit arm_speed", limit(arm_speed), shown(arm_speed), LIMIT),
        (
            "limit pendulum_speed",
            limit(pendulum_speed),
            shown(pendulum_speed),
            LIMIT,
        ),
        (
            "watchdog_periods",
            hello.watchdog_periods > 0,
            hello.watchdog_periods.to_string(),
            "at least 1",
        ),
        (
            "actuation",
            Actuation::from_code(hello.actuation).is_some(),
            hello.actuation.to_string(),
            "0 (V), 1 (A), 2 (N m) or 3 (rad/s2)",
        ),
    ];
    match fields.into_iter().find(|(_, is_good, ..)| !is_good) {
        Some((field, _, value, allowed)) => Err(LinkError::BadHello {
            field,
            value,
            allowed,
        }),
        None => Ok(()),
    }
}
