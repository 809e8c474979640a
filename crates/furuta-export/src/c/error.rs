//! Why a control system cannot be exported.

use furuta_ctrl::ConfigError;

/// A control system that cannot be written in C.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// The rig cannot have it, in Rust either.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A trajectory to follow.
    #[error(
        "[trajectory] cannot be exported to C: take it out of the controller file, and the swing-up is by energy"
    )]
    Trajectory,
    /// A controller without C code.
    #[error(
        "[controller] kind = \"{kind}\" cannot be exported to C; it can be one of {}: give one of these in the \
         controller file", .known.join(", ")
    )]
    Controller {
        /// What was asked for.
        kind: &'static str,
        /// What there is.
        known: &'static [&'static str],
    },
    /// An estimator without C code.
    #[error(
        "[estimator] kind = \"{kind}\" cannot be exported to C; it can be one of {}: give one of these in the \
         controller file", .known.join(", ")
    )]
    Estimator {
        /// What was asked for.
        kind: &'static str,
        /// What there is.
        known: &'static [&'static str],
    },
    /// An effect that the estimator's model has and the C code does not.
    #[error(
        "the rig file's effect {effect} cannot be exported to C in the model of [estimator] kind = \"{estimator}\": \
         give kind = \"derivative\", which needs no model, or take the effect out of the rig file"
    )]
    EffectInModel {
        /// The effect's id.
        effect: String,
        /// The estimator.
        estimator: &'static str,
    },
    /// An effect that no C code has.
    #[error(
        "the rig file's effect {effect} cannot be exported to C; these can: {}: take it out of the rig file",
        .known.join(", ")
    )]
    Effect {
        /// The effect's id.
        effect: String,
        /// What there is.
        known: &'static [&'static str],
    },
    /// A number that is infinite or not a number.
    #[error(
        "the control system's number {name} is not finite: correct the rig file or the controller file"
    )]
    NotFinite {
        /// Its name.
        name: &'static str,
    },
}
