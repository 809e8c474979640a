//! The classical Runge-Kutta method of fourth order.

use crate::scalar::Scalar;
use crate::state::State;
use core::ops::Add;

/// Where within a step a slope is wanted: the classical method asks at its start, twice in its middle, and at its end.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Stage {
    /// At `t`.
    Start,
    /// At `t + h/2`.
    Middle,
    /// At `t + h`.
    End,
}

/// A step's length: a plain number, or one that itself carries derivatives (a delay that ends within the step).
pub trait Length<S>: Copy {
    /// `x` times this length.
    fn of(self, x: S) -> S;
    /// Half of it.
    #[must_use]
    fn half(self) -> Self;
    /// A sixth of it.
    #[must_use]
    fn sixth(self) -> Self;
    /// One of `n` equal parts of it.
    #[must_use]
    fn part(self, n: usize) -> Self;
}

/// Something an integrator can advance: a list of numbers that can be added, and changed one by one.
pub trait Vector<S>: Copy + Add<Output = Self> {
    /// Every component through `f`.
    #[must_use]
    fn each(self, f: impl Fn(S) -> S) -> Self;
}

impl<S: Scalar> Vector<S> for State<S> {
    #[inline(always)]
    fn each(self, f: impl Fn(S) -> S) -> Self {
        self.map(f)
    }
}

/// A plain step length, s.
#[derive(Copy, Clone, Debug)]
pub struct Fixed<R>(pub R);

/// A step length with derivatives, s.
#[derive(Copy, Clone, Debug)]
pub struct Variable<S>(pub S);

impl<S: Scalar> Length<S> for Fixed<S::Real> {
    #[inline(always)]
    fn of(self, x: S) -> S {
        x.scale(self.0)
    }
    #[inline(always)]
    fn half(self) -> Self {
        Self(self.0 * S::Real::from_f64(0.5))
    }
    #[inline(always)]
    fn sixth(self) -> Self {
        Self(self.0 / S::Real::from_f64(6.0))
    }
    #[inline(always)]
    fn part(self, n: usize) -> Self {
        if n == 1 {
            return self;
        }
        #[allow(clippy::cast_precision_loss)]
        let n = n as f64;
        Self(self.0 / S::Real::from_f64(n))
    }
}

impl<S: Scalar> Length<S> for Variable<S> {
    #[inline(always)]
    fn of(self, x: S) -> S {
        x * self.0
    }
    #[inline(always)]
    fn half(self) -> Self {
        Self(self.0.scale(S::Real::from_f64(0.5)))
    }
    #[inline(always)]
    fn sixth(self) -> Self {
        Self(self.0 / S::from_f64(6.0))
    }
    #[inline(always)]
    fn part(self, n: usize) -> Self {
        if n == 1 {
            return self;
        }
        #[allow(clippy::cast_precision_loss)]
        let n = n as f64;
        Self(self.0 / S::from_f64(n))
    }
}

/// Slopes for an integrator: a closure, or a type where the compiler must be told to inline.
pub trait Field<X> {
    /// `dx/dt` at `x` and a stage's time.
    fn slope(&self, stage: Stage, x: &X) -> X;
}

impl<X, F: Fn(Stage, &X) -> X> Field<X> for F {
    #[inline(always)]
    fn slope(&self, stage: Stage, x: &X) -> X {
        self(stage, x)
    }
}

/// Numbers of more bytes than this are large: dual numbers with more than seven derivatives. The four stages then are a
/// loop, which is less code for the compiler and for the processor to fetch. With twelve to twenty derivatives a step
/// takes less time so, with four it takes more: 64 lies between.
const LARGE: usize = 64;

/// One step of length `h` from `x` along `field`; local error `O(h⁵)`.
///
/// ```
/// use furuta_model::{State, integrate::{Fixed, rk4}};
/// // theta' = theta: one step of 0.1 gives e^0.1 to five digits.
/// let field = |_, x: &State<f64>| State::new(x.theta, 0.0, 0.0, 0.0);
/// let x = rk4(State::new(1.0_f64, 0.0, 0.0, 0.0), Fixed(0.1), &field);
/// assert!((x.theta - 0.1_f64.exp()).abs() < 1e-7);
/// ```
#[inline(always)]
pub fn rk4<S: Scalar, X: Vector<S>, H: Length<S>>(x: X, h: H, field: &impl Field<X>) -> X {
    let half = h.half();
    let [k1, k2, k3, k4] = if const { S::LANES == 1 && size_of::<S>() > LARGE } {
        // One copy of the field's code.
        let (stages, lengths) = (
            [Stage::Start, Stage::Middle, Stage::Middle, Stage::End],
            [half, half, h],
        );
        let mut slopes = [x; 4];
        let mut at = x;
        for (i, stage) in stages.into_iter().enumerate() {
            let k = field.slope(stage, &at);
            slopes[i] = k;
            if let Some(on) = lengths.get(i) {
                at = x + k.each(|k| on.of(k));
            }
        }
        slopes
    } else {
        let k1 = field.slope(Stage::Start, &x);
        let k2 = field.slope(Stage::Middle, &(x + k1.each(|k| half.of(k))));
        let k3 = field.slope(Stage::Middle, &(x + k2.each(|k| half.of(k))));
        let k4 = field.slope(Stage::End, &(x + k3.each(|k| h.of(k))));
        [k1, k2, k3, k4]
    };
    let middle = k2 + k3;
    let sum = k1 + middle + middle + k4;
    let sixth = h.sixth();
    x + sum.each(|k| sixth.of(k))
}
