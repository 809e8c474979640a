//! The numbers the model is written in.

use core::fmt::Debug;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A real number the model can run on: `f32`, `f64` or a dual number ([`crate::Jet`]).
///
/// Branches go through [`Scalar::if_less`] rather than `if`, so that a type holding several lanes can implement the
/// trait as well. Elementary functions are the crate's own or `libm`'s, never the platform's: the same input gives the
/// same bits on a host and on a microcontroller.
///
/// ```
/// use furuta_model::Scalar;
/// fn clamp_to_one<S: Scalar>(x: S) -> S {
///     x.clamp(-S::ONE, S::ONE)
/// }
/// assert_eq!(clamp_to_one(3.0_f64), 1.0);
/// assert_eq!(clamp_to_one(-0.5_f32), -0.5);
/// ```
pub trait Scalar:
    Copy
    + Debug
    + PartialEq
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + 'static
{
    /// The plain real number underneath: itself for `f32` and `f64`, the value part's type for dual numbers.
    type Real: Scalar<Real = Self::Real> + PartialOrd;

    /// How many numbers it holds at once: 1, but for [`crate::Lanes`].
    const LANES: usize = 1;
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;

    /// The number nearest to `x`, a constant (no derivative).
    fn from_f64(x: f64) -> Self;
    /// A constant of the underlying real type.
    fn from_real(x: Self::Real) -> Self;
    /// The value, without derivatives.
    fn real(self) -> Self::Real;
    /// The value in double precision, without derivatives.
    fn value(self) -> f64;
    /// The product with a plain real number.
    #[must_use]
    fn scale(self, k: Self::Real) -> Self;
    /// Sine and cosine (radians).
    fn sin_cos(self) -> (Self, Self);
    /// Square root.
    #[must_use]
    fn sqrt(self) -> Self;
    /// Natural exponential.
    #[must_use]
    fn exp(self) -> Self;
    /// `then` where `self < other`, `otherwise` elsewhere (a NaN compares as not less).
    #[must_use]
    fn if_less(self, other: Self, then: Self, otherwise: Self) -> Self;

    /// The nearest whole number, from halves away from zero; a constant, where there are derivatives.
    #[must_use]
    #[inline(always)]
    fn round(self) -> Self {
        Self::from_f64(libm::round(self.value()))
    }

    /// Magnitude.
    #[must_use]
    fn abs(self) -> Self {
        self.if_less(Self::ZERO, -self, self)
    }
    /// The value limited to `low..=high`; a NaN stays a NaN.
    #[must_use]
    fn clamp(self, low: Self, high: Self) -> Self {
        let x = self.if_less(low, low, self);
        high.if_less(x, high, x)
    }
}

macro_rules! float {
    ($t:ident, $trig:path, $sqrt:path, $exp:path) => {
        impl Scalar for $t {
            type Real = $t;
            const ZERO: $t = 0.0;
            const ONE: $t = 1.0;
            #[inline(always)]
            #[allow(clippy::cast_possible_truncation)]
            fn from_f64(x: f64) -> $t {
                x as $t
            }
            #[inline(always)]
            fn from_real(x: $t) -> $t {
                x
            }
            #[inline(always)]
            fn real(self) -> $t {
                self
            }
            #[inline(always)]
            fn value(self) -> f64 {
                f64::from(self)
            }
            #[inline(always)]
            fn scale(self, k: $t) -> $t {
                self * k
            }
            #[inline(always)]
            fn sin_cos(self) -> ($t, $t) {
                $trig(self)
            }
            #[inline(always)]
            fn sqrt(self) -> $t {
                $sqrt(self)
            }
            #[inline(always)]
            fn exp(self) -> $t {
                $exp(self)
            }
            #[inline(always)]
            fn if_less(self, other: $t, then: $t, otherwise: $t) -> $t {
                if self < other { then } else { otherwise }
            }
        }
    };
}

float!(f64, crate::trig::sin_cos_f64, libm::sqrt, libm::exp);
float!(f32, crate::trig::sin_cos_f32, libm::sqrtf, libm::expf);
