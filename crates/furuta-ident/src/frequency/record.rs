//! Which columns of which recordings a response is taken from, cut at their gaps.

use super::error::{FrequencyError, FrequencyNotice};
use super::spectra::{Settings, Stretch};
use crate::recording::{Recording, Values, each_once};

/// Signals of one or several recordings of one rig at one rate.
#[derive(Clone, Debug, PartialEq)]
pub struct Taken<'a> {
    /// The stretches without a gap.
    pub stretches: Vec<Stretch<'a>>,
    /// Time between samples, s.
    pub sample_period: f64,
    /// What should be known.
    pub notices: Vec<FrequencyNotice>,
}

/// Columns by name.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Columns<'a> {
    /// The plant's input; usually `u`.
    pub input: &'a str,
    /// Its output: `alpha`, `theta`.
    pub output: &'a str,
    /// In closed loop, the signal that the controller did not choose: `excitation`, `reference`.
    pub external: Option<&'a str>,
}

/// Intervals may differ by so much from recording to recording, relative: clocks differ.
const SAME_RATE: f64 = 1e-3;

impl<'a> Taken<'a> {
    /// The columns of these recordings, stretch by stretch.
    ///
    /// # Errors
    /// No recording, one given twice, a column that one does not have or that is both input and output, different
    /// sampling rates, time stamps that scatter.
    pub fn from_recordings(
        recordings: &'a [Recording],
        columns: Columns<'_>,
    ) -> Result<Self, FrequencyError> {
        let first = recordings.first().ok_or(FrequencyError::NoData)?;
        if columns.input == columns.output {
            return Err(FrequencyError::OneColumn {
                column: columns.input.to_owned(),
            });
        }
        each_once(recordings)?;
        let mut taken = Self {
            stretches: Vec::new(),
            sample_period: first.sample_period,
            notices: Vec::new(),
        };
        for recording in recordings {
            if recording.is_uneven() {
                return Err(FrequencyError::Uneven {
                    file: recording.name.clone(),
                });
            }
            let (given, expected) = (recording.sample_period, first.sample_period);
            if (given / expected - 1.0).abs() > SAME_RATE {
                return Err(FrequencyError::Rates {
                    first: first.name.clone(),
                    second: recording.name.clone(),
                    given,
                    expected,
                });
            }
            let u = column(recording, columns.input)?;
            let y = column(recording, columns.output)?;
            let r = columns
                .external
                .map(|name| column(recording, name))
                .transpose()?;
            let cut = |range: &std::ops::Range<usize>| {
                Some(Stretch {
                    u: u.get(range.clone())?,
                    y: y.get(range.clone())?,
                    r: match r {
                        Some(r) => Some(r.get(range.clone())?),
                        None => None,
                    },
                })
            };
            taken
                .stretches
                .extend(recording.segments.iter().filter_map(cut));
            if columns.external.is_none()
                && let Some(mode) = feedback(recording)
            {
                taken
                    .notices
                    .push(FrequencyNotice::FeedbackSuspected { mode });
            }
        }
        Ok(taken)
    }

    /// Segments a tenth as long as the longest stretch, half overlapping, under Hann's window: some nineteen of them.
    #[must_use]
    pub fn usual_settings(&self) -> Settings {
        let longest = self.stretches.iter().map(|s| s.u.len()).max().unwrap_or(0);
        Settings::new((longest / 10).max(8))
    }
}

/// The mode of a log in which the rig had a say in the command for at least a tenth of the time: a controller chose it,
/// or the arm was pulled to its middle beside a test signal, which alone gives that mode a reference.
fn feedback(recording: &Recording) -> Option<String> {
    let extra = |name: &str| recording.extra.iter().find(|c| c.name == name);
    let Values::Text(modes) = &extra("mode")?.values else {
        return None;
    };
    let pulled = extra("reference").is_some_and(
        |c| matches!(&c.values, Values::Numbers(r) if r.iter().any(|r| r.is_finite() && *r != 0.0)),
    );
    let closed = |m: &&String| match m.as_str() {
        "balance" | "swing-up" => true,
        "excite" => pulled,
        _ => false,
    };
    let first = modes.iter().find(closed)?;
    (10 * modes.iter().filter(closed).count() >= modes.len()).then(|| first.clone())
}

fn column<'a>(recording: &'a Recording, name: &str) -> Result<&'a [f64], FrequencyError> {
    let missing = |hint| FrequencyError::NoColumn {
        file: recording.name.clone(),
        column: name.to_owned(),
        found: recording.column_names().join(", "),
        hint,
    };
    match name {
        "u" => Ok(&recording.u),
        "theta" => Ok(&recording.theta),
        "alpha" => Ok(&recording.alpha),
        "theta_dot" => recording.theta_dot.as_deref().ok_or_else(|| missing("")),
        "alpha_dot" => recording.alpha_dot.as_deref().ok_or_else(|| missing("")),
        _ => match recording.extra.iter().find(|c| c.name == name) {
            Some(c) => match &c.values {
                Values::Numbers(values) => Ok(values),
                Values::Text(_) => Err(missing("; that one holds text")),
            },
            None => Err(missing("")),
        },
    }
}
