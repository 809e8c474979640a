//! One run from port to log: connect, check that the rig is the one the rig file describes, fly, record.

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::time::Duration;

use furuta_file::{FileError, GrowingFile};
use furuta_log::{LogError, LogWriter, Metadata, WatchedFile};
use furuta_model::Rig;
use furuta_wire::Hello;

use crate::control_loop::run;
use crate::identity::{self, Change, Mismatch, WrongRig, listed, mismatches};
use crate::link::{Link, LinkError};
use crate::loop_settings::LoopSettings;
use crate::pilot::Pilot;
use crate::recorder::{RecordSender, Recorded, Recorder};
use crate::summary::Summary;
use crate::transport::{SerialTransport, Transport, TransportError};

/// How long a rig may take to say who it is: boards that restart when their port is opened need two seconds.
pub const HELLO_TIMEOUT: Duration = Duration::from_secs(4);

/// A run could not begin.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// The rig cannot be reached.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The log's file cannot be created.
    #[error(transparent)]
    File(#[from] FileError),
    /// The log cannot be written.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The rig is no longer the one that was there when the port was opened.
    #[error(
        "the rig on this port is not as it was when the port was opened: {}; start again",
        listed(.changes)
    )]
    AnotherRig {
        /// Everything that it says otherwise; never empty.
        changes: Vec<Change>,
    },
    /// The system starts no thread for the loop or the log.
    #[error("cannot start a thread: {0}")]
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

    /// Runs the loop, in a thread of its own with what [`LoopSettings::real_time`] asks for, and, if a path is given,
    /// logs it there. However the run ends, the log is ended properly. An older log at the path is replaced when the
    /// run is over, by one that has records; see [`GrowingFile`].
    ///
    /// # Errors
    /// [`SessionError`], before the run begins: the rig no longer answers, or the log cannot be written. What goes
    /// wrong in the run is in the summary.
    pub fn run<P: Pilot + Sync>(
        &mut self,
        pilot: &P,
        settings: &LoopSettings<'_>,
        log: Option<(&Path, &Metadata)>,
    ) -> Result<(Summary, Option<Recorded>), SessionError>
    where
        T: Send,
    {
        // What arrived since the last run is old by now; and the rig may have been exchanged meanwhile.
        ask_again(&mut self.link, &self.hello)?;
        let (sender, recorder) = match log {
            None => (RecordSender::nowhere(), None),
            Some((path, metadata)) => {
                let (file, place) = GrowingFile::create(path)?;
                match begin(file, place.path(), metadata) {
                    Ok((sender, recorder)) => (sender, Some((recorder, place))),
                    Err(error) => {
                        place.discard();
                        return Err(error);
                    }
                }
            }
        };
        let flown = self.in_a_thread(pilot, settings, sender);
        // The sender is gone, whatever came of the run: so the writer ends.
        let recorded = recorder.map(|(recorder, place)| put(recorder.finish(), place));
        let mut summary = flown?;
        if let Some(recorded) = &recorded {
            // What was in the ring when the writer gave up is lost as well.
            summary.unlogged = summary.samples.saturating_sub(recorded.records);
        }
        Ok((summary, recorded))
    }

    /// The loop in a thread of its own: priority and processor end with it, and no other thread inherits them. Ends the
    /// log.
    fn in_a_thread<P: Pilot + Sync>(
        &mut self,
        pilot: &P,
        settings: &LoopSettings<'_>,
        mut sender: RecordSender,
    ) -> Result<Summary, SessionError>
    where
        T: Send,
    {
        let (link, hello) = (&mut self.link, &self.hello);
        let body = move || {
            let (granted, _held) = settings.real_time.enter();
            sender.granted(&granted);
            // Locking memory takes a while, in which samples have become old.
            ask_again(link, hello)?;
            let mut summary = run(link, hello, pilot, settings, &mut sender);
            sender.end(&summary.timing);
            summary.granted = granted;
            Ok(summary)
        };
        std::thread::scope(|scope| {
            let thread = std::thread::Builder::new()
                .name("control-loop".to_owned())
                .spawn_scoped(scope, body)
                .map_err(SessionError::Thread)?;
            // A pilot's panic goes on here, after the motor is off.
            thread
                .join()
                .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        })
    }
}

/// Begins a log.
fn begin(
    file: File,
    path: &Path,
    metadata: &Metadata,
) -> Result<(RecordSender, Recorder), SessionError> {
    let file = WatchedFile::new(file, path).map_err(|source| LogError::Create {
        path: path.to_owned(),
        source,
    })?;
    let log = LogWriter::new(BufWriter::new(file), metadata)?;
    Recorder::start(log).map_err(SessionError::Thread)
}

/// A log with records takes its place; of one without, nothing stays, and an older log is as it was. What a failure
/// left of a log that replaces none stays
/// where it is: it may be readable as far as it goes.
fn put(mut recorded: Recorded, log: GrowingFile) -> Recorded {
    let is_empty = recorded.records == 0;
    if is_empty && recorded.error.is_some() && !log.replaces() {
        return recorded;
    }
    if is_empty {
        log.discard();
    } else if let Err(source) = log.keep() {
        recorded.error.get_or_insert_with(|| LogError::Keep {
            at: log.path().to_owned(),
            source,
        });
    }
    recorded
}

/// Throws away what arrived before; the rig must be the one that was there.
fn ask_again<T: Transport>(link: &mut Link<T>, was: &Hello) -> Result<(), SessionError> {
    let hello = link.ask(HELLO_TIMEOUT)?;
    match identity::changes(was, &hello) {
        changes if changes.is_empty() => Ok(()),
        changes => Err(SessionError::AnotherRig { changes }),
    }
}

impl From<TransportError> for SessionError {
    fn from(error: TransportError) -> Self {
        Self::Link(LinkError::Transport(error))
    }
}
