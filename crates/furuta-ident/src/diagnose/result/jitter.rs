//! Samples that are not taken when their time stamps say.

use serde::{Deserialize, Serialize};

use super::significant;
use crate::answer::null_if_not_finite;

/// How far the moments at which samples are taken scatter about their time stamps, where both angles show it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Jitter {
    /// Standard deviation of the moments, s.
    pub spread: f64,
    /// Standard deviation of that number, s.
    #[serde(with = "null_if_not_finite")]
    pub std: f64,
    /// How far it is from none, in standard deviations.
    pub deviations: f64,
}

impl Jitter {
    /// In a sentence.
    #[must_use]
    pub fn sentence(&self) -> String {
        format!(
            "the samples are not taken when their time stamps say: they scatter by {} ± {} ms (sensor.jitter), for what \
             is left of both angles goes together in proportion to their speeds ({} standard deviations)",
            significant(1e3 * self.spread, 3),
            significant(1e3 * self.std, 2),
            significant(self.deviations, 2)
        )
    }
}
