//! State and conventions: the one place where they are defined.
//!
//! SI units and radians everywhere. `theta` is the arm's angle, `alpha` the pendulum's angle measured from UPRIGHT (0
//! up, pi hanging), positive so that `M12 = -m L_r c cos(alpha)`: near upright, a positive arm acceleration tips the
//! pendulum towards positive `alpha`. The motor command `u` is in volts and held from one sample to the next.

use crate::scalar::Scalar;
use core::ops::{Add, Mul, Sub};
use nalgebra::SVector;

/// `[theta, alpha, theta_dot, alpha_dot]` in rad and rad/s.
///
/// ```
/// use furuta_model::State;
/// let x = State::new(0.1, 0.2, 0.3, 0.4);
/// assert_eq!(State::from(x.to_array()), x);
/// ```
#[derive(Copy, Clone, Debug, PartialEq, Default)]
pub struct State<S> {
    /// Arm angle, rad.
    pub theta: S,
    /// Pendulum angle from upright, rad.
    pub alpha: S,
    /// Arm speed, rad/s.
    pub theta_dot: S,
    /// Pendulum speed, rad/s.
    pub alpha_dot: S,
}

impl<S: Copy> State<S> {
    /// From the two angles (rad) and the two speeds (rad/s).
    #[inline]
    #[must_use]
    pub const fn new(theta: S, alpha: S, theta_dot: S, alpha_dot: S) -> Self {
        Self {
            theta,
            alpha,
            theta_dot,
            alpha_dot,
        }
    }

    /// `[theta, alpha, theta_dot, alpha_dot]`.
    #[inline]
    #[must_use]
    pub const fn to_array(self) -> [S; 4] {
        [self.theta, self.alpha, self.theta_dot, self.alpha_dot]
    }

    /// Every component through `f`.
    #[inline(always)]
    #[must_use]
    pub fn map<T>(self, f: impl Fn(S) -> T) -> State<T> {
        State {
            theta: f(self.theta),
            alpha: f(self.alpha),
            theta_dot: f(self.theta_dot),
            alpha_dot: f(self.alpha_dot),
        }
    }
}

impl<S: Scalar> State<S> {
    /// Both angles and both speeds zero: upright, at rest.
    #[must_use]
    pub fn upright() -> Self {
        Self::new(S::ZERO, S::ZERO, S::ZERO, S::ZERO)
    }

    /// `alpha = pi`: hanging, at rest.
    #[must_use]
    pub fn hanging() -> Self {
        Self::new(
            S::ZERO,
            S::from_f64(core::f64::consts::PI),
            S::ZERO,
            S::ZERO,
        )
    }

    /// Whether every component is a finite number.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.to_array().iter().all(|x| x.value().is_finite())
    }
}

impl<S: Copy> From<[S; 4]> for State<S> {
    fn from([theta, alpha, theta_dot, alpha_dot]: [S; 4]) -> Self {
        Self::new(theta, alpha, theta_dot, alpha_dot)
    }
}

impl<S: nalgebra::Scalar + Copy> From<State<S>> for SVector<S, 4> {
    fn from(x: State<S>) -> Self {
        Self::from(x.to_array())
    }
}

impl<S: nalgebra::Scalar + Copy> From<SVector<S, 4>> for State<S> {
    fn from(x: SVector<S, 4>) -> Self {
        Self::new(x[0], x[1], x[2], x[3])
    }
}

impl<S: Scalar> Add for State<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self::new(
            self.theta + o.theta,
            self.alpha + o.alpha,
            self.theta_dot + o.theta_dot,
            self.alpha_dot + o.alpha_dot,
        )
    }
}

impl<S: Scalar> Sub for State<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self::new(
            self.theta - o.theta,
            self.alpha - o.alpha,
            self.theta_dot - o.theta_dot,
            self.alpha_dot - o.alpha_dot,
        )
    }
}

impl<S: Scalar> Mul<S> for State<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, k: S) -> Self {
        self.map(|x| x * k)
    }
}
