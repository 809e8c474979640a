//! One number that stands for every bit of a long computation.

use core::fmt;
use furuta_model::Scalar;

/// FNV-1a with 64 bits over the bytes of floating-point numbers, least significant byte first.
///
/// ```
/// use same_bits::Fingerprint;
/// let (mut a, mut b) = (Fingerprint::new(), Fingerprint::new());
/// a.add(1.0_f32);
/// b.add(1.0_f32.next_up()); // the last bit differs
/// assert_ne!(a, b);
/// ```
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Fingerprint(u64);

impl Fingerprint {
    /// Of nothing yet.
    #[must_use]
    pub const fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    /// Takes in one byte.
    pub fn byte(&mut self, byte: u8) {
        self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    }

    /// Takes in every bit of a number.
    pub fn add<F: Float>(&mut self, x: F) {
        let bits = x.bits();
        for i in 0..F::BYTES {
            self.byte((bits >> (8 * i)).to_le_bytes()[0]);
        }
    }
}

impl Default for Fingerprint {
    fn default() -> Self {
        Self::new()
    }
}

impl fmt::Display for Fingerprint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:016x}", self.0)
    }
}

/// A scalar whose bits can be looked at.
pub trait Float: Scalar<Real = Self> + PartialOrd {
    /// What it is called in the printed lines.
    const NAME: &'static str;
    /// Its size.
    const BYTES: usize;

    /// Its bits in the low end of 64. Every NaN counts as the same one: IEEE 754 and Rust leave a NaN's sign and
    /// payload open, and x86-64 and Arm indeed make different ones.
    fn bits(self) -> u64;
}

impl Float for f32 {
    const NAME: &'static str = "f32";
    const BYTES: usize = 4;
    fn bits(self) -> u64 {
        u64::from(if self.is_nan() {
            0x7fc0_0000
        } else {
            self.to_bits()
        })
    }
}

impl Float for f64 {
    const NAME: &'static str = "f64";
    const BYTES: usize = 8;
    fn bits(self) -> u64 {
        if self.is_nan() {
            0x7ff8_0000_0000_0000
        } else {
            self.to_bits()
        }
    }
}
