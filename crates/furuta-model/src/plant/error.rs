//! Why a plant cannot be built or stepped as asked.

use super::{MAX_DELAY_SAMPLES, MAX_EFFECTS, MAX_OWN_STATES, MAX_SUBSTEPS};
use crate::effects::EffectError;
use crate::params::ParamError;

/// Why a plant cannot be built or stepped as asked.
#[derive(Copy, Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum PlantError {
    /// A parameter outside its range.
    Parameter(ParamError),
    /// An effect's value outside its range.
    Effect(EffectError),
    /// More effects than a plant can hold.
    TooManyEffects {
        /// How many were asked for.
        given: usize,
    },
    /// More users' own laws with a state than a plant can hold.
    TooManyStates {
        /// How many were asked for.
        given: usize,
    },
    /// Two effects that remember the arm's way ([`crate::effects::Acts::MEMORY`]).
    TwoMemories {
        /// Which.
        effects: [&'static str; 2],
    },
    /// A delay longer than the plant remembers at this sample period.
    DelayTooLong {
        /// The delay, s.
        delay: f64,
        /// The longest possible one, s.
        longest: f64,
    },
    /// A coupling so stiff that it rings many times within a sample period.
    CouplingTooStiff {
        /// Its own frequency, rad/s.
        frequency: f64,
        /// The highest possible one, rad/s.
        highest: f64,
    },
    /// A sample period that is not a positive number of at most a second.
    SamplePeriod {
        /// What was asked for, s.
        period: f64,
    },
    /// Events within a step in a scalar that holds several numbers at once.
    EventsInLanes,
}

impl core::fmt::Display for PlantError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Parameter(e) => write!(f, "{e}"),
            Self::Effect(e) => write!(f, "{e}"),
            Self::TooManyEffects { given } => {
                write!(
                    f,
                    "{given} effects on one plant: at most {MAX_EFFECTS} are possible"
                )
            }
            Self::TooManyStates { given } => write!(
                f,
                "{given} laws of the user's own with a state on one plant: at most {MAX_OWN_STATES} are possible"
            ),
            Self::TwoMemories { effects: [a, b] } => write!(
                f,
                "{a} and {b} are two laws of one friction that follows the arm's way: a plant can hold one of them"
            ),
            Self::DelayTooLong { delay, longest } => write!(
                f,
                "a delay of {delay} s is longer than the {longest} s ({MAX_DELAY_SAMPLES} samples) the \
                 plant remembers at this sample period: use a longer period"
            ),
            Self::CouplingTooStiff { frequency, highest } => write!(
                f,
                "drive.compliance rings at {frequency} rad/s; at this sample period at most {highest} \
                 rad/s ({MAX_SUBSTEPS} steps a period) can be followed: use a shorter period, or leave \
                 the effect out (so stiff a coupling is rigid)"
            ),
            Self::SamplePeriod { period } => {
                write!(
                    f,
                    "a sample period of {period} s is outside the allowed range (0, 1] s"
                )
            }
            Self::EventsInLanes => write!(
                f,
                "dry friction, backlash, delays and kicks change within a step at another time in each \
                 lane: step such plants one by one"
            ),
        }
    }
}

impl core::error::Error for PlantError {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            Self::Parameter(e) => Some(e),
            Self::Effect(e) => Some(e),
            _ => None,
        }
    }
}

impl From<ParamError> for PlantError {
    fn from(e: ParamError) -> Self {
        Self::Parameter(e)
    }
}

impl From<EffectError> for PlantError {
    fn from(e: EffectError) -> Self {
        Self::Effect(e)
    }
}
