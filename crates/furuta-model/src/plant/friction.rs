//! Dry friction: which axes it holds, and with what torque.

use crate::dynamics::MassMatrix;
use crate::scalar::Scalar;

/// What dry friction does to one axis until the next event.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) enum Dry {
    /// Nothing: there is none.
    Absent,
    /// Holds it.
    Held,
    /// Pushes it in the negative direction: it moves, or is about to move, in the positive one.
    Forward,
    /// Pushes it in the positive direction.
    Backward,
}

impl Dry {
    /// The direction of motion, 0 where it does not slide.
    #[inline(always)]
    pub(super) fn direction<S: Scalar>(self) -> S {
        match self {
            Self::Forward => S::ONE,
            Self::Backward => -S::ONE,
            Self::Absent | Self::Held => S::ZERO,
        }
    }
}

/// Whether a body that has moved with the speed `before` moves the other way `after`; what is not a number turns.
#[inline(always)]
pub(super) fn turns<R: Scalar<Real = R> + PartialOrd>(before: R, after: R) -> bool {
    let goes_on = if before < R::ZERO {
        after <= R::ZERO
    } else {
        after >= R::ZERO
    };
    !goes_on
}

/// Torques without dry friction, inverse inertia, and the largest torques of dry friction, all at one moment.
#[derive(Copy, Clone, Debug)]
pub(super) struct Balance<S> {
    pub(super) free: [S; 2],
    pub(super) inverse: MassMatrix<S>,
    pub(super) limit: [S; 2],
}

impl<S: Scalar> Balance<S> {
    /// Accelerations (rad/s²) and the torques of dry friction (N m) with the axes sliding or held as given.
    #[inline(always)]
    pub(super) fn solve(&self, dry: [Dry; 2]) -> ([S; 2], [S; 2]) {
        let m = &self.inverse;
        let mut friction = [
            -(self.limit[0] * dry[0].direction()),
            -(self.limit[1] * dry[1].direction()),
        ];
        match [dry[0] == Dry::Held, dry[1] == Dry::Held] {
            [false, false] => {}
            [true, true] => {
                return ([S::ZERO; 2], [-self.free[0], -self.free[1]]);
            }
            [true, false] => {
                let other = self.free[1] + friction[1];
                friction[0] = -(self.free[0] + m.coupling * other / m.arm);
            }
            [false, true] => {
                let other = self.free[0] + friction[0];
                friction[1] = -(self.free[1] + m.coupling * other / m.pendulum);
            }
        }
        let mut acceleration = m.times([self.free[0] + friction[0], self.free[1] + friction[1]]);
        for i in 0..2 {
            if dry[i] == Dry::Held {
                acceleration[i] = S::ZERO;
            }
        }
        (acceleration, friction)
    }

    /// What dry friction does to axes moving with these speeds. `broke` says which way axes were just torn loose.
    pub(super) fn decide(&self, speed: [S; 2], broke: [Option<Dry>; 2]) -> [Dry; 2] {
        let zero = S::Real::ZERO;
        let moving = [0, 1].map(|i| {
            if self.limit[i].real() <= zero {
                Some(Dry::Absent)
            } else if speed[i].real() > zero {
                Some(Dry::Forward)
            } else if speed[i].real() < zero {
                Some(Dry::Backward)
            } else {
                broke[i]
            }
        });
        // At rest: held, or sliding the way it is then accelerated. Of the possible pairs one is consistent.
        let choices = |i: usize| match moving[i] {
            Some(dry) => [Some(dry), None, None],
            None => [Some(Dry::Held), Some(Dry::Forward), Some(Dry::Backward)],
        };
        for first in choices(0).into_iter().flatten() {
            for second in choices(1).into_iter().flatten() {
                let dry = [first, second];
                let (acceleration, friction) = self.solve(dry);
                let consistent = |i: usize| match (moving[i], dry[i]) {
                    (None, Dry::Held) => friction[i].abs().real() <= self.limit[i].real(),
                    (None, Dry::Forward) => acceleration[i].real() > zero,
                    (None, Dry::Backward) => acceleration[i].real() < zero,
                    _ => true,
                };
                if consistent(0) && consistent(1) {
                    return dry;
                }
            }
        }
        // Only rounding at the very limit leads here.
        moving.map(|m| m.unwrap_or(Dry::Held))
    }
}

/// Accelerations with dry friction of at most `limit` (N m) on each axis, for integrators that know no events.
///
/// Friction is whatever torque would bring the axis to rest (`acceleration = stop`, a deceleration towards zero speed),
/// as long as that needs no more than `limit`; beyond, it is `limit` against the motion. An axis that is held gets
/// exactly `stop`, so one at rest stays at rest. No stiff `tanh`, but soft within about a step before a stop.
#[inline(always)]
pub(super) fn softly<S: Scalar>(balance: &Balance<S>, stop: [S; 2]) -> [S; 2] {
    let Balance {
        free,
        inverse,
        limit,
    } = balance;
    let own = [inverse.arm, inverse.pendulum];
    let released = inverse.times(*free);
    let mut friction = [S::ZERO; 2];
    let mut held = [false; 2];
    // Gauss-Seidel over the two axes: the coupling is weak enough for three sweeps (the second axis alone needs one).
    let sweeps = if limit[0] == S::ZERO || limit[1] == S::ZERO {
        1
    } else {
        3
    };
    for _ in 0..sweeps {
        for i in 0..2 {
            if limit[i].real() > S::Real::ZERO {
                let others = released[i] + inverse.coupling * friction[1 - i];
                let wanted = (stop[i] - others) / own[i];
                friction[i] = wanted.clamp(-limit[i], limit[i]);
                held[i] = wanted.abs().real() <= limit[i].real();
            }
        }
    }
    let change = inverse.times(friction);
    let mut acceleration = [released[0] + change[0], released[1] + change[1]];
    for i in 0..2 {
        if held[i] {
            acceleration[i] = stop[i];
        }
    }
    acceleration
}
