//! What can be noticed about a recording.

/// A scale of an encoder within this share of 1 is no reason to refuse a recording.
const NEARLY_RIGHT: f64 = 0.1;

/// What was noticed. Rows are counted as in [`RecordingError`](crate::RecordingError).
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum NoticeKind {
    /// The log was cut off or damaged; what stands before that place was read.
    CutOff {
        /// How the log ends and how much was read.
        what: String,
    },
    /// Rows that repeat the row before, time stamp included, were dropped.
    DuplicatedRows {
        /// The rows dropped.
        rows: Vec<usize>,
    },
    /// Samples are missing: the recording falls into segments, and no prediction runs across the gap.
    Gap {
        /// The row after the gap.
        row: usize,
        /// Time before the gap, s.
        from: f64,
        /// Time after it, s.
        to: f64,
    },
    /// Many gaps.
    Gaps {
        /// The rows after them.
        rows: Vec<usize>,
    },
    /// Single intervals are too long or too short for the sample period; the recording is divided there.
    IrregularIntervals {
        /// The rows after them.
        rows: Vec<usize>,
        /// The sample period, s.
        period: f64,
    },
    /// Time stamps scatter so much that there is no sample period: they are used as they are.
    UnevenTime {
        /// Intervals that differ from the mean.
        irregular: usize,
        /// All intervals.
        intervals: usize,
        /// The mean interval, s.
        period: f64,
    },
    /// Time stamps scatter; the samples are taken as evenly spaced.
    Jitter {
        /// The largest deviation of an interval from the sample period, as a fraction of it.
        largest: f64,
        /// The sample period, s.
        period: f64,
    },
    /// Segments between gaps are too short to be of use and left out.
    ShortSegments {
        /// The first row of each.
        rows: Vec<usize>,
        /// Their samples together.
        samples: usize,
    },
    /// An angle was recorded modulo a turn and made continuous.
    Unwrapped {
        /// The column.
        column: &'static str,
        /// The first row at which it jumps.
        row: usize,
        /// How often it jumps.
        jumps: usize,
    },
    /// Single samples of an angle stand out from both neighbours as no motion does: the recording is divided there.
    Spikes {
        /// The column.
        column: &'static str,
        /// The rows.
        rows: Vec<usize>,
        /// How far the first is off, rad.
        by: f64,
    },
    /// The same in more rows than glitches are: all are used.
    ManySpikesSuspected {
        /// The column.
        column: &'static str,
        /// In how many rows.
        rows: usize,
        /// How far the first is off, rad.
        by: f64,
    },
    /// An angle jumps by far more than a sample allows, and not by a turn: left as recorded.
    Jump {
        /// The column.
        column: &'static str,
        /// The row after the jump.
        row: usize,
        /// The jump, rad.
        by: f64,
    },
    /// The recording is too short to say much.
    TooShort {
        /// Its duration, s.
        duration: f64,
        /// What it should have at least, s.
        required: f64,
    },
    /// The command never changes: nothing about the motor can be told from this recording.
    ConstantCommand {
        /// The command, V.
        value: f64,
    },
    /// Neither angle moves.
    NoMotion,
    /// An angle looks as if it were in degrees.
    DegreesSuspected {
        /// The column.
        column: &'static str,
        /// The smallest change in it, which is the encoder's resolution.
        resolution: f64,
        /// Its largest size.
        largest: f64,
    },
    /// Time stamps look as if they were not in seconds.
    TimeUnitSuspected {
        /// The sample period that they give, s.
        period: f64,
        /// The unit that would give a usual rate.
        unit: &'static str,
    },
    /// The pendulum swings about alpha = 0, which should be upright.
    HangingSuspected,
    /// The pendulum answers the arm with the wrong sign: theta or alpha is counted the other way.
    SignSuspected,
    /// The pendulum's equation holds if two columns are swapped, and not as they are.
    SwappedSuspected {
        /// The two.
        columns: [&'static str; 2],
    },
    /// An encoder stops counting while the axis turns on.
    ClippedSuspected {
        /// The column.
        column: &'static str,
        /// The value at which it ends, rad.
        at: f64,
        /// How often it was met.
        times: usize,
    },
    /// The pendulum swings at another frequency than the rig's.
    FrequencySuspected {
        /// Small swings in the recording, Hz.
        found: f64,
        /// Small swings of the rig, Hz.
        expected: f64,
    },
    /// The two angles are not in one unit.
    ScaleSuspected {
        /// Coupling of arm and pendulum over the rig's.
        ratio: f64,
    },
    /// An angle was made from counts with another number of counts per turn than its encoder has.
    CountsSuspected {
        /// The column.
        column: &'static str,
        /// Counts per turn of the encoder.
        encoder: f64,
        /// Counts per turn that the angle was made with.
        taken: f64,
        /// Counts per turn in the rig file.
        in_rig_file: f64,
        /// The angle at which the encoder counts zero, rad.
        zero: f64,
    },
    /// The two angles are not in one scale, by a ratio of usual counts per turn; which of them is wrong does not show.
    EitherCountsSuspected {
        /// Coupling of arm and pendulum over the rig's.
        ratio: f64,
        /// Counts per turn of the arm's encoder if that is the wrong one, and those that theta was made with.
        arm: (f64, f64),
        /// The same of alpha.
        pendulum: (f64, f64),
    },
    /// An angle is in counts of the encoder.
    RawCountsSuspected {
        /// The column.
        column: &'static str,
        /// Its largest size.
        largest: f64,
        /// Counts per turn in the rig file, where a rig is known.
        per_turn: Option<f64>,
    },
    /// The command goes beyond the rig's limit: it looks as if it were in another unit than volts.
    CommandUnitSuspected {
        /// The largest command.
        largest: f64,
        /// The rig's `command_limit`, V.
        limit: f64,
        /// The likely unit.
        unit: &'static str,
        /// By which to multiply.
        factor: f64,
    },
    /// The arm answers the command far more, or far less, than with the rig file's motor.
    MotorGainSuspected {
        /// How hard one unit of the column moves the arm, over one of the command.
        factor: f64,
        /// The unit in which it looks to be, and by which to multiply.
        unit: Option<(&'static str, f64)>,
        /// Whether the motor brakes the arm by as much, as a gear does.
        geared: bool,
        /// Unit of the command.
        command: &'static str,
    },
    /// An encoder stops while its axis must move.
    FrozenSuspected {
        /// The column.
        column: &'static str,
        /// When it stops, s.
        since: f64,
        /// Until when it stands, s.
        until: f64,
        /// The value at which it stands, rad.
        at: f64,
    },
    /// The arm answers the command with the wrong sign.
    CommandSignSuspected,
    /// The two angles of a row are not of one moment.
    SkewSuspected {
        /// By how many rows alpha is late against theta.
        rows: f64,
    },
    /// The arm answers the command before it is written.
    LateCommandSuspected {
        /// By how many rows it is late.
        rows: f64,
    },
    /// Another recording is wrong as a program is in all that it records, and nothing shows that this one is right.
    AsInAnother {
        /// What is said of the other.
        what: Box<NoticeKind>,
        /// The other recording.
        other: String,
    },
    /// The recording is not used.
    LeftOut {
        /// What is wrong with it.
        why: String,
    },
    /// The recording is of another rig than the one it is diagnosed with.
    OtherRigSuspected {
        /// The other recording.
        than: String,
        /// What differs.
        why: String,
    },
}

impl NoticeKind {
    /// The column that it is about alone, `u`, `theta` or `alpha`.
    ///
    /// ```
    /// use furuta_recording::NoticeKind;
    /// assert_eq!(NoticeKind::HangingSuspected.column(), Some("alpha"));
    /// assert_eq!(NoticeKind::CommandSignSuspected.column(), Some("u"));
    /// assert_eq!(NoticeKind::SignSuspected.column(), None);
    /// ```
    #[must_use]
    pub fn column(&self) -> Option<&'static str> {
        match self {
            Self::ConstantCommand { .. }
            | Self::CommandUnitSuspected { .. }
            | Self::MotorGainSuspected { .. }
            | Self::LateCommandSuspected { .. }
            | Self::CommandSignSuspected => Some("u"),
            Self::AsInAnother { what, .. } => what.column(),
            Self::Unwrapped { column, .. }
            | Self::Jump { column, .. }
            | Self::Spikes { column, .. }
            | Self::ManySpikesSuspected { column, .. }
            | Self::DegreesSuspected { column, .. }
            | Self::ClippedSuspected { column, .. }
            | Self::CountsSuspected { column, .. }
            | Self::RawCountsSuspected { column, .. }
            | Self::FrozenSuspected { column, .. } => Some(*column),
            Self::HangingSuspected => Some("alpha"),
            _ => None,
        }
    }

    /// Whether the recording probably breaks a convention (units, signs, origin), so that a diagnosis of it would blame
    /// physics for a mistake of recording.
    #[must_use]
    pub const fn is_suspicion(&self) -> bool {
        // A scale that is nearly right is offered, and left to the search, which knows the encoders' scales.
        if let Self::CountsSuspected { encoder, taken, .. }
        | Self::EitherCountsSuspected {
            arm: (encoder, taken),
            ..
        } = self
        {
            return (*encoder / *taken - 1.0).abs() > NEARLY_RIGHT;
        }
        matches!(
            self,
            Self::DegreesSuspected { .. }
                | Self::TimeUnitSuspected { .. }
                | Self::HangingSuspected
                | Self::SignSuspected
                | Self::SwappedSuspected { .. }
                | Self::ClippedSuspected { .. }
                | Self::FrequencySuspected { .. }
                | Self::ScaleSuspected { .. }
                | Self::RawCountsSuspected { .. }
                | Self::CommandUnitSuspected { .. }
                | Self::MotorGainSuspected { .. }
                | Self::LateCommandSuspected { .. }
                | Self::SkewSuspected { .. }
                | Self::AsInAnother { .. }
                | Self::FrozenSuspected { .. }
                | Self::CommandSignSuspected
                | Self::OtherRigSuspected { .. }
                | Self::Jump { .. }
                | Self::ManySpikesSuspected { .. }
        )
    }
}
