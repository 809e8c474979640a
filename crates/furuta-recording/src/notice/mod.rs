//! What was noticed about a recording that was nevertheless read.

mod kind;
mod words;

use std::fmt;

use furuta_model::Rig;

pub use kind::NoticeKind;

/// Something about a recording that a person should know: what was changed while reading it, or what looks wrong.
#[derive(Clone, Debug, PartialEq)]
pub struct Notice {
    /// The file.
    pub file: String,
    /// What was noticed.
    pub kind: NoticeKind,
}

impl Notice {
    /// The same with what a rig file knows of it: the factor of counts that were not turned into radians.
    #[must_use]
    pub fn for_rig(mut self, rig: &Rig) -> Self {
        if let NoticeKind::RawCountsSuspected {
            column, per_turn, ..
        } = &mut self.kind
        {
            *per_turn = Some(if *column == "theta" {
                rig.sensors.arm_counts_per_rev
            } else {
                rig.sensors.pendulum_counts_per_rev
            });
        }
        self
    }
}

impl fmt::Display for Notice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.file, self.kind)
    }
}
