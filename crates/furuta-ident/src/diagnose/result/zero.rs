//! Where a recording's encoders read zero.

use serde::{Deserialize, Serialize};

use crate::answer::null_if_not_finite;

/// From where the zeros of recordings are counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Against {
    /// The first recording's.
    #[default]
    FirstRecording,
    /// That of the rig file, of which an effect says at which angle of the arm it acts.
    RigFile,
}

/// Where a recording's encoders read zero.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Zero {
    /// Name of the recording.
    pub run: String,
    /// From where it is counted.
    #[serde(default)]
    pub against: Against,
    /// By how much the arm's true angle was greater when its encoder read zero, rad; `NaN` where nothing depends on the
    /// arm's absolute angle, so that no recording shows it.
    #[serde(with = "null_if_not_finite")]
    pub theta: f64,
    /// The same of the pendulum, rad.
    #[serde(with = "null_if_not_finite")]
    pub alpha: f64,
}

impl Zero {
    /// `theta's zero: +1.10 rad against the first recording`, where it is known and more than a count.
    #[must_use]
    pub fn sentence(&self) -> Option<String> {
        let against = match self.against {
            Against::FirstRecording => "the first recording",
            Against::RigFile => "the rig file",
        };
        (self.theta.abs() > LEAST_ZERO).then(|| {
            format!(
                "{}: theta's zero: {:+.3} rad against {against}",
                self.run, self.theta
            )
        })
    }
}

/// A zero of theta that is reported, rad: a few counts of a usual encoder.
const LEAST_ZERO: f64 = 0.01;
