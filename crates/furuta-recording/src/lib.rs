//! Recordings of a rotary inverted pendulum: what they hold, how they are read and checked.
//!
//! A recording is a CSV file with a header (columns in any order, `t,u,theta,alpha` required, `#` starts a comment) or
//! an MCAP log of `furuta run`. Nothing about the data is changed silently: each change is a [`Notice`], and what
//! cannot be mended is a [`RecordingError`] that names file, row, column and value.

mod against_rig;
mod between;
mod budget;
mod checks;
mod clipped;
mod command;
mod convention;
mod counts;
mod csv;
mod differences;
mod error;
mod frozen;
mod lines;
mod mcap;
mod mcap_write;
mod notice;
mod regression;
mod select;
mod shown;
mod source;
mod spikes;
mod timing;
mod transcode;
mod trouble;
mod twice;
mod weak;

use std::collections::BTreeMap;
use std::io::{BufRead, Read};
use std::ops::Range;
use std::path::Path;

use furuta_input::{Input, InputError, shown};

pub use against_rig::{against_rig, each_against_rig};
pub use between::Command;
pub use checks::{GAP_FACTOR, IRREGULAR_SHARE, JITTER_TOLERATED, MIN_SEGMENT, UNEVEN_GAP};
pub use error::RecordingError;
pub use furuta_input::Limits;
pub use notice::{Notice, NoticeKind};
pub use select::Excerpt;
pub use transcode::{Format, Transcoded, transcode};
pub use twice::{GivenTwice, each_once};

/// What is read here, for messages.
const WANTED: &str = "a recording";

/// One run of a rig, evenly sampled but for the gaps between its segments; or, where its clock jitters
/// ([`Recording::is_uneven`]), with time stamps that are used as they are.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// The file's name without its folder.
    pub name: String,
    /// Time stamps as recorded, s.
    pub t: Vec<f64>,
    /// Motor command, V; that of sample `k` is held until sample `k + 1`.
    pub u: Vec<f64>,
    /// Arm angle, rad.
    pub theta: Vec<f64>,
    /// Pendulum angle from upright, rad, continuous over turns.
    pub alpha: Vec<f64>,
    /// Arm speed, rad/s, where recorded; not finite where it is not known, as in the last sample of a run that ended
    /// for it.
    pub theta_dot: Option<Vec<f64>>,
    /// Pendulum speed, rad/s, where recorded; likewise.
    pub alpha_dot: Option<Vec<f64>>,
    /// Further columns, kept as they are.
    pub extra: Vec<Column>,
    /// Mean interval between samples, gaps left out, s.
    pub sample_period: f64,
    /// The stretches without a gap, as ranges of samples; one range over everything where there is no gap.
    pub segments: Vec<Range<usize>>,
    /// The rig file's text, where the recording carries it.
    pub rig: Option<String>,
    /// What else the recording says about itself, by key.
    pub metadata: BTreeMap<String, String>,
    /// Comments of a CSV file, without the `#`.
    pub comments: Vec<String>,
}

/// A column that is kept without being understood.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Its name in the header.
    pub name: String,
    /// Its values, one per sample.
    pub values: Values,
}

/// The values of a [`Column`].
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Every field is a number or empty (NaN).
    Numbers(Vec<f64>),
    /// Some field is neither.
    Text(Vec<String>),
}

/// Whether a pendulum with these angles (rad, 0 upright) never comes near upright, so that its motion needs no
/// controller.
///
/// ```
/// use core::f64::consts::PI;
/// assert!(furuta_recording::hangs([PI + 0.4, PI - 0.4]));
/// assert!(!furuta_recording::hangs([PI, 0.1]));
/// ```
#[must_use]
pub fn hangs(alpha: impl IntoIterator<Item = f64>) -> bool {
    use core::f64::consts::{PI, TAU};
    const NEAR_UPRIGHT: f64 = 0.6;
    alpha
        .into_iter()
        .all(|a| ((a + PI).rem_euclid(TAU) - PI).abs() > NEAR_UPRIGHT)
}

impl Recording {
    /// Whether the pendulum hangs all the time: see [`hangs`].
    #[must_use]
    pub fn hangs(&self) -> bool {
        hangs(self.alpha.iter().copied())
    }

    /// Whether its time stamps scatter too much to be taken as evenly spaced within its segments.
    ///
    /// ```
    /// use furuta_recording::Recording;
    /// let sway = |t: f64| [t, 0.0, 0.1 * (3.0 * t).sin(), 3.1];
    /// let jitter = |k: u32| 0.02 * (f64::from(k) + if k % 2 == 0 { 0.0 } else { 0.7 });
    /// let (even, _) = Recording::from_samples("even", (0..200).map(|k| sway(0.02 * f64::from(k))))?;
    /// let (uneven, _) = Recording::from_samples("uneven", (0..200).map(|k| sway(jitter(k))))?;
    /// assert!(!even.is_uneven() && uneven.is_uneven());
    /// # Ok::<(), furuta_recording::RecordingError>(())
    /// ```
    #[must_use]
    pub fn is_uneven(&self) -> bool {
        let far = |pair: &[f64]| match pair {
            [before, after] => {
                (after - before - self.sample_period).abs() > JITTER_TOLERATED * self.sample_period
            }
            _ => false,
        };
        let stretches = self.segments.iter().filter_map(|s| self.t.get(s.clone()));
        stretches.flat_map(|t| t.windows(2)).any(far)
    }

    /// Reads a recording; CSV or MCAP is told by the file's first bytes and its extension. Notices are dropped: see
    /// [`Self::load_with_notices`].
    ///
    /// # Errors
    /// [`RecordingError`] where the file cannot be read, is damaged or breaks a convention.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, RecordingError> {
        Self::load_with_notices(path).map(|(recording, _)| recording)
    }

    /// Reads a recording, with everything that a person should know about it.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn load_with_notices(
        path: impl AsRef<Path>,
    ) -> Result<(Self, Vec<Notice>), RecordingError> {
        let (recording, notices) = Self::salvage(path)?;
        let cut_off = notices.iter().find_map(|notice| match &notice.kind {
            NoticeKind::CutOff { what } => Some(RecordingError::CutOff {
                file: notice.file.clone(),
                what: what.clone(),
            }),
            _ => None,
        });
        cut_off.map_or(Ok((recording, notices)), Err)
    }

    /// As [`Self::load_with_notices`], but a log that was cut off or damaged gives what was read before that place,
    /// with [`NoticeKind::CutOff`].
    ///
    /// # Errors
    /// As [`Self::load`], but for [`RecordingError::CutOff`].
    pub fn salvage(path: impl AsRef<Path>) -> Result<(Self, Vec<Notice>), RecordingError> {
        Self::salvage_within(path, &Limits::default())
    }

    /// As [`Self::salvage`], with other limits of what is read.
    ///
    /// # Errors
    /// As [`Self::salvage`].
    pub fn salvage_within(
        path: impl AsRef<Path>,
        limits: &Limits,
    ) -> Result<(Self, Vec<Notice>), RecordingError> {
        let path = path.as_ref();
        let file = shown(path);
        let opened = open(path, limits)?;
        let mut input = opened.buffered();
        let start = input.fill_buf().map_err(|e| lines::failed(&file, e))?;
        if mcap::is_mcap(start) || named_mcap(path) && !start.is_empty() {
            Self::read_mcap(&file, input, limits)
        } else {
            Self::read_csv(&file, input, limits)
        }
    }

    /// Reads a recording from the bytes of a CSV file called `file`.
    ///
    /// ```
    /// use furuta_recording::Recording;
    /// let mut csv = String::from("# bench 2, Tuesday\nalpha,t,u,theta,current\n");
    /// for k in 0..100 {
    ///     let t = 0.004 * f64::from(k);
    ///     csv += &format!("{},{t},{},0.0,0.1\n", 3.14 + 0.1 * t, (9.0 * t).sin());
    /// }
    /// let (recording, notices) = Recording::from_csv("swing.csv", csv.as_bytes())?;
    /// assert_eq!((recording.len(), recording.extra[0].name.as_str()), (100, "current"));
    /// assert!((recording.sample_period - 0.004).abs() < 1e-12);
    /// assert_eq!(notices.len(), 1); // it is short
    ///
    /// let error = Recording::from_csv("swing.csv", b"t,u,theta\n0,0,0\n").unwrap_err();
    /// assert!(error.to_string().starts_with("swing.csv: no column `alpha`; found t, u, theta"));
    /// # Ok::<(), furuta_recording::RecordingError>(())
    /// ```
    ///
    /// # Errors
    /// As [`Self::load`], but for the file system's.
    pub fn from_csv(file: &str, bytes: &[u8]) -> Result<(Self, Vec<Notice>), RecordingError> {
        Self::read_csv(file, bytes, &Limits::default())
    }

    /// A recording of samples `[t, u, theta, alpha]` (s, V, rad, rad; alpha 0 upright, pi hanging) called `name`, with
    /// the checks that a file meets. Rows in messages are samples, counted from 1.
    ///
    /// ```
    /// use furuta_recording::Recording;
    /// let swing = (0..1000).map(|k| {
    ///     let t = 0.004 * f64::from(k);
    ///     [t, (9.0 * t).sin(), 0.0, 3.14 + 0.1 * (7.0 * t).sin()]
    /// });
    /// let (recording, notices) = Recording::from_samples("swing", swing)?;
    /// assert_eq!((recording.len(), notices.len()), (1000, 0));
    /// assert!((recording.sample_period - 0.004).abs() < 1e-12);
    ///
    /// let error = Recording::from_samples("swing", [[0.0, 0.0, f64::NAN, 3.14]]).unwrap_err();
    /// assert!(error.to_string().starts_with("swing: row 1, column theta: the value is NaN"));
    /// # Ok::<(), furuta_recording::RecordingError>(())
    /// ```
    ///
    /// # Errors
    /// As [`Self::from_csv`], but for those of the text.
    pub fn from_samples(
        name: &str,
        samples: impl IntoIterator<Item = [f64; 4]>,
    ) -> Result<(Self, Vec<Notice>), RecordingError> {
        let mut columns: [Vec<f64>; 4] = Default::default();
        for (k, sample) in samples.into_iter().enumerate() {
            for ((values, value), column) in columns.iter_mut().zip(sample).zip(csv::REQUIRED) {
                if !value.is_finite() {
                    return Err(RecordingError::NotFinite {
                        file: name.into(),
                        row: k + 1,
                        column: column.into(),
                        value,
                    });
                }
                values.push(value);
            }
        }
        let [t, u, theta, alpha] = columns;
        checks::check(Table {
            file: name.into(),
            rows: (1..=t.len()).collect(),
            t,
            u,
            theta,
            alpha,
            theta_dot: None,
            alpha_dot: None,
            extra: Vec::new(),
            rig: None,
            metadata: BTreeMap::new(),
            comments: Vec::new(),
        })
    }

    fn read_csv(
        file: &str,
        input: impl BufRead,
        limits: &Limits,
    ) -> Result<(Self, Vec<Notice>), RecordingError> {
        let (table, _) = csv::parse(file, input, limits, usize::MAX)?;
        checks::check(table)
    }

    /// Reads a recording from the bytes of an MCAP log called `file`; one that is cut off gives what is there, as
    /// [`Self::salvage`] does.
    ///
    /// # Errors
    /// As [`Self::salvage`], but for the file system's.
    pub fn from_mcap(file: &str, bytes: &[u8]) -> Result<(Self, Vec<Notice>), RecordingError> {
        Self::read_mcap(file, bytes, &Limits::default())
    }

    fn read_mcap(
        file: &str,
        input: impl Read,
        limits: &Limits,
    ) -> Result<(Self, Vec<Notice>), RecordingError> {
        let (table, cut_off) = mcap::parse(file, input, limits, usize::MAX)?;
        if let (Some(NoticeKind::CutOff { what }), true) = (&cut_off, table.t.is_empty()) {
            let reason = format!("{what}; there is nothing to save: record it again");
            return Err(RecordingError::Log {
                file: file.into(),
                reason,
            });
        }
        let (recording, notices) = checks::check(table)?;
        let cut_off = cut_off.map(|kind| Notice {
            file: file.into(),
            kind,
        });
        Ok((recording, cut_off.into_iter().chain(notices).collect()))
    }

    /// Names of the columns that the recording has, further ones last.
    #[must_use]
    pub fn column_names(&self) -> Vec<&str> {
        let speeds = [
            ("theta_dot", &self.theta_dot),
            ("alpha_dot", &self.alpha_dot),
        ];
        let speeds = speeds
            .into_iter()
            .filter_map(|(name, values)| values.as_ref().map(|_| name));
        let further = self.extra.iter().map(|column| column.name.as_str());
        ["t", "u", "theta", "alpha"]
            .into_iter()
            .chain(speeds)
            .chain(further)
            .collect()
    }

    /// Number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.t.len()
    }

    /// Whether there are no samples (never so for a recording that was loaded).
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.t.is_empty()
    }

    /// From the first to the last sample, s, gaps included.
    #[must_use]
    pub fn duration(&self) -> f64 {
        match (self.t.first(), self.t.last()) {
            (Some(first), Some(last)) => last - first,
            _ => 0.0,
        }
    }

    /// The recording cut at its gaps: each part is evenly sampled throughout. One without gaps is returned as it is;
    /// the parts of another are named `name[1]`, `name[2]`, ...
    #[must_use]
    pub fn continuous_parts(&self) -> Vec<Self> {
        if let [only] = self.segments.as_slice()
            && *only == (0..self.len())
        {
            return vec![self.clone()];
        }
        self.segments
            .iter()
            .enumerate()
            .map(|(i, range)| {
                let mut part = self.part(range.clone());
                part.name = format!("{}[{}]", self.name, i + 1);
                part
            })
            .collect()
    }

    fn part(&self, range: Range<usize>) -> Self {
        let cut = |values: &Vec<f64>| values.get(range.clone()).unwrap_or_default().to_vec();
        let extra = self.extra.iter().map(|column| Column {
            name: column.name.clone(),
            values: match &column.values {
                Values::Numbers(values) => Values::Numbers(cut(values)),
                Values::Text(values) => {
                    Values::Text(values.get(range.clone()).unwrap_or_default().to_vec())
                }
            },
        });
        Self {
            name: self.name.clone(),
            t: cut(&self.t),
            u: cut(&self.u),
            theta: cut(&self.theta),
            alpha: cut(&self.alpha),
            theta_dot: self.theta_dot.as_ref().map(cut),
            alpha_dot: self.alpha_dot.as_ref().map(cut),
            extra: extra.collect(),
            sample_period: self.sample_period,
            segments: core::iter::once(0..range.len()).collect(),
            rig: self.rig.clone(),
            metadata: self.metadata.clone(),
            comments: self.comments.clone(),
        }
    }
}

fn open(path: &Path, limits: &Limits) -> Result<Input, RecordingError> {
    Input::open(path, WANTED, limits.file).map_err(|error| match error {
        InputError::Io { path, source } => RecordingError::Io { path, source },
        other => other.into(),
    })
}

fn named_mcap(path: &Path) -> bool {
    let extension = path.extension();
    extension.is_some_and(|extension| extension.eq_ignore_ascii_case("mcap"))
}

/// A table as read, before any check of what its numbers mean. Rows and columns are complete.
struct Table {
    /// The path as given, for messages.
    file: String,
    t: Vec<f64>,
    u: Vec<f64>,
    theta: Vec<f64>,
    alpha: Vec<f64>,
    theta_dot: Option<Vec<f64>>,
    alpha_dot: Option<Vec<f64>>,
    extra: Vec<Column>,
    /// Row number of each sample, for messages.
    rows: Vec<usize>,
    rig: Option<String>,
    metadata: BTreeMap<String, String>,
    comments: Vec<String>,
}
