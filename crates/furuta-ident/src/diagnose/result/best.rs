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

/// A larger model is taken where its error is no more than this share above the least: errors on data kept apart are
/// known to some per cent.
const ALIKE: f64 = 0.02;

impl Best {
    /// From the logarithms of the mean squared errors on data kept apart: as given, refitted, repaired.
    pub(crate) fn of([given, refitted, repaired]: [f64; 3]) -> Self {
        let least = given.min(refitted).min(repaired);
        let alike = |level: f64| level.is_nan() || level <= least + ALIKE;
        if alike(repaired) {
            Self::Repaired
        } else if alike(refitted) {
            Self::Refitted
        } else {
            Self::Given
        }
    }

    /// What is to be said where it is not the repaired model.
    #[must_use]
    pub const fn sentence(self) -> Option<&'static str> {
        match self {
            Self::Given => Some(
                "On data kept apart the rig file as given predicts best: it is what a repaired rig file holds. Closed loops hide what they suppress: record the arm hanging, with a test signal.",
            ),
            Self::Refitted => Some(
                "On data kept apart the rig file with refitted parameters predicts best: it is what a repaired rig file holds, without the effects.",
            ),
            Self::Repaired => None,
        }
    }
}
