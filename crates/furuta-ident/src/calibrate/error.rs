//! Why recordings cannot carry a calibration.

use crate::insufficient::Insufficient;

/// Why recordings cannot carry a calibration, or a wish cannot be fulfilled.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrateError {
    /// The recordings are too few, too short or too quiet.
    #[error(transparent)]
    Insufficient(#[from] Insufficient),
    /// A key that the rig file does not have, or that cannot be fitted.
    #[error("`{key}` cannot be calibrated; of this rig these can: {known}")]
    UnknownParameter {
        /// As it was given.
        key: String,
        /// The keys, separated by commas.
        known: String,
    },
    /// A parameter is to be fitted and to be held.
    #[error("`{key}` is both to be fitted and to be held: leave it out of one of them")]
    FreeAndHeld {
        /// The key.
        key: String,
    },
    /// The recordings determine none of the parameters asked for.
    #[error(
        "these recordings determine none of {keys}: {reason}; `furuta identify plan --rig RIG` proposes recordings \
         that would"
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
        "no parameters make the model follow these recordings: it is off by {chi:.0} times the encoders' noise over \
         {horizon} s; check that rig file and recordings belong together, then ask `furuta diagnose` what the model \
         lacks"
    )]
    DoesNotFollow {
        /// Root mean square of the residuals over the noise.
        chi: f64,
        /// Length of a prediction, s.
        horizon: f64,
    },
    /// Whoever listened wanted no more.
    #[error("stopped before \"{stage}\": nothing was fitted; calibrate again to go on")]
    Stopped {
        /// What would have begun.
        stage: &'static str,
    },
}
