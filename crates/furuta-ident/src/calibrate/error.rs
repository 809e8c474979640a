//! Why recordings cannot carry a calibration.

use crate::diagnose::data::Data;
use crate::recording::Recording;
use furuta_model::Rig;

/// Why recordings cannot carry a calibration, or a wish cannot be fulfilled.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrateError {
    /// No recording was given.
    #[error("no recording was given: name at least one CSV file or MCAP log")]
    NoRecordings,
    /// All recordings together are shorter than is needed.
    #[error(
        "the recordings hold {seconds:.2} s in stretches without a gap; a calibration needs at least {needed} s: record longer, or without missing samples"
    )]
    TooShort {
        /// Seconds there are.
        seconds: f64,
        /// Seconds that are needed.
        needed: f64,
    },
    /// Neither angle moves by more than a few counts.
    #[error(
        "nothing moves: theta spans {theta:.1} counts and alpha {alpha:.1} in all recordings, at least {needed} are needed; check that the motor was on and the encoders connected, or excite more strongly"
    )]
    NothingMoves {
        /// Span of theta, counts.
        theta: f64,
        /// Span of alpha, counts.
        alpha: f64,
        /// Counts that are needed.
        needed: f64,
    },
    /// A key that the rig file does not have, or that cannot be fitted.
    #[error("`{key}` cannot be calibrated; of this rig these can: {known}")]
    UnknownParameter {
        /// As it was given.
        key: String,
        /// The keys, separated by commas.
        known: String,
    },
    /// The recordings determine none of the parameters asked for.
    #[error(
        "these recordings determine none of {keys}: {reason}; `furuta identify plan --rig RIG` proposes recordings that would"
    )]
    NothingIdentifiable {
        /// The keys asked for.
        keys: String,
        /// Why the first of them is not determined.
        reason: String,
    },
    /// A length or share that makes no sense.
    #[error("{what} = {value} is outside the allowed range [{min}, {max}] {unit}")]
    OutOfRange {
        /// Which option.
        what: &'static str,
        /// What was given.
        value: f64,
        /// Lower end.
        min: f64,
        /// Upper end.
        max: f64,
        /// Unit.
        unit: &'static str,
    },
    /// Whatever the parameters, the model does not come near the recordings.
    #[error(
        "no parameters make the model follow these recordings: it is off by {chi:.0} times the encoders' noise over {horizon} s; check that rig file and recordings belong together, then ask `furuta diagnose` what the model lacks"
    )]
    DoesNotFollow {
        /// Root mean square of the residuals over the noise.
        chi: f64,
        /// Length of a prediction, s.
        horizon: f64,
    },
}

/// The shortest data that carry a calibration, s.
const SHORTEST: f64 = 2.0;
/// The least motion, counts.
const LEAST_MOTION: f64 = 10.0;

pub(crate) fn check(
    recordings: &[Recording],
    rig: &Rig,
    data: &Data,
) -> Result<(), CalibrateError> {
    if recordings.is_empty() {
        return Err(CalibrateError::NoRecordings);
    }
    // Folded, since an empty sum of floats is -0.
    let seconds = data
        .runs
        .iter()
        .fold(0.0, |s, r| s + r.y.len() as f64 * r.h);
    if seconds < SHORTEST {
        return Err(CalibrateError::TooShort {
            seconds,
            needed: SHORTEST,
        });
    }
    let resolution = rig.sensors.resolution();
    let [theta, alpha] = std::array::from_fn(|c| {
        let span = |y: &[[f64; 2]]| {
            let (low, high) = y
                .iter()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), y| {
                    (a.min(y[c]), b.max(y[c]))
                });
            (high - low) / resolution[c]
        };
        data.runs.iter().map(|r| span(&r.y)).fold(0.0, f64::max)
    });
    if theta.max(alpha) < LEAST_MOTION {
        return Err(CalibrateError::NothingMoves {
            theta,
            alpha,
            needed: LEAST_MOTION,
        });
    }
    Ok(())
}
