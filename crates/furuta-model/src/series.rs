//! Truncated power series in two variables: the model's own Taylor expansion, without symbolic algebra.

use crate::scalar::Scalar;
use core::array;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// The degree up to which a [`Series`] goes that says nothing else: what controllers on a microcontroller have.
pub const DEGREE: usize = 7;

/// Monomials `w1^i w2^j` with `i + j <= DEGREE`: the terms of a [`Series`] that says nothing else.
pub const TERMS: usize = terms(DEGREE);

/// How many monomials `w1^i w2^j` have `i + j <= degree`: the second parameter of a [`Series`] of that degree.
///
/// ```
/// use furuta_model::series::{Series, terms};
/// let w1 = Series::<f64, { terms(11) }>::variable(0.0, 0);
/// assert_eq!(Series::<f64, { terms(11) }>::DEGREE, 11);
/// let product = w1 * w1 * w1 * w1 * w1 * w1 * w1 * w1 * w1;
/// assert_eq!(product.coefficient(9, 0), 1.0);
/// ```
#[must_use]
pub const fn terms(degree: usize) -> usize {
    (degree + 1) * (degree + 2) / 2
}

/// A polynomial in `(w1, w2)` of total degree up to [`Series::DEGREE`]; what a product adds beyond that is dropped.
///
/// The degree is a capacity that is chosen when the program is compiled, as the number of [`terms`]: nothing is
/// allocated. 7 ([`DEGREE`]) if none is given.
///
/// As a [`Scalar`] it turns any function of the model into its Taylor series about a point: [`Series::variable`] is
/// that point plus `w1` or `w2`. At a kink ([`Scalar::if_less`]) the series is that of the branch which the constant
/// terms take.
///
/// ```
/// use furuta_model::{Scalar, series::Series};
/// let w2 = Series::<f64>::variable(0.0, 1);
/// let tan = { let (s, c) = w2.sin_cos(); s / c };
/// // tan(w) = w + w^3/3 + 2 w^5/15 + 17 w^7/315
/// assert!((tan.coefficient(0, 7) - 17.0 / 315.0).abs() < 1e-16);
/// assert_eq!(tan.coefficient(0, 2), 0.0);
/// ```
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Series<T, const N: usize = TERMS> {
    /// Of `w1^i w2^j` at [`Series::index`].
    terms: [T; N],
}

impl<T: Scalar<Real = T>, const N: usize> Series<T, N> {
    /// Highest total degree that is kept.
    pub const DEGREE: usize = {
        let mut degree = 0;
        while terms(degree) < N {
            degree += 1;
        }
        assert!(terms(degree) == N, "a series has terms(degree) terms");
        degree
    };

    /// The constant `v`.
    #[must_use]
    pub fn constant(v: T) -> Self {
        let mut terms = [T::ZERO; N];
        terms[0] = v;
        Self { terms }
    }

    /// `v + w1` (`which` 0) or `v + w2` (any other).
    #[must_use]
    pub fn variable(v: T, which: usize) -> Self {
        let mut x = Self::constant(v);
        x.terms[if which == 0 { 1 } else { 2 }] = T::ONE;
        x
    }

    /// From the coefficient of every `w1^i w2^j`.
    #[must_use]
    pub fn from_fn(mut coefficient: impl FnMut(usize, usize) -> T) -> Self {
        let mut x = Self::constant(T::ZERO);
        for degree in 0..=Self::DEGREE {
            for j in 0..=degree {
                x.terms[Self::index(degree - j, j)] = coefficient(degree - j, j);
            }
        }
        x
    }

    /// Where the coefficient of `w1^i w2^j` stands: by degree, then by `j`.
    const fn index(i: usize, j: usize) -> usize {
        let degree = i + j;
        degree * (degree + 1) / 2 + j
    }

    /// The coefficient of `w1^i w2^j`; 0 beyond [`Series::DEGREE`].
    #[must_use]
    pub fn coefficient(&self, i: usize, j: usize) -> T {
        if i.saturating_add(j) > Self::DEGREE {
            T::ZERO
        } else {
            self.terms[Self::index(i, j)]
        }
    }

    /// Every coefficient through `f`, which hears the exponents.
    #[must_use]
    pub fn map<U: Scalar<Real = U>>(&self, f: impl Fn(usize, usize, T) -> U) -> Series<U, N> {
        Series::from_fn(|i, j| f(i, j, self.coefficient(i, j)))
    }

    /// The terms of degree up to `order`.
    #[must_use]
    pub fn truncated(&self, order: usize) -> Self {
        self.map(|i, j, c| if i + j <= order { c } else { T::ZERO })
    }

    /// The value at `(w1, w2)`.
    ///
    /// ```
    /// use furuta_model::series::Series;
    /// let p = Series::<f64>::from_fn(|i, j| if (i, j) == (2, 1) { 3.0 } else { 0.0 });
    /// assert_eq!(p.at(2.0, 5.0), 60.0);
    /// ```
    #[must_use]
    pub fn at(&self, w1: T, w2: T) -> T {
        // Horner's scheme in w1 for each power of w2, and over these in w2.
        let mut sum = T::ZERO;
        for j in (0..=Self::DEGREE).rev() {
            let mut row = T::ZERO;
            for i in (0..=Self::DEGREE - j).rev() {
                row = row * w1 + self.terms[Self::index(i, j)];
            }
            sum = sum * w2 + row;
        }
        sum
    }

    /// The rate of the polynomial along the oscillator `w1' = lambda w2`, `w2' = -lambda w1`: its Lie derivative,
    /// exact.
    ///
    /// ```
    /// use furuta_model::series::Series;
    /// let w2 = Series::<f64>::variable(0.0, 1);
    /// assert_eq!(w2.rate(3.0).coefficient(1, 0), -3.0);
    /// ```
    #[must_use]
    pub fn rate(&self, lambda: T) -> Self {
        Self::from_fn(|i, j| {
            let mut c = T::ZERO;
            #[allow(clippy::cast_precision_loss)]
            if j > 0 {
                c += T::from_f64((i + 1) as f64) * self.coefficient(i + 1, j - 1);
            }
            #[allow(clippy::cast_precision_loss)]
            if i > 0 {
                c -= T::from_f64((j + 1) as f64) * self.coefficient(i - 1, j + 1);
            }
            c * lambda
        })
    }

    /// The series without its constant term.
    fn without_constant(mut self) -> Self {
        self.terms[0] = T::ZERO;
        self
    }

    /// `sum of taylor(k) h^k` for a series `h` without constant term, by Horner's scheme.
    fn compose(h: &Self, taylor: impl Fn(usize) -> T) -> Self {
        let mut sum = Self::constant(taylor(Self::DEGREE));
        for k in (0..Self::DEGREE).rev() {
            sum = sum * *h + Self::constant(taylor(k));
        }
        sum
    }
}

impl<T: Scalar<Real = T>, const N: usize> Add for Series<T, N> {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self {
            terms: array::from_fn(|k| self.terms[k] + o.terms[k]),
        }
    }
}

impl<T: Scalar<Real = T>, const N: usize> Sub for Series<T, N> {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Self {
            terms: array::from_fn(|k| self.terms[k] - o.terms[k]),
        }
    }
}

impl<T: Scalar<Real = T>, const N: usize> Mul for Series<T, N> {
    type Output = Self;
    #[allow(clippy::suspicious_arithmetic_impl)] // a product of sums
    fn mul(self, o: Self) -> Self {
        let mut terms = [T::ZERO; N];
        for p in 0..=Self::DEGREE {
            for j in 0..=p {
                let left = self.terms[Self::index(p - j, j)];
                // Half of the model's series are odd, half even: most products vanish.
                if left == T::ZERO {
                    continue;
                }
                for q in 0..=Self::DEGREE - p {
                    let (from, to) = (Self::index(q, 0), Self::index(p + q - j, j));
                    for l in 0..=q {
                        terms[to + l] += left * o.terms[from + l];
                    }
                }
            }
        }
        Self { terms }
    }
}

impl<T: Scalar<Real = T>, const N: usize> Div for Series<T, N> {
    type Output = Self;
    #[allow(clippy::suspicious_arithmetic_impl)] // a geometric series
    fn div(self, o: Self) -> Self {
        let inverse = T::ONE / o.terms[0];
        // 1 / (a + h) = 1/a (1 - x + x² - ...) with x = h/a.
        let x = o.without_constant() * Self::constant(inverse);
        let alternating = |k: usize| {
            if k.is_multiple_of(2) {
                inverse
            } else {
                -inverse
            }
        };
        self * Self::compose(&x, alternating)
    }
}

impl<T: Scalar<Real = T>, const N: usize> Neg for Series<T, N> {
    type Output = Self;
    fn neg(self) -> Self {
        Self {
            terms: self.terms.map(|c| -c),
        }
    }
}

impl<T: Scalar<Real = T>, const N: usize> AddAssign for Series<T, N> {
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl<T: Scalar<Real = T>, const N: usize> SubAssign for Series<T, N> {
    fn sub_assign(&mut self, o: Self) {
        *self = *self - o;
    }
}

/// `1/k!`: exact products to 22!, rounded ones beyond.
fn inverse_factorial(k: usize) -> f64 {
    let mut product = 1.0;
    for i in 2..=k {
        #[allow(clippy::cast_precision_loss)]
        let factor = i as f64;
        product *= factor;
    }
    1.0 / product
}

/// The binomial coefficient of `x^k` in `(1 + x)^(1/2)`.
fn square_root(k: usize) -> f64 {
    let mut coefficient = 1.0;
    for i in 1..=k {
        #[allow(clippy::cast_precision_loss)]
        let i = i as f64;
        coefficient = coefficient * (1.5 - i) / i;
    }
    coefficient
}

impl<T: Scalar<Real = T> + PartialOrd, const N: usize> Scalar for Series<T, N> {
    type Real = T;
    const ZERO: Self = Self {
        terms: [T::ZERO; N],
    };
    const ONE: Self = {
        let mut terms = [T::ZERO; N];
        terms[0] = T::ONE;
        Self { terms }
    };
    fn from_f64(x: f64) -> Self {
        Self::constant(T::from_f64(x))
    }
    fn from_real(x: T) -> Self {
        Self::constant(x)
    }
    fn real(self) -> T {
        self.terms[0]
    }
    fn value(self) -> f64 {
        self.terms[0].value()
    }
    fn scale(self, k: T) -> Self {
        Self {
            terms: self.terms.map(|c| c * k),
        }
    }
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = self.terms[0].sin_cos();
        // The derivatives of the sine go round: s, c, -s, -c.
        let round = [s, c, -s, -c];
        let taylor = |first: usize| {
            move |k: usize| round[(first + k) % 4] * T::from_f64(inverse_factorial(k))
        };
        let h = self.without_constant();
        (Self::compose(&h, taylor(0)), Self::compose(&h, taylor(1)))
    }
    fn sqrt(self) -> Self {
        let root = self.terms[0].sqrt();
        let x = self.without_constant().scale(T::ONE / self.terms[0]);
        Self::compose(&x, |k| root * T::from_f64(square_root(k)))
    }
    fn exp(self) -> Self {
        let e = self.terms[0].exp();
        let h = self.without_constant();
        Self::compose(&h, |k| e * T::from_f64(inverse_factorial(k)))
    }
    fn if_less(self, other: Self, then: Self, otherwise: Self) -> Self {
        if self.terms[0] < other.terms[0] {
            then
        } else {
            otherwise
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Jet;
    use proptest::prelude::*;

    /// Something of everything.
    fn f<S: Scalar>(x: S, y: S) -> S {
        let (s, c) = (x * y).sin_cos();
        s / (x * x + S::ONE).sqrt() + c * y.exp() - (x - y).abs()
    }

    proptest! {
        /// The first-order terms are the derivatives that dual numbers give.
        #[test]
        fn first_order_is_the_jets(a in 0.1_f64..2.0, b in -2.0_f64..0.0) {
            let series = f(Series::<f64>::variable(a, 0), Series::variable(b, 1));
            let jet = f(Jet::<f64, 2>::variable(a, 0), Jet::variable(b, 1));
            prop_assert!((series.at(0.0, 0.0) - jet.v).abs() < 1e-13);
            prop_assert!((series.coefficient(1, 0) - jet.d[0]).abs() < 1e-12);
            prop_assert!((series.coefficient(0, 1) - jet.d[1]).abs() < 1e-12);
        }

        /// What is dropped is of eighth order: half the distance, 1/256 of the error.
        #[test]
        fn the_error_is_of_eighth_order(a in 0.5_f64..2.0, b in -2.0_f64..-0.5, turn in 0.0_f64..6.2) {
            let series = f(Series::<f64>::variable(a, 0), Series::variable(b, 1));
            let error = |r: f64| {
                let (s, c) = turn.sin_cos();
                (series.at(r * c, r * s) - f(a + r * c, b + r * s)).abs()
            };
            // The eighth-order term can vanish in a direction, but the error cannot be large.
            prop_assert!(error(0.05) < error(0.2) / 4000.0 + 1e-12, "{} {}", error(0.05), error(0.2));
        }
    }

    #[test]
    fn a_turn_of_the_oscillator_changes_nothing_in_its_energy() {
        let (w1, w2) = (
            Series::<f64>::variable(0.0, 0),
            Series::<f64>::variable(0.0, 1),
        );
        let energy = w1 * w1 + w2 * w2;
        assert_eq!((energy * energy).rate(1.7), Series::ZERO);
    }
}
