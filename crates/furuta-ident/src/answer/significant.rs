//! Numbers for people.

/// `value` with `digits` significant digits, without an exponent between 1e-4 and 1e5.
#[must_use]
pub fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".into();
    }
    if !value.is_finite() {
        return "unknown".into();
    }
    let digits = digits.max(1);
    let magnitude = value.abs();
    if !(1e-4..1e5).contains(&magnitude) {
        return format!("{value:.*e}", digits - 1);
    }
    // Rounding may carry into the next decade (0.0999 -> 0.10), which costs one digit too many at worst.
    let decade = magnitude.log10().floor();
    let decimals = (digits as f64 - 1.0 - decade).max(0.0) as usize;
    format!("{value:.decimals$}")
}
