//! Where the arm is to be while the pendulum is balanced.

use std::fmt;

use furuta_model::signals::Noise;
use serde::{Deserialize, Serialize};

/// Arm angle asked for, over time.
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Reference {
    /// Always the same (rad).
    Constant(f64),
    /// Steps between `+amplitude` and `-amplitude`, after one period at 0: the arm keeps moving, so that the recording
    /// shows friction, springs and whatever else acts on it.
    Steps {
        /// Height (rad).
        amplitude: f64,
        /// Time between steps (s).
        hold: f64,
    },
    /// Band-limited noise, its volts taken as radians: the excitation that a frequency response upright is measured
    /// with. The log's column `reference` holds it, which the joint input-output method asks for.
    Noise(Noise),
}

impl Reference {
    /// Arm angle asked for at time `t` (s) since balancing began (rad).
    ///
    /// ```
    /// use furuta_hw::Reference;
    /// let steps = Reference::Steps { amplitude: 0.2, hold: 2.0 };
    /// assert_eq!([1.0, 3.0, 5.0, 7.0].map(|t| steps.at(t)), [0.0, 0.2, -0.2, 0.2]);
    /// ```
    #[must_use]
    pub fn at(&self, t: f64) -> f64 {
        match *self {
            Self::Noise(noise) => noise.volts(t),
            Self::Constant(angle) => angle,
            Self::Steps { amplitude, hold } => {
                let step = (t.max(0.0) / hold) as u64; // saturates: any t is fine
                match (step, step % 2) {
                    (0, _) => 0.0,
                    (_, 1) => amplitude,
                    _ => -amplitude,
                }
            }
        }
    }
}

/// In words, with units.
impl fmt::Display for Reference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            // Its own text speaks of volts.
            Self::Noise(noise) => write!(f, "arm after noise up to {} Hz", noise.high()),
            Self::Constant(angle) => write!(f, "arm at {angle} rad"),
            Self::Steps { amplitude, hold } => {
                write!(f, "arm to plus and minus {amplitude} rad every {hold} s")
            }
        }
    }
}
