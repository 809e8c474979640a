//! Several rollouts at once: numbers side by side, which the compiler turns into vector instructions.

use crate::scalar::Scalar;
use crate::trig;
use core::array;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// `N` numbers that go through the same operations, each with the bits it would have alone.
///
/// One lane's branch must not be another's: the model's formulas branch through [`Scalar::if_less`] alone, which
/// chooses lane by lane. Effects that cut a step at an event have their event at another time in each lane;
/// [`crate::Plant::new`] refuses them ([`crate::PlantError::EventsInLanes`]), and `simulate::batch` then steps such
/// plants one by one. [`Scalar::real`] and [`Scalar::value`] are those of the first lane.
///
/// ```
/// use furuta_model::{Lanes, Scalar};
/// let angles = Lanes([0.0, 0.5, 1.0, 400.0]);
/// let (sin, _) = angles.sin_cos();
/// assert_eq!(sin.0, angles.0.map(|x: f64| x.sin_cos().0)); // the model's own sine, lane by lane
/// ```
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Lanes<T, const N: usize>(pub [T; N]);

macro_rules! lanes {
    ($t:ident, $near:path, $reduced:path, $full:path) => {
        impl<const N: usize> Add for Lanes<$t, N> {
            type Output = Self;
            #[inline(always)]
            fn add(self, o: Self) -> Self {
                Self(array::from_fn(|i| self.0[i] + o.0[i]))
            }
        }
        impl<const N: usize> Sub for Lanes<$t, N> {
            type Output = Self;
            #[inline(always)]
            fn sub(self, o: Self) -> Self {
                Self(array::from_fn(|i| self.0[i] - o.0[i]))
            }
        }
        impl<const N: usize> Mul for Lanes<$t, N> {
            type Output = Self;
            #[inline(always)]
            fn mul(self, o: Self) -> Self {
                Self(array::from_fn(|i| self.0[i] * o.0[i]))
            }
        }
        impl<const N: usize> Div for Lanes<$t, N> {
            type Output = Self;
            #[inline(always)]
            fn div(self, o: Self) -> Self {
                Self(array::from_fn(|i| self.0[i] / o.0[i]))
            }
        }
        impl<const N: usize> Neg for Lanes<$t, N> {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                Self(array::from_fn(|i| -self.0[i]))
            }
        }
        impl<const N: usize> AddAssign for Lanes<$t, N> {
            #[inline(always)]
            fn add_assign(&mut self, o: Self) {
                *self = *self + o;
            }
        }
        impl<const N: usize> SubAssign for Lanes<$t, N> {
            #[inline(always)]
            fn sub_assign(&mut self, o: Self) {
                *self = *self - o;
            }
        }
        impl<const N: usize> Scalar for Lanes<$t, N> {
            type Real = $t;
            const LANES: usize = N;
            const ZERO: Self = Self([0.0; N]);
            const ONE: Self = Self([1.0; N]);
            #[inline(always)]
            fn from_f64(x: f64) -> Self {
                Self([<$t as Scalar>::from_f64(x); N])
            }
            #[inline(always)]
            fn from_real(x: $t) -> Self {
                Self([x; N])
            }
            #[inline(always)]
            fn real(self) -> $t {
                self.0[0]
            }
            #[inline(always)]
            fn value(self) -> f64 {
                self.0[0].value()
            }
            #[inline(always)]
            fn scale(self, k: $t) -> Self {
                Self(array::from_fn(|i| self.0[i] * k))
            }
            #[inline(always)]
            fn sin_cos(self) -> (Self, Self) {
                let (mut sin, mut cos) = ([0.0; N], [0.0; N]);
                for i in 0..N {
                    (sin[i], cos[i]) = $reduced(self.0[i]);
                }
                if !self.0.iter().all(|x| $near(*x)) {
                    for i in 0..N {
                        (sin[i], cos[i]) = $full(self.0[i]);
                    }
                }
                (Self(sin), Self(cos))
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                Self(self.0.map(Scalar::sqrt))
            }
            #[inline(always)]
            fn round(self) -> Self {
                Self(self.0.map(Scalar::round))
            }
            #[inline(always)]
            fn exp(self) -> Self {
                Self(self.0.map(Scalar::exp))
            }
            #[inline(always)]
            fn if_less(self, other: Self, then: Self, otherwise: Self) -> Self {
                Self(array::from_fn(|i| {
                    self.0[i].if_less(other.0[i], then.0[i], otherwise.0[i])
                }))
            }
        }
    };
}

lanes!(f64, trig::near_f64, trig::reduced_f64, trig::sin_cos_f64);
lanes!(f32, trig::near_f32, trig::reduced_f32, trig::sin_cos_f32);
