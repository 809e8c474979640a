//! One run from port to log: connect, check that the rig is the one the rig file describes, fly, record.

use std::path::Path;
use std::time::Duration;

use furuta_log::{LogError, LogWriter, Metadata};
use furuta_model::Rig;
use furuta_wire::Hello;

use crate::control_loop::{LoopSettings, Summary, run};
use crate::identity::{self, Mismatch, WrongRig, mismatches};
use crate::link::{Link, LinkError};
use crate::pilot::Pilot;
use crate::recorder::{RecordSender, Recorded, Recorder};
use crate::transport::{SerialTransport, Transport, TransportError};

/// How long a rig may take to say who it is: boards that restart when their port is opened need two seconds.
pub const HELLO_TIMEOUT: Duration = Duration::from_secs(4);

/// A run could not begin.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// The rig cannot be reached.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The log cannot be written.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The rig is no longer the one that was there when the port was opened.
    #[error(
        "the rig on this port was {was} and is now {is}, or its settings have changed: start again"
    )]
    AnotherRig {
        /// Name before.
        was: String,
        /// Name now.
        is: String,
    },
    /// The system starts no thread for the log.
    #[error("cannot start the log's thread: {0}")]
    Thread(#[source] std::io::Error),
}

/// A rig on a port, connected.
#[derive(Debug)]
pub struct Session<T> {
    link: Link<T>,
    hello: Hello,
}

impl Session<SerialTransport> {
    /// Opens a port and asks who is there.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn open(port: &str, baud: u32) -> Result<Self, LinkError> {
        Self::connect(SerialTransport::open(port, baud).map_err(LinkError::Transport)?)
    }
}

impl<T: Transport> Session<T> {
    /// Asks over any transport who is there.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn connect(transport: T) -> Result<Self, LinkError> {
        let (link, hello) = Link::connect(transport, HELLO_TIMEOUT)?;
        Ok(Self { link, hello })
    }

    /// What the rig says of itself.
    #[must_use]
    pub fn hello(&self) -> &Hello {
        &self.hello
    }

    /// The rig's sampling period (s).
    #[must_use]
    pub fn period(&self) -> f64 {
        f64::from(self.hello.period_us) * 1e-6
    }

    /// Where the rig and the rig file disagree. A controller designed for another rig may do harm.
    #[must_use]
    pub fn mismatches(&self, rig: &Rig) -> Vec<Mismatch> {
        mismatches(&self.hello, rig)
    }

    /// Refuses a rig that is not the one of the rig file.
    ///
    /// # Errors
    /// [`WrongRig`], with all that differs.
    pub fn check(&self, rig: &Rig) -> Result<(), WrongRig> {
        identity::check(&self.hello, rig)
    }

    /// Runs the loop and, if a path is given, logs it there. However the run ends, the log is ended properly.
    ///
    /// # Errors
    /// [`SessionError`], before the run begins: the rig no longer answers, or the log cannot be written. What goes
    /// wrong in the run is in the summary.
    pub fn run<P: Pilot>(
        &mut self,
        pilot: &P,
        settings: &LoopSettings<'_>,
        log: Option<(&Path, &Metadata)>,
    ) -> Result<(Summary, Option<Recorded>), SessionError> {
        // What arrived since the last run is old by now; and the rig may have been exchanged meanwhile.
        let hello = self.link.ask(HELLO_TIMEOUT)?;
        if hello != self.hello {
            return Err(SessionError::AnotherRig {
                was: self.hello.rig.to_string(),
                is: hello.rig.to_string(),
            });
        }
        let (mut sender, recorder) = match log {
            None => (RecordSender::nowhere(), None),
            Some((path, metadata)) => {
                let (sender, recorder) = Recorder::start(LogWriter::create(path, metadata)?)
                    .map_err(SessionError::Thread)?;
                (sender, Some(recorder))
            }
        };
        let summary = run(&mut self.link, &self.hello, pilot, settings, &mut sender);
        drop(sender); // ends the log
        Ok((summary, recorder.map(Recorder::finish)))
    }
}

impl From<TransportError> for SessionError {
    fn from(error: TransportError) -> Self {
        Self::Link(LinkError::Transport(error))
    }
}
