//! References that are known ahead of time.

use crate::real::Real;
use furuta_model::State;

/// A reference that is known for the samples to come: what [`crate::controllers::Controller::update_ahead`] takes.
///
/// It is asked for single samples and carries what it needs by reference: no allocation, no virtual call. A [`State`]
/// is the reference that stays.
///
/// ```
/// use furuta_ctrl::reference::{Ahead, ArmSteps};
/// // At 500 Hz, 0.996 s after the start: the arm is to go to 0.5 rad at 1 s.
/// let steps = ArmSteps { now: 0.996, period: 0.002, steps: &[(0.0, 0.0), (1.0, 0.5)] };
/// assert_eq!((steps.at(0).theta, steps.at(1).theta, steps.at(2).theta), (0.0, 0.0, 0.5));
/// ```
pub trait Ahead<T: Real> {
    /// The reference `samples` from now; 0: now.
    fn at(&self, samples: u32) -> State<T>;
}

impl<T: Real> Ahead<T> for State<T> {
    fn at(&self, _: u32) -> State<T> {
        *self
    }
}

/// An arm that is to step: at each time (s, rising) to an angle (rad), the pendulum upright, all at rest.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct ArmSteps<'a, T> {
    /// Time of the present sample, s.
    pub now: T,
    /// Sample period, s.
    pub period: T,
    /// Times and angles. Before the first time the arm is to be at 0.
    pub steps: &'a [(T, T)],
}

impl<T: Real> Ahead<T> for ArmSteps<'_, T> {
    fn at(&self, samples: u32) -> State<T> {
        // Half a period early: sums of periods miss round times by rounding.
        let ahead = T::from_f64(f64::from(samples) + 0.5);
        let t = self.now + ahead * self.period;
        let mut theta = T::ZERO;
        for (from, angle) in self.steps {
            if *from <= t {
                theta = *angle;
            }
        }
        arm_at(theta)
    }
}

/// A reference now, and a table of the arm's angle at the samples after it, the last of which stays.
///
/// ```
/// use furuta_ctrl::reference::{Ahead, ArmTable};
/// use furuta_model::State;
/// let table = ArmTable { now: State::upright(), next: &[0.0, 0.1, 0.2] };
/// assert_eq!((table.at(0).theta, table.at(2).theta, table.at(9).theta), (0.0, 0.1, 0.2));
/// ```
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct ArmTable<'a, T: Real> {
    /// At the present sample.
    pub now: State<T>,
    /// The arm's angle at those that follow, rad.
    pub next: &'a [T],
}

impl<T: Real> Ahead<T> for ArmTable<'_, T> {
    fn at(&self, samples: u32) -> State<T> {
        let place = usize::try_from(samples).unwrap_or(usize::MAX);
        let known = place.checked_sub(1).and_then(|i| {
            let theta = self.next.get(i).or(self.next.last());
            theta.copied()
        });
        known.map_or(self.now, arm_at)
    }
}

/// An arm that is led from one angle to another by at most `step` (rad) in each sample: how the supervisor leads it.
///
/// ```
/// use furuta_ctrl::reference::{Ahead, Approach};
/// let led = Approach { from: 0.0, to: -0.25, step: 0.1 };
/// assert_eq!((led.at(0).theta, led.at(2).theta, led.at(5).theta), (0.0, -0.2, -0.25));
/// ```
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Approach<T> {
    /// Now, rad.
    pub from: T,
    /// In the end, rad.
    pub to: T,
    /// Largest change in a sample, rad.
    pub step: T,
}

impl<T: Real> Ahead<T> for Approach<T> {
    fn at(&self, samples: u32) -> State<T> {
        let most = self.step * T::from_f64(f64::from(samples));
        arm_at(self.from + (self.to - self.from).clamp(-most, most))
    }
}

/// The reference of an arm at rest at `theta` (rad), the pendulum upright.
pub(crate) fn arm_at<T: Real>(theta: T) -> State<T> {
    State::new(theta, T::ZERO, T::ZERO, T::ZERO)
}
