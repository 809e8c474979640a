//! What happened in a run.

use arrayvec::ArrayVec;
use furuta_log::{Mode, Timing};

use crate::real_time::Granted;
use crate::run_error::RunError;

/// Changes of mode that a summary can hold; later ones are only counted.
const MODE_CHANGES: usize = 64;

/// How a run ended.
#[derive(Debug)]
pub enum End {
    /// Its duration was over.
    Finished,
    /// The stop flag was set.
    Stopped,
    /// Something was wrong.
    Failed(RunError),
}

/// A change of mode.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct ModeChange {
    /// When (s).
    pub t: f64,
    /// The mode from then on.
    pub mode: Mode,
}

/// What happened in a run.
#[derive(Debug)]
pub struct Summary {
    /// How it ended.
    pub end: End,
    /// The rig's clock from first to last sample (s).
    pub seconds: f64,
    /// Samples received.
    pub samples: u64,
    /// Samples lost on the wire, or left out as no news.
    pub lost: u64,
    /// Samples that were no news, repeated or old: they got no command.
    pub old: u64,
    /// Samples that arrived more than a period later than the promptest.
    pub late: u64,
    /// Periods in which the rig heard no valid command and held the last one: the host was late, or the frame lost.
    pub held: u64,
    /// Periods in which the rig's watchdog had the motor off after the run had begun.
    pub watchdog: u64,
    /// Frames that were not valid.
    pub bad_frames: u64,
    /// Records that are not in the log: its writer did not keep up, or gave up.
    pub unlogged: u64,
    /// First changes of mode, in order.
    pub modes: ArrayVec<ModeChange, MODE_CHANGES>,
    /// Number of changes of mode, the first mode included.
    pub mode_changes: u64,
    /// How punctual the loop was.
    pub timing: Timing,
    /// What the system granted.
    pub granted: Granted,
}

impl Summary {
    pub(crate) fn new(period_ns: u64) -> Self {
        Self {
            end: End::Finished,
            seconds: 0.0,
            samples: 0,
            lost: 0,
            old: 0,
            late: 0,
            held: 0,
            watchdog: 0,
            bad_frames: 0,
            unlogged: 0,
            modes: ArrayVec::new(),
            mode_changes: 0,
            timing: Timing::new(period_ns),
            granted: Granted::default(),
        }
    }

    /// The error that ended the run, if one did.
    #[must_use]
    pub fn error(&self) -> Option<&RunError> {
        match &self.end {
            End::Failed(error) => Some(error),
            End::Finished | End::Stopped => None,
        }
    }
}
