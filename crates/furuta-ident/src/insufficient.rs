//! Why recordings cannot carry a diagnosis, a calibration or a validation.

use furuta_model::Rig;

use crate::answer::significant;
use crate::recording::{GivenTwice, Recording, each_once};
use crate::shooting::Data;

/// Why recordings are too few, too short or too quiet to say anything.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Insufficient {
    /// No recording was given.
    #[error("no recording was given: name at least one CSV file or MCAP log")]
    NoRecordings,
    /// A recording is given twice.
    #[error(transparent)]
    Twice(#[from] GivenTwice),
    /// All recordings together are shorter than is needed.
    #[error(
        "the recordings hold {seconds:.2} s in stretches without a gap; at least {needed} s are needed: record longer, \
         or without missing samples"
    )]
    TooShort {
        /// Seconds there are.
        seconds: f64,
        /// Seconds that are needed.
        needed: f64,
    },
    /// The pendulum swings faster than a recording's samples can show.
    #[error(
        "{file} has a sample every {} s, in which the rig file's pendulum swings {} times; at least two samples a \
         swing are needed: check that its time stamps are in seconds, or record one every {} s or faster",
        significant(*period, 3),
        significant(period / swing, 3),
        significant(swing / 2.0, 2)
    )]
    TooCoarse {
        /// The recording.
        file: String,
        /// Its sample period, s.
        period: f64,
        /// Time of one small swing of the hanging pendulum, s.
        swing: f64,
    },
    /// Neither angle moves by more than a few counts.
    #[error(
        "nothing moves: theta spans {theta:.1} counts and alpha {alpha:.1} in all recordings, at least {needed} are \
         needed; check that the motor was on and the encoders connected, or excite more strongly"
    )]
    NothingMoves {
        /// Span of theta, counts.
        theta: f64,
        /// Span of alpha, counts.
        alpha: f64,
        /// Counts that are needed.
        needed: f64,
    },
}

/// The shortest data that carry anything, s.
const SHORTEST: f64 = 2.0;
/// The least motion, counts.
const LEAST_MOTION: f64 = 10.0;

pub(crate) fn check(recordings: &[Recording], rig: &Rig, data: &Data) -> Result<(), Insufficient> {
    if recordings.is_empty() {
        return Err(Insufficient::NoRecordings);
    }
    each_once(recordings)?;
    let c = rig.params.coefficients();
    let swing = core::f64::consts::TAU * (c.pendulum / c.weight).sqrt();
    if let Some(run) = data.runs.iter().find(|r| r.h > swing / 2.0) {
        return Err(Insufficient::TooCoarse {
            file: run.name.clone(),
            period: run.h,
            swing,
        });
    }
    // Folded, since an empty sum of floats is -0.
    let seconds = data
        .runs
        .iter()
        .fold(0.0, |s, r| s + r.y.len() as f64 * r.h);
    if seconds < SHORTEST {
        return Err(Insufficient::TooShort {
            seconds,
            needed: SHORTEST,
        });
    }
    let resolution = rig.sensors.resolution();
    let [theta, alpha] = std::array::from_fn(|c| {
        data.runs
            .iter()
            .map(|r| {
                let (low, high) =
                    r.y.iter()
                        .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), y| {
                            (a.min(y[c]), b.max(y[c]))
                        });
                (high - low) / resolution[c]
            })
            .fold(0.0, f64::max)
    });
    if theta.max(alpha) < LEAST_MOTION {
        return Err(Insufficient::NothingMoves {
            theta,
            alpha,
            needed: LEAST_MOTION,
        });
    }
    Ok(())
}
