//! A part of a recording: a span of its time, every N-th sample.

use std::ops::Range;

use super::{Command, MIN_SEGMENT, Recording, RecordingError, Values};

/// The part of a recording that is used, for one that is longer than it needs to be.
///
/// ```
/// use furuta_recording::{Command, Excerpt};
/// let excerpt = Excerpt { every: 5, span: Some(2.0..60.0), command: Command::Held };
/// assert_eq!(Excerpt::default().every, 1);
/// assert_ne!(excerpt, Excerpt::default());
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Excerpt {
    /// Every `every`-th sample; 1 for all.
    pub every: usize,
    /// From here to there, s from the first sample; `None` for all.
    pub span: Option<Range<f64>>,
    /// What the command does between two rows.
    pub command: Command,
}

impl Default for Excerpt {
    fn default() -> Self {
        Self {
            every: 1,
            span: None,
            command: Command::Held,
        }
    }
}

impl Recording {
    /// The part of the recording that is selected, its command read as it is to be.
    ///
    /// # Errors
    /// As [`Self::span`], [`Self::smooth_command`] and [`Self::every`].
    pub fn select(self, excerpt: &Excerpt) -> Result<Self, RecordingError> {
        let cut = match &excerpt.span {
            Some(span) => self.span(span.start, span.end)?,
            None => self,
        };
        let read = match excerpt.command {
            Command::Held => cut,
            Command::Smooth => cut.smooth_command()?,
        };
        match excerpt.every {
            1 => Ok(read),
            n => read.every(n),
        }
    }

    /// The samples from `from` to `to`, s from the first sample of the recording. Time stamps stay as they are.
    ///
    /// # Errors
    /// [`RecordingError::Selection`]: no span of time, or too few samples in it.
    pub fn span(&self, from: f64, to: f64) -> Result<Self, RecordingError> {
        let start = self.t.first().copied().unwrap_or(0.0);
        if from.is_nan() || to.is_nan() || from >= to {
            return Err(self.cannot(format!(
                "a span from {} to {} s is none; give A..B with A before B",
                furuta_input::number(from),
                furuta_input::number(to)
            )));
        }
        let first = self.t.partition_point(|t| t - start < from);
        let end = self.t.partition_point(|t| t - start <= to);
        let segments: Vec<Range<usize>> = self
            .segments
            .iter()
            .map(|s| s.start.max(first)..s.end.min(end))
            .filter(|s| s.len() >= MIN_SEGMENT)
            .map(|s| s.start - first..s.end - first)
            .collect();
        if segments.is_empty() {
            return Err(self.cannot(format!(
                "no {MIN_SEGMENT} samples in a row between {} and {} s; the recording lasts {} s",
                furuta_input::number(from),
                furuta_input::number(to),
                furuta_input::number(self.duration())
            )));
        }
        Ok(Self {
            segments,
            ..self.part(first..end)
        })
    }

    /// Every `n`-th sample. A command is held from its sample to the next: that of a sample kept becomes the mean of
    /// the `n` commands up to the next one kept, which turns the motor by as much. Angles, speeds and further columns
    /// are those of the samples kept. A gap is where it was: each stretch between gaps is thinned out by itself.
    ///
    /// # Errors
    /// [`RecordingError::Selection`]: `n` is zero, or leaves too few samples.
    pub fn every(&self, n: usize) -> Result<Self, RecordingError> {
        if n == 0 {
            return Err(self.cannot("every 0th sample is none; give 1 or more".into()));
        }
        let mut kept = Vec::new();
        let mut segments = Vec::new();
        for segment in &self.segments {
            let start = kept.len();
            kept.extend(
                segment
                    .clone()
                    .step_by(n)
                    .map(|k| k..(k + n).min(segment.end)),
            );
            if kept.len() - start < MIN_SEGMENT {
                kept.truncate(start);
            } else {
                segments.push(start..kept.len());
            }
        }
        if segments.is_empty() {
            return Err(self.cannot(format!(
                "every {n}th sample leaves no {MIN_SEGMENT} samples in a row of {}; take more of them",
                self.len()
            )));
        }
        let pick = |values: &Vec<f64>| -> Vec<f64> {
            let value = |held: &Range<usize>| values.get(held.start).copied();
            kept.iter().filter_map(value).collect()
        };
        let mean = |held: &Range<usize>| {
            let commands = self.u.get(held.clone()).unwrap_or_default();
            match commands {
                [first, rest @ ..] if rest.iter().all(|u| u == first) => *first,
                _ => commands.iter().sum::<f64>() / commands.len() as f64,
            }
        };
        let extra = self.extra.iter().map(|column| super::Column {
            name: column.name.clone(),
            values: match &column.values {
                Values::Numbers(values) => Values::Numbers(pick(values)),
                Values::Text(values) => {
                    let value = |held: &Range<usize>| values.get(held.start).cloned();
                    Values::Text(kept.iter().filter_map(value).collect())
                }
            },
        });
        Ok(Self {
            name: self.name.clone(),
            t: pick(&self.t),
            u: kept.iter().map(mean).collect(),
            theta: pick(&self.theta),
            alpha: pick(&self.alpha),
            theta_dot: self.theta_dot.as_ref().map(pick),
            alpha_dot: self.alpha_dot.as_ref().map(pick),
            extra: extra.collect(),
            sample_period: self.sample_period * n as f64,
            segments,
            rig: self.rig.clone(),
            metadata: self.metadata.clone(),
            comments: self.comments.clone(),
        })
    }

    /// The same recording, of which a `share` is used, in stretches of `seconds` that are spread evenly over it, at
    /// least one: what is left out is a gap.
    ///
    /// ```
    /// use furuta_recording::Recording;
    /// let sway = |k: u32| [0.01 * f64::from(k), 0.0, (0.01 * f64::from(k)).sin(), 3.1];
    /// let (minute, _) = Recording::from_samples("minute", (0..6000).map(sway))?;
    /// let third = minute.in_stretches(5.0, 1.0 / 3.0);
    /// assert_eq!(third.segments, [500..1000, 2000..2500, 3500..4000, 5000..5500]);
    /// assert_eq!((third.len(), third.samples_used()), (6000, 2000));
    /// assert_eq!(minute.in_stretches(5.0, 1e-3).samples_used(), 500);
    /// # Ok::<(), furuta_recording::RecordingError>(())
    /// ```
    #[must_use]
    pub fn in_stretches(&self, seconds: f64, share: f64) -> Self {
        let len = ((seconds / self.sample_period).round() as usize).max(MIN_SEGMENT);
        let all: Vec<Range<usize>> = (self.segments.iter())
            .flat_map(|s| {
                let starts = s.clone().step_by(len);
                starts.map(|start| start..(start + len).min(s.end))
            })
            .filter(|stretch| stretch.len() >= MIN_SEGMENT)
            .collect();
        // The shares of all stretches so far, rounded: with each whole one there is one more to use.
        let so_far = |i: usize| (i as f64 * share + 0.5).floor();
        let mut used: Vec<usize> = (0..all.len())
            .filter(|&i| so_far(i + 1) > so_far(i))
            .collect();
        if used.is_empty() {
            used.push(all.len() / 2);
        }
        let mut segments: Vec<Range<usize>> = Vec::new();
        for stretch in used.into_iter().filter_map(|i| all.get(i)) {
            match segments.last_mut() {
                Some(last) if last.end == stretch.start => last.end = stretch.end,
                _ => segments.push(stretch.clone()),
            }
        }
        Self {
            segments,
            ..self.clone()
        }
    }

    /// The same recording, of which what lies from `from` to `to`, s from the first sample, is not used: it is a gap.
    ///
    /// ```
    /// use furuta_recording::Recording;
    /// let sway = |k: u32| [0.01 * f64::from(k), 0.0, (0.01 * f64::from(k)).sin(), 3.1];
    /// let (minute, _) = Recording::from_samples("minute", (0..6000).map(sway))?;
    /// assert_eq!(minute.without(20.005, 30.005).segments, [0..2001, 3001..6000]);
    /// assert_eq!(minute.without(50.0, 70.0).segments, [0..5000]);
    /// # Ok::<(), furuta_recording::RecordingError>(())
    /// ```
    #[must_use]
    pub fn without(&self, from: f64, to: f64) -> Self {
        let start = self.t.first().copied().unwrap_or(0.0);
        let first = self.t.partition_point(|t| t - start < from);
        let end = self.t.partition_point(|t| t - start <= to);
        let parts = |s: &Range<usize>| [s.start..s.end.min(first), s.start.max(end)..s.end];
        let mut segments: Vec<Range<usize>> = self.segments.iter().flat_map(parts).collect();
        segments.retain(|s| s.len() >= MIN_SEGMENT);
        Self {
            segments,
            ..self.clone()
        }
    }

    /// How many samples lie in its segments.
    #[must_use]
    pub fn samples_used(&self) -> usize {
        self.segments.iter().map(Range::len).sum()
    }

    fn cannot(&self, problem: String) -> RecordingError {
        RecordingError::Selection {
            file: self.name.clone(),
            problem,
        }
    }
}
