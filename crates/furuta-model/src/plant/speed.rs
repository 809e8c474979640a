//! An arm whose acceleration is commanded, up to its largest speed.

use super::crossing::Cubic;
use super::{Plant, PlantState};
use crate::integrate::{Fixed, Length, Variable};
use crate::scalar::Scalar;

/// How often an arm can reach its limit within a stretch with one command: to either side, and once more for rounding.
const MOST: usize = 3;

impl<S: Scalar> Plant<S> {
    /// A stretch with one command, cut where the arm reaches its largest speed: from there on its acceleration is zero,
    /// until the command turns. The moment is that of the commanded acceleration's integral, in the plant's own scalar,
    /// so that a fit sees how it moves with limit, delay and lag.
    pub(super) fn within_speed<H: Length<S>>(&self, s: &mut PlantState<S>, u: S, h: H) {
        let Some(mut left) = self.until_limit(s, u, h) else {
            return;
        };
        for _ in 1..MOST {
            match self.until_limit(s, u, Variable(left)) {
                Some(rest) if rest.real() > S::Real::ZERO => left = rest,
                _ => return,
            }
        }
        self.at_any_speed(s, u, Variable(left));
    }

    /// Advances by `h`, or until the limit is reached; then returns what is left of `h`.
    fn until_limit<H: Length<S>>(&self, s: &mut PlantState<S>, u: S, h: H) -> Option<S> {
        let (zero, limit, length) = (S::Real::ZERO, self.speed_limit, h.of(S::ONE));
        let command = self.driven(s, u, h).volts;
        let now = s.x.theta_dot;
        let faster = (now * command[1]).real() > zero;
        if faster && now.abs().real() >= limit.real() {
            s.at_limit = true;
            self.at_any_speed(s, u, h);
            s.at_limit = false;
            return None;
        }
        let end = now + self.gained(command, length);
        let side = end.if_less(S::ZERO, -S::ONE, S::ONE);
        if end.abs().real() <= limit.real() || (side * self.gained(command, length)).real() <= zero
        {
            self.at_any_speed(s, u, h);
            return None;
        }
        let acceleration = |i: usize| -(side * self.follows(command[i]) * length).real();
        let reached = Cubic {
            from: (limit - side * now).real(),
            to: (limit - side * end).real(),
            slope_from: acceleration(0),
            slope_to: acceleration(2),
        };
        let after = reached.falls_to_zero() * length.real();
        let command = self.driven(s, u, Fixed(after)).volts;
        let then = now + self.gained(command, S::from_real(after));
        let late = (side * limit - then) / self.follows(command[2]);
        let after = S::from_real(after) + late;
        self.at_any_speed(s, u, Variable(after));
        s.x.theta_dot = side * limit;
        Some(length - after)
    }

    /// The arm's acceleration under a command, rad/s².
    fn follows(&self, command: S) -> S {
        command * self.coefficients.drive / self.coefficients.arm
    }

    /// What its speed gains while the command passes through these at start, middle and end, rad/s.
    fn gained(&self, [start, middle, end]: [S; 3], length: S) -> S {
        let sum = start + middle.scale(S::Real::from_f64(4.0)) + end;
        self.follows(sum) * length / S::from_f64(6.0)
    }
}
