//! What is wrong with data for a frequency response, and what merely should be known.

use std::fmt;

use crate::answer::significant;
use crate::recording::GivenTwice;

/// To six significant digits, those that are zero at the end left out.
fn rounded(x: f64) -> f64 {
    format!("{x:.5e}").parse().unwrap_or(x)
}

/// No period is shorter than this many samples.
pub(super) const LEAST_PERIOD: f64 = 8.0;

/// Why there is no frequency response, or no fit of one.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FrequencyError {
    /// No stretch of the data is as long as a segment.
    #[error(
        "a resolution of {resolution:.4} Hz needs {needed:.3} s without a gap, and the longest stretch has \
         {longest:.3} s: ask for a coarser resolution (at least {possible:.4} Hz), or record longer"
    )]
    TooShort {
        /// The distance of lines asked for, Hz.
        resolution: f64,
        /// What it needs, s.
        needed: f64,
        /// What there is, s.
        longest: f64,
        /// The resolution that these data can have, with two segments to average, Hz.
        possible: f64,
    },
    /// One segment alone has no spread: its coherence is 1, whatever the data.
    #[error(
        "only one segment of {seconds:.3} s fits: without an average there is neither coherence nor confidence; ask \
         for a coarser resolution, more overlap, or record longer"
    )]
    OneSegment {
        /// Length of a segment, s.
        seconds: f64,
    },
    /// The input never changes.
    #[error(
        "{signal} is constant at {value}: it excites nothing; drive the rig with a test signal (multisine, noise, \
         chirp, PRBS)"
    )]
    Constant {
        /// Which signal.
        signal: String,
        /// Its value.
        value: f64,
    },
    /// A number that is none.
    #[error("{signal}: sample {sample} is {value}; mend or cut the recording there")]
    NotFinite {
        /// Which signal.
        signal: String,
        /// The sample, from 0.
        sample: usize,
        /// The value.
        value: f64,
    },
    /// Signals that do not belong together.
    #[error("{signal} has {given} samples, the input has {expected}: they must be taken together")]
    Lengths {
        /// Which signal.
        signal: String,
        /// Its samples.
        given: usize,
        /// The input's.
        expected: usize,
    },
    /// A setting outside its range.
    #[error("{name} = {value} is outside the allowed range [{min}, {max}] {unit}")]
    OutOfRange {
        /// The setting.
        name: &'static str,
        /// What was given.
        value: f64,
        /// Lower end.
        min: f64,
        /// Upper end.
        max: f64,
        /// Unit.
        unit: &'static str,
    },
    /// No resolution at this rate.
    #[error("a resolution of {value} Hz must be above 0 and below {} Hz, half the sampling rate", rounded(*highest))]
    Resolution {
        /// What was given, Hz.
        value: f64,
        /// Half the sampling rate, Hz.
        highest: f64,
    },
    /// The samples of a recording are not evenly spaced.
    #[error(
        "{file}: its time stamps scatter too much for a frequency response, which needs a fixed rate: record at one"
    )]
    Uneven {
        /// The recording.
        file: String,
    },
    /// A recording is given twice.
    #[error(transparent)]
    Twice(#[from] GivenTwice),
    /// The input and the output are one column.
    #[error("`{column}` is both input and output: name the column that answers the other")]
    OneColumn {
        /// The column.
        column: String,
    },
    /// Recordings at different rates cannot be averaged.
    #[error(
        "{second} was recorded at {} Hz and {first} at {} Hz: give recordings of one sampling rate",
        significant(1.0 / given, 4),
        significant(1.0 / expected, 4)
    )]
    Rates {
        /// The first recording.
        first: String,
        /// The other one.
        second: String,
        /// Its sample period, s.
        given: f64,
        /// The first one's, s.
        expected: f64,
    },
    /// A column that the recording does not have.
    #[error("{file} has no column of numbers `{column}`; it has {found}{hint}")]
    NoColumn {
        /// The recording.
        file: String,
        /// The column asked for.
        column: String,
        /// Those that are there.
        found: String,
        /// What could be done; empty or starting with `; `.
        hint: &'static str,
    },
    /// No recording at all.
    #[error("no recording was given: name at least one CSV file or MCAP log")]
    NoData,
    /// A period that is no whole number of samples.
    #[error(
        "a period of {period} s is {samples:.3} samples of {} s: it must be a whole number of at least {}; give \
         the period that `furuta run` printed",
        rounded(*sample_period),
        LEAST_PERIOD
    )]
    PeriodNotWhole {
        /// The period, s.
        period: f64,
        /// The same in samples.
        samples: f64,
        /// The sample period, s.
        sample_period: f64,
    },
    /// Not enough periods.
    #[error(
        "whole periods of {period} s in the data after the first {discarded}: {found}; at least 2 are needed to know \
         their spread: record longer, or give the right period"
    )]
    TooFewPeriods {
        /// Periods that remain.
        found: usize,
        /// The period, s.
        period: f64,
        /// Periods left out at the start.
        discarded: usize,
    },
    /// The input does not repeat.
    #[error(
        "the input does not repeat after {period} s: {percent:.1} % of its power differs from period to period; give \
         the right period, or leave it out to average over windows"
    )]
    NotPeriodic {
        /// The period, s.
        period: f64,
        /// Share of the power that differs, %.
        percent: f64,
    },
    /// The input excites no line of the band, as a single sine does.
    #[error(
        "the input excites no line between {low} and {high} Hz together with its neighbours within {resolution:.4} Hz, \
         as noise and sums of sines do; averaged spectra (the estimator h1) answer at single lines"
    )]
    NotExcited {
        /// Hz.
        low: f64,
        /// Hz.
        high: f64,
        /// Hz.
        resolution: f64,
    },
    /// Nothing of the response lies in the band asked for.
    #[error(
        "no line lies between {low} and {high} Hz: lines are {resolution:.4} Hz apart up to {highest:.3} Hz"
    )]
    EmptyBand {
        /// Lower end, Hz.
        low: f64,
        /// Upper end, Hz.
        high: f64,
        /// Distance of lines, Hz.
        resolution: f64,
        /// The highest line, Hz.
        highest: f64,
    },
}

/// Something about a response that a person should know.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum FrequencyNotice {
    /// The recording has gaps; no segment runs across one.
    Gaps {
        /// How many stretches there are.
        stretches: usize,
        /// Those too short for a segment.
        unused: usize,
    },
    /// Few averages: coherence is high by chance alone.
    FewAverages {
        /// Independent averages.
        averages: f64,
        /// The coherence that two unrelated signals reach in one of twenty cases.
        by_chance: f64,
    },
    /// The output moves near half the sampling rate: what is faster may have folded down.
    AliasingSuspected {
        /// Share of its power in the last fifth of the band.
        share: f64,
        /// Half the sampling rate, Hz.
        nyquist: f64,
    },
    /// Much of the band has no coherence.
    LowCoherence {
        /// Share of lines below one half.
        share: f64,
    },
    /// The input has power at few of the lines.
    FewLines {
        /// How many there are.
        lines: usize,
    },
    /// The coherence ends before the band does; a fit stops there.
    CoherenceEnds {
        /// The last coherent line, Hz.
        at: f64,
        /// What two unrelated signals reach in one of twenty cases.
        by_chance: f64,
        /// Lines beyond it.
        left_out: usize,
    },
    /// How much of what repeats is nonlinear distortion, by the harmonics that nothing excites.
    Distortion {
        /// Whether odd distortion stands out from the noise, at 95 %.
        detected: bool,
        /// Power of the odd one, per harmonic and referred to the input, over that of an excited harmonic.
        odd: f64,
        /// The same of the even one.
        even: f64,
        /// The same of the noise, in the mean of the periods.
        noise: f64,
    },
    /// Feedback is at work: H1 and H2 are wrong then.
    FeedbackSuspected {
        /// The mode in which the recording was made.
        mode: String,
    },
}

impl fmt::Display for FrequencyNotice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Gaps { stretches, unused } => write!(
                f,
                "samples are missing: the recording falls into {stretches} stretches, {unused} of them too short for a \
                 segment; no segment runs across a gap"
            ),
            Self::FewAverages {
                averages,
                by_chance,
            } => write!(
                f,
                "{averages:.1} independent averages: a coherence of {by_chance:.2} comes by chance; record longer or \
                 ask for a coarser resolution"
            ),
            Self::AliasingSuspected { share, nyquist } => write!(
                f,
                "{:.1} % of the output's power lies above {:.1} Hz, near half the sampling rate ({nyquist:.1} Hz): \
                 what is faster may have folded down; sample faster or filter before sampling",
                100.0 * share,
                0.8 * nyquist
            ),
            Self::LowCoherence { share } => write!(
                f,
                "{:.0} % of the lines have a coherence below 0.5: the output there comes from something else (noise, \
                 encoder steps, friction); excite more strongly or narrow the band",
                100.0 * share
            ),
            Self::FewLines { lines } => write!(
                f,
                "{lines} lines only: the input has power at no others of this resolution; a signal that repeats has \
                 lines of its own: say after which time (period), or ask for a finer resolution"
            ),
            Self::CoherenceEnds {
                at,
                by_chance,
                left_out,
            } => write!(
                f,
                "the coherence ends at {at:.3} Hz: the {left_out} lines beyond it, whose coherence is no higher than \
                 chance makes it ({by_chance:.2}), are left out of the fit; a band of your own puts them back"
            ),
            Self::Distortion {
                detected,
                odd,
                even,
                noise,
            } => {
                let db = |share: &f64| 10.0 * share.log10();
                write!(
                    f,
                    "by the harmonics that nothing excites, referred to the input: odd distortion {:.1} dB, even {:.1} \
                     dB, noise {:.1} dB below an excited harmonic; ",
                    -db(odd),
                    -db(even),
                    -db(noise)
                )?;
                f.write_str(if *detected {
                    "the odd one is beyond the noise, so the response depends on the amplitude: deviations are widened \
                     by it; excite less strongly for the linear response"
                } else {
                    "no odd distortion is beyond the noise: the response is linear as far as these data tell"
                })
            }
            Self::FeedbackSuspected { mode } => write!(
                f,
                "the recording was made under feedback (mode {mode}): H1 and H2 are biased then; give --reference \
                 COLUMN, the excitation that the controller did not choose"
            ),
        }
    }
}
