//! Everything about a plant that changes.

use super::MAX_DELAY_SAMPLES;
use crate::scalar::Scalar;
use crate::state::State;
use arrayvec::ArrayVec;

/// The most users' own laws with a state that one plant can have.
pub const MAX_OWN_STATES: usize = 2;
/// Their place among the inner states: behind those of a cable and a winding.
pub(super) const FIRST_OWN: usize = 2;
/// How many inner states there can be.
pub(super) const STATES: usize = FIRST_OWN + MAX_OWN_STATES;

/// Everything about a plant that changes: time, mechanical state, and the memory of its effects. [`crate::Plant::rest`]
/// makes one.
#[derive(Clone, Debug)]
pub struct PlantState<S: Scalar> {
    /// Which run it is, from 0: some disturbances belong to one run.
    pub run: usize,
    /// Time since the run began, s.
    pub t: S,
    /// Mechanical state.
    pub x: State<S>,
    /// Voltage at the motor behind a lag (equal to the command where there is none), V.
    pub voltage: S,
    /// Of a motor that rings about the command ([`crate::effects::Resonance`]): how far it is behind and how fast it is
    /// getting behind, command s², command s.
    pub(super) ringing: [S; 2],
    /// Angle (rad, turns of the arm) and speed (rad/s) of the motor's rotor, where a drive with backlash or spring sets
    /// it apart from the arm.
    pub(super) rotor: [S; 2],
    /// Whether and on which side the rotor touches the arm.
    pub(super) contact: Contact,
    /// Whether the arm is kept at its largest speed just now.
    pub(super) at_limit: bool,
    /// What [`crate::effects::Law::travelled`] keeps.
    pub(super) memory: S,
    /// States of effects that follow differential equations: see [`super::drive::TwoBody`].
    pub(super) inner: [S; STATES],
    /// Which end stop the arm presses on.
    pub(super) pressed: Contact,
    /// The last commands.
    pub(super) commands: History<S>,
    /// The last readings: angles (rad) and how far they move in a period (rad).
    pub(super) readings: History<[S; 4]>,
    /// The sample period of the readings, s.
    pub(super) period: S::Real,
}

impl<S: Scalar> PlantState<S> {
    /// To be filled.
    pub(super) fn blank() -> Self {
        Self {
            run: 0,
            t: S::ZERO,
            x: State::new(S::ZERO, S::ZERO, S::ZERO, S::ZERO),
            voltage: S::ZERO,
            ringing: [S::ZERO; 2],
            rotor: [S::ZERO; 2],
            contact: Contact::Free,
            at_limit: false,
            memory: S::ZERO,
            inner: [S::ZERO; STATES],
            pressed: Contact::Free,
            commands: History::constant(S::ZERO),
            readings: History::constant([S::ZERO; 4]),
            period: S::Real::ONE,
        }
    }
}

/// How the rotor stands and turns against the arm: what no encoder shows.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Twist {
    /// Rotor's angle less the arm's, rad.
    pub angle: f64,
    /// Rotor's speed less the arm's, rad/s.
    pub speed: f64,
}

/// Rotor and arm; or arm and end stops.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) enum Contact {
    /// In the backlash: no torque between them.
    Free,
    /// The rotor pushes the arm in the negative direction, or holds it back.
    Negative,
    /// The rotor pushes the arm in the positive direction.
    Positive,
}

impl Contact {
    /// -1, 0 or 1.
    #[inline(always)]
    pub(super) fn side<S: Scalar>(self) -> S {
        match self {
            Self::Free => S::ZERO,
            Self::Negative => -S::ONE,
            Self::Positive => S::ONE,
        }
    }

    /// The side on which a torque of this sign is passed from rotor to arm.
    #[inline(always)]
    pub(super) fn of<S: Scalar>(torque: S) -> Self {
        if torque.real() < S::Real::ZERO {
            Self::Negative
        } else if torque.real() > S::Real::ZERO {
            Self::Positive
        } else {
            Self::Free
        }
    }
}

/// Room for a whole number of samples, the rest of a sample, and the newest.
const LENGTH: usize = MAX_DELAY_SAMPLES + 2;

/// The last values of something sampled, by their age; empty until something is late.
#[derive(Debug)]
pub(super) struct History<T> {
    /// What was before anything that is remembered.
    before: T,
    past: ArrayVec<T, LENGTH>,
    newest: usize,
}

/// Not derived: `ArrayVec`'s own has a panic for a length that cannot be, and an estimator clones a state in every
/// control step.
impl<T: Clone> Clone for History<T> {
    fn clone(&self) -> Self {
        let mut past = ArrayVec::new();
        for value in &self.past {
            let _ = past.try_push(value.clone()); // there is as much room as there was
        }
        Self {
            before: self.before.clone(),
            past,
            newest: self.newest,
        }
    }
}

impl<T: Copy> History<T> {
    pub(super) fn constant(value: T) -> Self {
        Self {
            before: value,
            past: ArrayVec::new(),
            newest: 0,
        }
    }

    pub(super) fn fill(&mut self, value: T) {
        self.before = value;
        self.past.clear();
        self.newest = 0;
    }

    pub(super) fn push(&mut self, value: T) {
        if self.past.try_push(value).is_ok() {
            self.newest = self.past.len() - 1;
        } else {
            self.newest = (self.newest + 1) % LENGTH;
            self.past[self.newest] = value;
        }
    }

    pub(super) fn ago(&self, samples: usize) -> T {
        if samples >= self.past.len() {
            return self.before;
        }
        let index = (self.newest + self.past.len() - samples) % self.past.len();
        self.past[index]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_history_answers_what_was_pushed(values in prop::collection::vec(-5..5_i32, 0..400), ago in 0..LENGTH) {
            let mut history = History::constant(77);
            for v in &values {
                history.push(*v);
            }
            let expected = values.iter().rev().nth(ago).copied().unwrap_or(77);
            prop_assert_eq!(history.ago(ago), expected);
        }
    }
}
