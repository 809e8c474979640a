//! A stretch of one recording in which something else happened.

use serde::{Deserialize, Serialize};

use super::Verdict;

/// A stretch of one recording that what explains all else is far from: a motor that was cut off, a hand. It is left out
/// of everything else that is said.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeftOut {
    /// Name of the recording.
    pub run: String,
    /// From where to where, s of its time stamps.
    pub from: f64,
    /// The end, s.
    pub to: f64,
    /// What is said of the rest.
    pub rest: Verdict,
}

impl LeftOut {
    /// `From 7.02 to 9.99 s of run-0.csv something happened that the rest of the recordings does not have`, with what it
    /// may be: the beginning of a sentence that what is said of the rest ends.
    #[must_use]
    pub fn sentence(&self) -> String {
        format!(
            "From {:.2} to {:.2} s of {} something happened that the rest of the recordings does not have, as where a \
             motor is cut off or a hand holds the rig; without that stretch:",
            self.from, self.to, self.run
        )
    }
}
