//! Numbers in messages.

use core::fmt;

/// A number for a message: see [`number`].
#[derive(Copy, Clone, Debug)]
pub struct Number(f64);

/// A number for a message, with all its digits, in scientific notation where it would be long otherwise: `1e300` is not
/// followed by 300 zeros.
#[must_use]
pub const fn number(value: f64) -> Number {
    Number(value)
}

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let size = self.0.abs();
        if size >= 1e9 && size.is_finite() || size > 0.0 && size < 1e-4 {
            fmt::LowerExp::fmt(&self.0, f)
        } else {
            fmt::Display::fmt(&self.0, f)
        }
    }
}
