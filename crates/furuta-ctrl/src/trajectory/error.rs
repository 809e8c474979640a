//! What is wrong with a trajectory.

use super::{INTERVAL, KNOTS};

/// What is wrong with a trajectory.
#[derive(Copy, Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TrajectoryError {
    /// Too few points, or too many.
    #[error(
        "{given} points: a trajectory has 2 to {}; design it again (furuta design swing-up)",
        KNOTS
    )]
    Count {
        /// How many there are.
        given: usize,
    },
    /// Time between two points.
    #[error("interval = {interval} is outside the allowed range [{}, {}] s", INTERVAL[0], INTERVAL[1])]
    Interval {
        /// What was given, s.
        interval: f64,
    },
    /// A number of a point.
    #[error("point {point}: {name} = {value} is outside the allowed range [-{largest}, {largest}]")]
    Number {
        /// Which point, from 0.
        point: usize,
        /// Which number.
        name: &'static str,
        /// What was given.
        value: f64,
        /// The largest that is allowed, either way.
        largest: f64,
    },
}
