//! Tracks a trajectory by its time-varying gain.

use super::{Knot, Trajectory, WhenLost};
use crate::real::{Real, c, command, wrap};
use crate::site::Site;
use furuta_model::State;

/// How far the rig may be from the first point to begin: angles (rad) and speeds over the pendulum's frequency.
const BEGIN: f64 = 0.5;
/// How far it may be from the trajectory before it counts as lost, in the same measure.
const LOST: f64 = 1.2;
/// How quickly the phase follows the rig, of the pendulum's frequency.
const PACE: f64 = 2.0;
/// Largest share by which the phase runs faster or slower than the clock.
const PACE_LIMIT: f64 = 0.5;
/// What an error of the arm weighs against one of the pendulum: the motor moves the arm where it likes.
const ARM: f64 = 0.3;

/// How far a [`Follower`] has come.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Progress {
    /// Nothing has been followed yet.
    Waiting,
    /// The trajectory is being followed.
    Following,
    /// Its end has been passed.
    Over,
    /// The rig did not rest near its first point when the swing-up began.
    Elsewhere,
    /// The rig has left it.
    Lost,
}

/// Memory of a [`Follower`].
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct FollowerState<T> {
    /// Phase, s from the first point.
    phase: T,
    progress: Progress,
}

impl<T: Real> FollowerState<T> {
    /// Before the first sample.
    #[must_use]
    pub fn new() -> Self {
        Self {
            phase: T::ZERO,
            progress: Progress::Waiting,
        }
    }

    /// How far it has come.
    #[must_use]
    pub fn progress(&self) -> Progress {
        self.progress
    }

    /// Phase, s from the first point.
    #[must_use]
    pub fn phase(&self) -> T {
        self.phase
    }
}

impl<T: Real> Default for FollowerState<T> {
    fn default() -> Self {
        Self::new()
    }
}

/// Follows a [`Trajectory`] on one rig.
#[derive(Clone, Debug)]
pub struct Follower<T> {
    trajectory: Trajectory,
    /// Small-angle frequency of the hanging pendulum, rad/s.
    frequency: T,
    command_limit: T,
}

/// A trajectory at one phase.
#[derive(Copy, Clone, Debug, PartialEq)]
struct Point<T> {
    x: State<T>,
    /// Accelerations of arm and pendulum, rad/s^2.
    acceleration: [T; 2],
    u: T,
    gain: [T; 4],
}

impl<T: Real> Follower<T> {
    /// For a rig at this site.
    #[must_use]
    pub fn new(trajectory: Trajectory, site: &Site<'_>) -> Self {
        Self {
            trajectory,
            frequency: T::from_f64(site.frequency()),
            command_limit: T::from_f64(site.command_limit),
        }
    }

    /// What it follows.
    #[must_use]
    pub fn trajectory(&self) -> &Trajectory {
        &self.trajectory
    }

    /// Whether the motor is to be switched off now that nothing is followed any more.
    #[must_use]
    pub fn gives_up(&self, state: &FollowerState<T>) -> bool {
        let ended = matches!(
            state.progress,
            Progress::Over | Progress::Elsewhere | Progress::Lost
        );
        ended && self.trajectory.when_lost() == WhenLost::Stop
    }

    /// The command (V) for the estimated state `x`, `h` seconds after the one before; `None` from where on nothing is
    /// followed any more, which [`FollowerState::progress`] gives the reason of.
    ///
    /// ```
    /// use furuta_ctrl::Site;
    /// use furuta_ctrl::trajectory::{Follower, FollowerState, Knot, Progress, Trajectory, WhenLost};
    /// use furuta_model::{Rig, State};
    /// let rig = Rig::builtin("qube-servo-2").ok_or("no such rig")?;
    /// let at = |alpha| Knot { x: [0.0, alpha, 0.0, 0.0], u: 1.5, gain: [2.0, 0.0, 0.0, 0.0] };
    /// let trajectory = Trajectory::new(0.1, &[at(3.14), at(3.14)], WhenLost::Energy)?;
    /// let follower = Follower::<f64>::new(trajectory, &Site::of(&rig, 0.002));
    /// let mut state = FollowerState::new();
    /// let x = State::new(0.25, 3.14, 0.0, 0.0);
    /// assert!((follower.update(&mut state, &x, 0.002).unwrap() - 1.0).abs() < 1e-6);
    /// let pushed = State::new(4.5, 3.14, 0.0, 0.0);
    /// assert_eq!(follower.update(&mut state, &pushed, 0.002), None);
    /// assert_eq!(state.progress(), Progress::Lost);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn update(&self, state: &mut FollowerState<T>, x: &State<T>, h: T) -> Option<T> {
        match state.progress {
            Progress::Waiting => {
                let error = self.error(x, &self.at(T::ZERO));
                if !(size(error) < c(BEGIN)) {
                    state.progress = Progress::Elsewhere;
                    return None;
                }
                *state = FollowerState {
                    phase: T::ZERO,
                    progress: Progress::Following,
                };
            }
            Progress::Following => state.phase += h * self.pace(x, &self.at(state.phase)),
            Progress::Over | Progress::Elsewhere | Progress::Lost => return None,
        }
        if !(state.phase < T::from_f64(self.trajectory.seconds())) {
            state.progress = Progress::Over;
            return None;
        }
        let point = self.at(state.phase);
        // Written so that a NaN counts as lost.
        if !(size(self.error(x, &point)) < c(LOST)) {
            state.progress = Progress::Lost;
            return None;
        }
        let off = [
            x.theta - point.x.theta,
            wrap(x.alpha - point.x.alpha),
            x.theta_dot - point.x.theta_dot,
            x.alpha_dot - point.x.alpha_dot,
        ];
        let feedback = (0..4).fold(T::ZERO, |sum, i| sum + point.gain[i] * off[i]);
        Some(command(point.u - feedback, self.command_limit))
    }

    /// Distance from a point, all in rad: speeds over the pendulum's frequency, the arm weighing less.
    fn error(&self, x: &State<T>, point: &Point<T>) -> [T; 4] {
        [
            (x.theta - point.x.theta) * c(ARM),
            wrap(x.alpha - point.x.alpha),
            (x.theta_dot - point.x.theta_dot) / self.frequency * c(ARM),
            (x.alpha_dot - point.x.alpha_dot) / self.frequency,
        ]
    }

    /// How fast the phase runs, 1 being the clock: faster where the rig is ahead along the trajectory.
    fn pace(&self, x: &State<T>, point: &Point<T>) -> T {
        let error = self.error(x, point);
        let tangent = [
            point.x.theta_dot * c(ARM),
            point.x.alpha_dot,
            point.acceleration[0] / self.frequency * c(ARM),
            point.acceleration[1] / self.frequency,
        ];
        // What moves less than the pendulum does at its frequency with this amplitude (rad) tells little.
        let floor = c::<T>(0.3) * self.frequency;
        let along = (0..4).fold(T::ZERO, |sum, i| sum + error[i] * tangent[i]);
        let speed = (0..4).fold(floor * floor, |sum, i| sum + tangent[i] * tangent[i]);
        let ahead = c::<T>(PACE) * self.frequency * along / speed;
        let limit = c::<T>(PACE_LIMIT);
        // A NaN is found by what comes next.
        T::ONE + ahead.clamp(-limit, limit)
    }

    /// The trajectory at this phase: angles by cubics that have the speeds of the points, all else linear in between,
    /// the command held.
    fn at(&self, phase: T) -> Point<T> {
        let knots = self.trajectory.knots();
        let h = T::from_f64(self.trajectory.interval());
        let place = (phase / h).value();
        let last = knots.len().saturating_sub(2);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // saturates; a NaN is 0
        let k = (place as usize).min(last);
        // There are two at least.
        let (from, to) = (
            knots.get(k).copied().unwrap_or(Knot::REST),
            knots.get(k + 1).copied().unwrap_or(Knot::REST),
        );
        #[allow(clippy::cast_precision_loss)]
        let s = T::from_f64((place - k as f64).clamp(0.0, 1.0));
        let real = |v: f32| T::from_f64(f64::from(v));
        let linear = |a: f32, b: f32| real(a) + (real(b) - real(a)) * s;
        let cubic = |a: f32, b: f32, slope_a: f32, slope_b: f32| {
            let (a, b) = (real(a), real(b));
            let (p, q) = (real(slope_a) * h, real(slope_b) * h);
            let rise = b - a;
            let (three, two) = (c::<T>(3.0), c::<T>(2.0));
            a + s * (p + s * (three * rise - two * p - q + s * (p + q - two * rise)))
        };
        let slope = |i: usize| (real(to.x[i]) - real(from.x[i])) / h;
        Point {
            x: State::new(
                cubic(from.x[0], to.x[0], from.x[2], to.x[2]),
                cubic(from.x[1], to.x[1], from.x[3], to.x[3]),
                linear(from.x[2], to.x[2]),
                linear(from.x[3], to.x[3]),
            ),
            acceleration: [slope(2), slope(3)],
            u: real(from.u),
            gain: core::array::from_fn(|i| linear(from.gain[i], to.gain[i])),
        }
    }
}

/// The Euclidean length.
fn size<T: Real>(error: [T; 4]) -> T {
    error.iter().fold(T::ZERO, |sum, e| sum + *e * *e).sqrt()
}
