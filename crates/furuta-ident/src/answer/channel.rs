//! The two measured angles.

use serde::{Deserialize, Serialize};

/// One of the two measured angles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Channel {
    /// The arm's angle.
    Theta,
    /// The pendulum's angle, zero upright.
    Alpha,
}

impl Channel {
    /// Both channels, in the order used by every `[_; 2]` of this module.
    pub const ALL: [Self; 2] = [Self::Theta, Self::Alpha];

    /// `theta` or `alpha`.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Theta => "theta",
            Self::Alpha => "alpha",
        }
    }

    /// What turns by this angle, for sentences: `arm` or `pendulum`.
    #[must_use]
    pub const fn part(self) -> &'static str {
        match self {
            Self::Theta => "arm",
            Self::Alpha => "pendulum",
        }
    }
}

impl core::fmt::Display for Channel {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.as_str())
    }
}
