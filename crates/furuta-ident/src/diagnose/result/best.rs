//! Which model is to be written to a rig file.

use serde::{Deserialize, Serialize};

/// The model that predicts data kept apart best.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Best {
    /// The rig file as given.
    Given,
    /// The rig file with refitted parameters.
    Refitted,
    /// Refitted, with the named effects and, where there is one, the expression.
    #[default]
    Repaired,
}
