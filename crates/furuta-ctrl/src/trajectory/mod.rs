//! A swing-up that was computed beforehand: states, commands and gains over time, and what follows them.
//!
//! A [`Trajectory`] holds the states that the rig is to pass, the commands that lead there and, at each of these times,
//! the gain of a time-varying LQR. [`Follower`] tracks it: `u = u(s) - K(s) (x - x(s))`, where the phase `s` is a time
//! that runs a little faster or slower than the clock, as the rig is ahead or behind: a pendulum that is heavier than
//! the model's swings at another pace, and a schedule by the clock alone would be out of step with it.

mod error;
mod follower;

pub use error::TrajectoryError;
pub use follower::{Follower, FollowerState, Progress};

use arrayvec::ArrayVec;

/// The most points of a trajectory.
pub const KNOTS: usize = 128;

/// The version of a trajectory's table in a controller file.
pub const VERSION: i64 = 1;

/// One point of a trajectory; commands are held from it to the next.
#[derive(Copy, Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Knot {
    /// `[theta, alpha, theta_dot, alpha_dot]`, rad, rad/s; `alpha` goes on beyond pi where the pendulum does.
    pub x: [f32; 4],
    /// Command from here to the next point, V; of the last point: what holds the rig there.
    pub u: f32,
    /// Gain, V/rad and V s/rad: `u - gain (x - reference)`.
    pub gain: [f32; 4],
}

impl Knot {
    /// Upright at rest, nothing fed back.
    const REST: Self = Self {
        x: [0.0; 4],
        u: 0.0,
        gain: [0.0; 4],
    };
}

/// What happens where the rig has left the trajectory.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub enum WhenLost {
    /// The energy swing-up brings the pendulum up.
    #[default]
    Energy,
    /// The motor is switched off until everything rests, and stays off: mode stopping.
    Stop,
}

/// A swing-up from hanging to upright, at equidistant times. Single precision: some 4.6 kB, and readings are no finer.
///
/// ```
/// use furuta_ctrl::trajectory::{Knot, Trajectory, TrajectoryError, WhenLost};
/// let at = |alpha| Knot { x: [0.0, alpha, 0.0, 0.0], u: 0.0, gain: [0.0; 4] };
/// let straight = Trajectory::new(0.5, &[at(3.14), at(1.57), at(0.0)], WhenLost::Energy)?;
/// assert_eq!(straight.seconds(), 1.0);
/// let error = Trajectory::new(-0.5, &[at(3.14), at(0.0)], WhenLost::Energy).unwrap_err();
/// assert_eq!(error.to_string(), "interval = -0.5 is outside the allowed range [0.0001, 1] s");
/// # Ok::<(), TrajectoryError>(())
/// ```
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(try_from = "Sent", into = "Sent")]
pub struct Trajectory {
    interval: f64,
    /// An array, and how many of it count: cloned without a path that could panic.
    knots: [Knot; KNOTS],
    count: usize,
    when_lost: WhenLost,
}

/// What goes over a wire, before it is checked.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
struct Sent {
    interval: f64,
    knots: ArrayVec<Knot, KNOTS>,
    when_lost: WhenLost,
}

impl TryFrom<Sent> for Trajectory {
    type Error = TrajectoryError;

    fn try_from(sent: Sent) -> Result<Self, TrajectoryError> {
        Self::new(sent.interval, &sent.knots, sent.when_lost)
    }
}

impl From<Trajectory> for Sent {
    fn from(of: Trajectory) -> Self {
        let mut knots = ArrayVec::new();
        // There is as much room.
        let _ = knots.try_extend_from_slice(of.knots());
        Self {
            interval: of.interval,
            knots,
            when_lost: of.when_lost,
        }
    }
}

/// Shortest and longest time between two points, s.
const INTERVAL: [f64; 2] = [1e-4, 1.0];
/// Largest numbers of a point: angles (rad), speeds (rad/s), commands (V), gains.
const LARGEST: [f32; 4] = [1e3, 1e4, 1e3, 1e6];

impl Trajectory {
    /// Points that are `interval` seconds apart.
    ///
    /// # Errors
    /// Fewer than two or more than [`KNOTS`] points, an interval or a number of a point outside its range.
    pub fn new(
        interval: f64,
        knots: &[Knot],
        when_lost: WhenLost,
    ) -> Result<Self, TrajectoryError> {
        if !(INTERVAL[0]..=INTERVAL[1]).contains(&interval) {
            return Err(TrajectoryError::Interval { interval });
        }
        let count = TrajectoryError::Count { given: knots.len() };
        if knots.len() < 2 {
            return Err(count);
        }
        let mut out = Self {
            interval,
            knots: [Knot::REST; KNOTS],
            count: knots.len(),
            when_lost,
        };
        for (k, knot) in knots.iter().enumerate() {
            let [theta, alpha, theta_dot, alpha_dot] = knot.x;
            let [angle, speed, command, gain] = LARGEST;
            let numbers = [
                ("theta", theta, angle),
                ("alpha", alpha, angle),
                ("theta_dot", theta_dot, speed),
                ("alpha_dot", alpha_dot, speed),
                ("u", knot.u, command),
                ("gain of theta", knot.gain[0], gain),
                ("gain of alpha", knot.gain[1], gain),
                ("gain of theta_dot", knot.gain[2], gain),
                ("gain of alpha_dot", knot.gain[3], gain),
            ];
            for (name, value, largest) in numbers {
                if !(value.abs() <= largest) {
                    return Err(TrajectoryError::Number {
                        point: k,
                        name,
                        value: f64::from(value),
                        largest: f64::from(largest),
                    });
                }
            }
            *out.knots.get_mut(k).ok_or(count)? = *knot;
        }
        Ok(out)
    }

    /// The points.
    #[must_use]
    pub fn knots(&self) -> &[Knot] {
        self.knots.get(..self.count).unwrap_or(&self.knots)
    }

    /// Time between two points, s.
    #[must_use]
    pub fn interval(&self) -> f64 {
        self.interval
    }

    /// From the first point to the last, s.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        #[allow(clippy::cast_precision_loss)] // at most KNOTS
        let intervals = self.count.saturating_sub(1) as f64;
        self.interval * intervals
    }

    /// What happens where the rig has left it.
    #[must_use]
    pub fn when_lost(&self) -> WhenLost {
        self.when_lost
    }

    /// The same with another answer to having lost it.
    #[must_use]
    pub fn or(self, when_lost: WhenLost) -> Self {
        Self { when_lost, ..self }
    }
}
