//! What is attached to a rig and has contacts or a state of its own: end stops, a cable that relaxes, a winding.

use crate::scalar::Scalar;

/// Two springs with dampers that the arm meets at the ends of its way. All zero: there are none.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct EndStop<S> {
    /// Torque per radian of indentation, N m/rad; 0: none.
    pub stiffness: S,
    /// How far from the middle the arm meets them, rad.
    pub angle: S,
    /// Torque per rad/s of indentation, N m s/rad.
    pub damping: S,
    /// The arm's angle halfway between them, rad.
    pub middle: S,
}

impl<S: Scalar> EndStop<S> {
    /// No end stops.
    pub const NONE: Self = Self {
        stiffness: S::ZERO,
        angle: S::ZERO,
        damping: S::ZERO,
        middle: S::ZERO,
    };

    /// Whether there are any.
    #[inline(always)]
    pub(crate) fn is_there(&self) -> bool {
        self.stiffness.real() > S::Real::ZERO
    }

    /// How deep the arm is in the stop on the side `side` (-1 or 1), rad; negative before it.
    #[inline(always)]
    pub(crate) fn depth(&self, side: S, theta: S) -> S {
        side * (theta - self.middle) - self.angle
    }

    /// With which torque (N m) the stop on the side `side` pushes the arm back, if it touches; negative where it would
    /// have to pull.
    #[inline(always)]
    pub(crate) fn push(&self, side: S, theta: S, theta_dot: S) -> S {
        self.stiffness * self.depth(side, theta) + self.damping * side * theta_dot
    }

    /// The side (-1 or 1) of the stop that pushes the arm; 0: none does.
    #[inline(always)]
    pub(crate) fn side(&self, theta: S, theta_dot: S) -> S {
        let zero = S::Real::ZERO;
        if !self.is_there() {
            return S::ZERO;
        }
        let pushes = |side: S| {
            self.depth(side, theta).real() > zero && self.push(side, theta, theta_dot).real() > zero
        };
        if pushes(S::ONE) {
            S::ONE
        } else if pushes(-S::ONE) {
            -S::ONE
        } else {
            S::ZERO
        }
    }

    /// Torque on the arm, N m, of the stop on the side `side`; 0: of none.
    #[inline(always)]
    pub(crate) fn torque(&self, side: S, theta: S, theta_dot: S) -> S {
        if side.real() == S::Real::ZERO {
            return S::ZERO;
        }
        -(side * self.push(side, theta, theta_dot))
    }
}

/// A spring in series with a dashpot between arm and base (a Maxwell element). All zero: there is none.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Relaxation<S> {
    /// Torque per radian that the spring is stretched, N m/rad.
    pub stiffness: S,
    /// In which the stretch of a resting arm falls to `1/e`, s.
    pub time_constant: S,
}

impl<S: Scalar> Relaxation<S> {
    /// No such cable.
    pub const NONE: Self = Self {
        stiffness: S::ZERO,
        time_constant: S::ZERO,
    };

    /// Whether there is one.
    #[inline(always)]
    pub(crate) fn is_there(&self) -> bool {
        self.time_constant.real() > S::Real::ZERO
    }

    /// How fast the spring's stretch (rad) changes, rad/s.
    #[inline(always)]
    pub(crate) fn rate(&self, stretch: S, theta_dot: S) -> S {
        if self.is_there() {
            theta_dot - stretch / self.time_constant
        } else {
            S::ZERO
        }
    }

    /// The stretch after `h` seconds at a steady speed of the arm (rad/s): exact.
    #[inline(always)]
    pub(crate) fn after(&self, stretch: S, theta_dot: S, h: S) -> S {
        if !self.is_there() {
            return S::ZERO;
        }
        let end = self.time_constant * theta_dot;
        end + (stretch - end) * (-(h / self.time_constant)).exp()
    }
}

/// A winding in which the current follows the voltage late. All zero: it follows at once.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Winding<S> {
    /// Inductance over resistance, s; 0: the current follows at once.
    pub time_constant: S,
    /// The part of the arm's damping that is the motor's back-EMF, 0 to 1.
    pub back_emf: S,
}

impl<S: Scalar> Winding<S> {
    /// The current follows at once.
    pub const PROMPT: Self = Self {
        time_constant: S::ZERO,
        back_emf: S::ZERO,
    };

    /// Whether the current is late.
    #[inline(always)]
    pub(crate) fn is_late(&self) -> bool {
        self.time_constant.real() > S::Real::ZERO
    }

    /// How fast the voltage across the resistance (V) changes towards `settled` (V), V/s.
    #[inline(always)]
    pub(crate) fn rate(&self, across: S, settled: S) -> S {
        if self.is_late() {
            (settled - across) / self.time_constant
        } else {
            S::ZERO
        }
    }

    /// That voltage after `h` seconds towards a steady `settled` (V): exact.
    #[inline(always)]
    pub(crate) fn after(&self, across: S, settled: S, h: S) -> S {
        if !self.is_late() {
            return settled;
        }
        settled + (across - settled) * (-(h / self.time_constant)).exp()
    }
}
