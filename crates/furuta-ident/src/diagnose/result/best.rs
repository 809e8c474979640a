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

impl Best {
    /// What is to be said where it is not the repaired model.
    #[must_use]
    pub const fn sentence(self) -> Option<&'static str> {
        match self {
            Self::Given => Some(
                "On data kept apart the rig file as given predicts best: it is what a repaired rig file holds. If the \
                 pendulum was balanced, the controller hid what it suppresses: record it hanging, with a test signal.",
            ),
            Self::Refitted => Some(
                "On data kept apart the rig file with refitted parameters predicts best: it is what a repaired rig \
                 file holds, without the effects.",
            ),
            Self::Repaired => None,
        }
    }
}
