//! No command at all.

use core::fmt;

/// 0 V: the pendulum, pulled aside, swings down by itself, and shows its frequency and its friction.
///
/// ```
/// use furuta_model::signals::FreeDecay;
/// assert_eq!(FreeDecay.volts(1.0), 0.0);
/// ```
#[derive(Copy, Clone, Debug, PartialEq, Eq, Default)]
#[cfg_attr(feature = "std", derive(serde::Serialize, serde::Deserialize))]
pub struct FreeDecay;

impl FreeDecay {
    /// Name in one word.
    pub const NAME: &'static str = "zero";

    /// 0 V at any time.
    #[must_use]
    pub fn volts(&self, _t: f64) -> f64 {
        0.0
    }
}

impl fmt::Display for FreeDecay {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("free decay (0 V)")
    }
}
