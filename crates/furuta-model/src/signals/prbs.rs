//! A pseudo-random binary sequence.

use super::error::{SignalError, seconds, volts, within};
use super::{hold_index, shown};
use core::fmt;

/// Two voltages, plus and minus the amplitude, in the order of a maximum-length sequence of `2^order - 1` bits.
///
/// The bits are those of a shift register with feedback (Golomb, Shift Register Sequences, 1967) whose polynomial over
/// GF(2) is primitive: the register passes through every state but zero before it repeats. One period holds one bit
/// `true` more than `false`, and its autocorrelation is 1 at no lag and `-1/(2^order - 1)` at all others, so the
/// spectrum of the bits is flat; holding each for a clock period shapes it by `sinc^2`, which is 3 dB down at 0.44 of
/// the clock rate.
///
/// Bit `k` is read off `x^k` modulo the polynomial, by squaring: any time costs the same, and there is no state.
///
/// ```
/// use furuta_model::signals::Prbs;
/// let signal = Prbs::new(1.0, 3, 0.1, 0)?;
/// let bits = [0, 1, 2, 3, 4, 5, 6].map(|k| signal.bit(k));
/// assert_eq!(bits, [false, false, true, true, true, false, true]);
/// assert_eq!(signal.volts(0.25), 1.0);
/// assert_eq!(signal.to_string(), "PRBS of 1 V, 7 bits of 0.1 s");
/// # Ok::<(), furuta_model::signals::SignalError>(())
/// ```
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Prbs {
    amplitude: f64,
    order: u32,
    clock: f64,
    start: u32,
}

impl Prbs {
    /// Name in one word.
    pub const NAME: &'static str = "prbs";

    /// Primitive polynomials of order 2 to 20 over GF(2), bit `i` the coefficient of `x^i` (the taps of Xilinx' XAPP
    /// 052).
    const POLYNOMIALS: [u32; 19] = [
        polynomial(&[2, 1]),
        polynomial(&[3, 2]),
        polynomial(&[4, 3]),
        polynomial(&[5, 3]),
        polynomial(&[6, 5]),
        polynomial(&[7, 6]),
        polynomial(&[8, 6, 5, 4]),
        polynomial(&[9, 5]),
        polynomial(&[10, 7]),
        polynomial(&[11, 9]),
        polynomial(&[12, 6, 4, 1]),
        polynomial(&[13, 4, 3, 1]),
        polynomial(&[14, 5, 3, 1]),
        polynomial(&[15, 14]),
        polynomial(&[16, 15, 13, 4]),
        polynomial(&[17, 14]),
        polynomial(&[18, 11]),
        polynomial(&[19, 6, 2, 1]),
        polynomial(&[20, 17]),
    ];

    /// Levels of plus and minus `amplitude` (V), each held for at least `clock` seconds, of `2^order - 1` bits a
    /// period. Seeds begin at different places of the one sequence.
    ///
    /// # Errors
    /// An amplitude beyond 1000 V, an order outside [2, 20], a clock period outside [1e-6, 1e6] s.
    pub fn new(amplitude: f64, order: u32, clock: f64, seed: u64) -> Result<Self, SignalError> {
        within(Self::NAME, "order", f64::from(order), [2.0, 20.0], "")?;
        let bits = (1_u64 << order) - 1;
        #[allow(clippy::cast_possible_truncation)] // below 2^20
        let start = (seed % bits) as u32;
        Ok(Self {
            amplitude: volts(Self::NAME, "amplitude", amplitude)?,
            order,
            clock: seconds(Self::NAME, "clock", clock)?,
            start,
        })
    }

    /// Voltage (V) at time `t` (s); before 0, that of time 0.
    #[must_use]
    pub fn volts(&self, t: f64) -> f64 {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // saturates
        let k = hold_index(t, self.clock) as u64;
        if self.bit(k) {
            self.amplitude
        } else {
            -self.amplitude
        }
    }

    /// Bit `k` of the sequence.
    #[must_use]
    pub fn bit(&self, k: u64) -> bool {
        let bits = u64::from(self.bits());
        let mut exponent = (k % bits + u64::from(self.start)) % bits;
        let (mut power, mut factor) = (1, 2); // 1 and x
        while exponent > 0 {
            if exponent & 1 == 1 {
                power = self.product(power, factor);
            }
            factor = self.product(factor, factor);
            exponent >>= 1;
        }
        power >> (self.order - 1) == 1
    }

    /// Bits in one period, `2^order - 1`.
    #[must_use]
    pub fn bits(&self) -> u32 {
        (1 << self.order) - 1
    }

    /// Length of a clock period (s).
    #[must_use]
    pub fn clock(&self) -> f64 {
        self.clock
    }

    /// Length of one period of the whole sequence (s).
    #[must_use]
    pub fn period(&self) -> f64 {
        self.clock * f64::from(self.bits())
    }

    /// The product of two polynomials over GF(2), modulo the sequence's own.
    fn product(&self, a: u32, b: u32) -> u32 {
        let polynomial = Self::POLYNOMIALS[self.order as usize - 2];
        let mut product = 0;
        for i in (0..self.order).rev() {
            product = shifted(product, polynomial, self.order);
            if b >> i & 1 == 1 {
                product ^= a;
            }
        }
        product
    }
}

/// Times `x`, modulo the polynomial: one step of the shift register.
const fn shifted(state: u32, polynomial: u32, order: u32) -> u32 {
    let next = state << 1;
    if next >> order & 1 == 1 {
        next ^ polynomial
    } else {
        next
    }
}

/// `1 + x^a + x^b + ...`.
const fn polynomial(exponents: &[u32]) -> u32 {
    let mut sum = 1;
    let mut i = 0;
    while i < exponents.len() {
        sum |= 1 << exponents[i];
        i += 1;
    }
    sum
}

/// Where the sequence begins is the seed, modulo its length.
#[cfg(feature = "std")]
#[derive(serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    amplitude: f64,
    order: u32,
    clock: f64,
    seed: u64,
}

#[cfg(feature = "std")]
impl serde::Serialize for Prbs {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self {
            amplitude,
            order,
            clock,
            start,
        } = *self;
        let seed = u64::from(start);
        Table {
            amplitude,
            order,
            clock,
            seed,
        }
        .serialize(serializer)
    }
}

#[cfg(feature = "std")]
impl<'de> serde::Deserialize<'de> for Prbs {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let t = Table::deserialize(deserializer)?;
        Self::new(t.amplitude, t.order, t.clock, t.seed).map_err(serde::de::Error::custom)
    }
}

impl fmt::Display for Prbs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (amplitude, clock) = (shown(self.amplitude), shown(self.clock));
        write!(
            f,
            "PRBS of {amplitude} V, {} bits of {clock} s",
            self.bits()
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn prbs(order: u32) -> Prbs {
        Prbs::new(1.0, order, 0.01, 0).expect("valid")
    }

    /// The register comes back to where it began after 2^n - 1 steps and not before: all polynomials are primitive.
    #[test]
    fn every_order_has_its_full_length() {
        for order in 2..=20 {
            let polynomial = Prbs::POLYNOMIALS[order as usize - 2];
            let mut state = 1;
            let mut steps = 0_u32;
            loop {
                // Reading a bit off the power agrees with stepping the register.
                if steps < 1000 || steps.is_multiple_of(1009) {
                    assert_eq!(prbs(order).bit(u64::from(steps)), state >> (order - 1) == 1);
                }
                state = shifted(state, polynomial, order);
                steps += 1;
                if state == 1 {
                    break;
                }
            }
            assert_eq!(steps, (1 << order) - 1, "order {order}");
        }
    }

    /// Two values: the number of bits at no lag, -1 at every other.
    #[test]
    fn autocorrelation_has_two_values() {
        for order in 2..=11 {
            let signal = prbs(order);
            let n = signal.bits() as usize;
            let levels: Vec<i32> = (0..n as u64)
                .map(|k| if signal.bit(k) { 1 } else { -1 })
                .collect();
            assert_eq!(levels.iter().sum::<i32>(), 1, "order {order}");
            for lag in 1..n {
                let sum: i32 = (0..n).map(|k| levels[k] * levels[(k + lag) % n]).sum();
                assert_eq!(sum, -1, "order {order}, lag {lag}");
            }
        }
    }

    proptest! {
        #[test]
        fn repeats_after_its_period_and_a_seed_shifts_it(order in 2_u32..=20, k in 0_u64..1 << 40, seed: u64) {
            let (plain, shifted) = (prbs(order), Prbs::new(1.0, order, 0.01, seed).expect("valid"));
            let n = u64::from(plain.bits());
            prop_assert_eq!(plain.bit(k), plain.bit(k + n));
            prop_assert_eq!(shifted.bit(k), plain.bit(k + seed % n));
        }
    }

    #[test]
    fn orders_without_a_polynomial_are_refused() {
        for order in [0, 1, 21, u32::MAX] {
            let error = Prbs::new(1.0, order, 0.01, 0).expect_err("refused");
            assert!(
                error
                    .to_string()
                    .ends_with("outside the allowed range [2, 20]")
            );
        }
        assert!(Prbs::new(1.0, 7, 0.0, 0).is_err());
        assert!(prbs(7).volts(f64::NAN).abs() == 1.0 && prbs(7).volts(1e300).abs() == 1.0);
    }
}
