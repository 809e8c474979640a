//! Dual numbers with N derivatives: exact first derivatives of the model, without step sizes.

use crate::scalar::Scalar;
use core::array;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A value and its derivatives with respect to `N` quantities: `v + sum d[i] eps_i`, `eps_i eps_j = 0`.
///
/// Exact to rounding: every operation applies the chain rule. At a kink ([`Scalar::if_less`]) the derivative is that of
/// the branch taken.
///
/// ```
/// use furuta_model::{Jet, Scalar};
/// let x = Jet::<f64, 1>::variable(2.0, 0);
/// let y = x * x * x; // y = x^3, dy/dx = 3 x^2
/// assert_eq!((y.v, y.d[0]), (8.0, 12.0));
/// ```
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Jet<T, const N: usize> {
    /// The value.
    pub v: T,
    /// The derivatives.
    pub d: [T; N],
}

impl<T: Scalar<Real = T>, const N: usize> Jet<T, N> {
    /// A constant: all derivatives zero.
    #[inline(always)]
    #[must_use]
    pub fn constant(v: T) -> Self {
        Self { v, d: [T::ZERO; N] }
    }

    /// The `i`-th independent variable with the value `v`: derivative one with respect to itself.
    ///
    /// # Panics
    /// If `i >= N`.
    #[inline]
    #[must_use]
    pub fn variable(v: T, i: usize) -> Self {
        let mut x = Self::constant(v);
        x.d[i] = T::ONE;
        x
    }

    /// The chain rule for a function of one variable with value `v` and slope `slope` here.
    #[inline(always)]
    fn chain(self, v: T, slope: T) -> Self {
        Self {
            v,
            d: array::from_fn(|i| self.d[i] * slope),
        }
    }
}

impl<T: Scalar<Real = T>, const N: usize> Add for Jet<T, N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self {
            v: self.v + o.v,
            d: array::from_fn(|i| self.d[i] + o.d[i]),
        }
    }
}

impl<T: Scalar<Real = T>, const N: usize> Sub for Jet<T, N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self {
            v: self.v - o.v,
            d: array::from_fn(|i| self.d[i] - o.d[i]),
        }
    }
}

impl<T: Scalar<Real = T>, const N: usize> Mul for Jet<T, N> {
    type Output = Self;
    #[inline(always)]
    #[allow(clippy::suspicious_arithmetic_impl)] // the product rule is a sum
    fn mul(self, o: Self) -> Self {
        Self {
            v: self.v * o.v,
            d: array::from_fn(|i| self.d[i] * o.v + o.d[i] * self.v),
        }
    }
}

impl<T: Scalar<Real = T>, const N: usize> Div for Jet<T, N> {
    type Output = Self;
    #[inline(always)]
    #[allow(clippy::suspicious_arithmetic_impl)] // the quotient rule has products
    fn div(self, o: Self) -> Self {
        let inverse = T::ONE / o.v;
        let v = self.v * inverse;
        Self {
            v,
            d: array::from_fn(|i| (self.d[i] - v * o.d[i]) * inverse),
        }
    }
}

impl<T: Scalar<Real = T>, const N: usize> Neg for Jet<T, N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self {
            v: -self.v,
            d: array::from_fn(|i| -self.d[i]),
        }
    }
}

impl<T: Scalar<Real = T>, const N: usize> AddAssign for Jet<T, N> {
    #[inline(always)]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl<T: Scalar<Real = T>, const N: usize> SubAssign for Jet<T, N> {
    #[inline(always)]
    fn sub_assign(&mut self, o: Self) {
        *self = *self - o;
    }
}

impl<T: Scalar<Real = T> + PartialOrd, const N: usize> Scalar for Jet<T, N> {
    type Real = T;
    const ZERO: Self = Self {
        v: T::ZERO,
        d: [T::ZERO; N],
    };
    const ONE: Self = Self {
        v: T::ONE,
        d: [T::ZERO; N],
    };
    #[inline(always)]
    fn from_f64(x: f64) -> Self {
        Self::constant(T::from_f64(x))
    }
    #[inline(always)]
    fn from_real(x: T) -> Self {
        Self::constant(x)
    }
    #[inline(always)]
    fn real(self) -> T {
        self.v
    }
    #[inline(always)]
    fn value(self) -> f64 {
        self.v.value()
    }
    #[inline(always)]
    fn scale(self, k: T) -> Self {
        self.chain(self.v * k, k)
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = self.v.sin_cos();
        (self.chain(s, c), self.chain(c, -s))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let r = self.v.sqrt();
        self.chain(r, T::ONE / (r + r))
    }
    #[inline(always)]
    fn exp(self) -> Self {
        let e = self.v.exp();
        self.chain(e, e)
    }
    #[inline(always)]
    fn if_less(self, other: Self, then: Self, otherwise: Self) -> Self {
        if self.v < other.v { then } else { otherwise }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Against num-dual, an independent implementation of the same rules.
        #[test]
        fn agrees_with_num_dual(a in 0.1_f64..3.0, b in -3.0_f64..3.0) {
            use num_dual::{Dual64, DualNum};
            let f = |x: Jet<f64, 1>, y: Jet<f64, 1>| {
                let (s, c) = (x * y).sin_cos();
                (s / x.sqrt() + c * y.exp()).abs() - y.scale(0.5)
            };
            let ours = f(Jet::variable(a, 0), Jet::variable(b, 0));
            let (x, y) = (Dual64::from(a).derivative(), Dual64::from(b).derivative());
            let (s, c) = (x * y).sin_cos();
            let theirs = nalgebra::ComplexField::abs(s / x.sqrt() + c * y.exp()) - y * 0.5;
            // rounding of a dozen operations on numbers up to 60
            prop_assert!((ours.v - theirs.re).abs() < 1e-13 && (ours.d[0] - theirs.eps).abs() < 1e-12);
        }
    }
}
