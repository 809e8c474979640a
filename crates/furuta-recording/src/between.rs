//! What the command does between two rows.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use super::{MIN_SEGMENT, Recording, RecordingError};

/// What the command does from one row of a recording to the next.
///
/// ```
/// use furuta_recording::Command;
/// assert_eq!("smooth".parse(), Ok(Command::Smooth));
/// assert_eq!(Command::default().to_string(), "held");
/// let error = "cubic".parse::<Command>().unwrap_err();
/// assert_eq!(error, "`cubic` is neither held nor smooth");
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Command {
    /// It is held: there is a row for each step of the controller.
    #[default]
    Held,
    /// It changes smoothly: the recording keeps every N-th row of a faster controller.
    Smooth,
}

impl Command {
    /// Both, in the order of their declaration.
    pub const ALL: [Self; 2] = [Self::Held, Self::Smooth];
}

impl fmt::Display for Command {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Held => "held",
            Self::Smooth => "smooth",
        })
    }
}

impl FromStr for Command {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        let named = Self::ALL.into_iter().find(|c| c.to_string() == word);
        named.ok_or_else(|| format!("`{word}` is neither held nor smooth"))
    }
}

/// A change from row to row that is off a smooth course by this many times the lower quartile is a jump: of changes
/// that scatter as noise does, one in ten million is (5.4 standard deviations; the quartile is 0.32 of one).
const JUMP: f64 = 17.0;
/// And by this share of the largest command: at rest and on ramps the quartile is rounding.
const SEEN: f64 = 0.01;

impl Recording {
    /// The recording of a command that changes smoothly from row to row: the command that is held becomes one that
    /// takes a free mass to the same places. At rows that are `h` apart, these have the second differences
    /// `h² (u + h² u''/12)` under `u`, and `h² (w[k] + w[k-1])/2` under a held command `w`. Up to a share of
    /// `(ω h)⁴/27` of a sine, `w[k] = (7 u[k] + 7 u[k+1] - u[k-1] - u[k+2])/12` gives the same.
    ///
    /// Where the command jumps, the moment between the two rows is not known: the recording gets a gap there. Next to a
    /// gap the command goes on in a straight line.
    ///
    /// ```
    /// use furuta_recording::Recording;
    /// let at = |t: f64| [t, if t < 1.0 { (3.0 * t).sin() } else { 5.0 }, 0.1 * t, 3.1];
    /// let (written, _) = Recording::from_samples("log", (0..200).map(|k| at(0.01 * f64::from(k))))?;
    /// let read = written.smooth_command()?;
    /// let u = &written.u;
    /// assert!((read.u[7] - (7.0 * (u[7] + u[8]) - u[6] - u[9]) / 12.0).abs() < 1e-12);
    /// assert_eq!(read.segments, [0..100, 100..200]);
    /// # Ok::<(), furuta_recording::RecordingError>(())
    /// ```
    ///
    /// # Errors
    /// [`RecordingError::Selection`]: the command jumps so often that no stretch without a jump is long enough.
    pub fn smooth_command(&self) -> Result<Self, RecordingError> {
        let largest = self.u.iter().fold(0.0, |m: f64, u| m.max(u.abs()));
        let off: Vec<Vec<f64>> = self.segments.iter().map(|s| self.off_course(s)).collect();
        let mut sorted = off.concat();
        sorted.sort_by(f64::total_cmp);
        let quartile = sorted.get(sorted.len() / 4).copied().unwrap_or_default();
        let most = (JUMP * quartile).max(SEEN * largest);
        let mut segments = Vec::new();
        for (segment, off) in self.segments.iter().zip(&off) {
            let at = |k: usize| off.get(k).copied().unwrap_or_default();
            let is_jump = |k: &usize| {
                let beside = k.checked_sub(1).map_or(0.0, at).max(at(k + 1));
                at(*k) > most && at(*k) >= beside
            };
            let mut start = segment.start;
            for jump in (0..off.len()).filter(is_jump) {
                segments.push(start..segment.start + jump + 1);
                start = segment.start + jump + 1;
            }
            segments.push(start..segment.end);
        }
        segments.retain(|s| s.len() >= MIN_SEGMENT);
        if segments.is_empty() {
            let problem = format!(
                "the command jumps so often that nowhere {MIN_SEGMENT} rows are without a jump: what it does between \
                 rows is not known; record every row"
            );
            return Err(RecordingError::Selection {
                file: self.name.clone(),
                problem,
            });
        }
        let mut read = self.clone();
        for segment in &segments {
            let rows = self.u.get(segment.clone()).unwrap_or_default();
            let held = read.u.get_mut(segment.clone()).unwrap_or_default();
            for (k, (held, pair)) in held.iter_mut().zip(rows.windows(2)).enumerate() {
                let change = pair[1] - pair[0];
                let before = k.checked_sub(1).and_then(|k| rows.get(k));
                let beside = before.map_or(pair[0] - change, |u| *u)
                    + rows.get(k + 2).map_or(pair[1] + change, |u| *u);
                *held = (7.0 * (pair[0] + pair[1]) - beside) / 12.0;
            }
        }
        read.segments = segments;
        Ok(read)
    }

    /// By how much each change of the command within a segment is off the mean of the changes before and after it; of
    /// the first and the last that is not known, and 0.
    fn off_course(&self, segment: &Range<usize>) -> Vec<f64> {
        let rows = self.u.get(segment.clone()).unwrap_or_default();
        let mut off = vec![0.0; rows.len().saturating_sub(1)];
        for (off, u) in off.iter_mut().skip(1).zip(rows.windows(4)) {
            *off = ((u[2] - u[1]) - ((u[1] - u[0]) + (u[3] - u[2])) / 2.0).abs();
        }
        off
    }
}
