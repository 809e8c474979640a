//! Numbers as C writes them, exactly.

use furuta_model::Scalar;

/// A number of a C file.
pub(super) trait Literal: Scalar {
    /// The type.
    const TYPE: &'static str;
    /// What ends a constant of the type.
    const SUFFIX: &'static str;
    /// Sine, cosine and square root.
    const TRIGONOMETRY: &'static str;
}

impl Literal for f64 {
    const TYPE: &'static str = "double";
    const SUFFIX: &'static str = "";
    const TRIGONOMETRY: &'static str = include_str!("trig_f64.c");
}

impl Literal for f32 {
    const TYPE: &'static str = "float";
    const SUFFIX: &'static str = "f";
    const TRIGONOMETRY: &'static str = include_str!("trig_f32.c");
}

/// A finite number as a hexadecimal constant of its type.
pub(super) fn literal<T: Literal>(number: T) -> String {
    hexadecimal(number.value()) + T::SUFFIX
}

/// A finite number as a hexadecimal constant: every bit of it.
fn hexadecimal(number: f64) -> String {
    let bits = number.to_bits();
    let sign = if bits >> 63 == 1 { "-" } else { "" };
    let (exponent, fraction) = ((bits >> 52) & 0x7ff, bits & ((1 << 52) - 1));
    if exponent == 0 && fraction == 0 {
        return format!("{sign}0x0p+0");
    }
    // Below 2^-1022 there is no leading one.
    #[allow(clippy::cast_possible_wrap)] // at most 2047
    let (lead, power) = match exponent {
        0 => (0, -1022),
        _ => (1, exponent as i64 - 1023),
    };
    let digits = format!("{fraction:013x}");
    let digits = digits.trim_end_matches('0');
    let point = if digits.is_empty() { "" } else { "." };
    format!("{sign}0x{lead}{point}{digits}p{power:+}")
}

#[cfg(test)]
mod tests {
    use super::{hexadecimal, literal};

    #[test]
    fn hexadecimal_numbers() {
        assert_eq!(hexadecimal(1.0), "0x1p+0");
        assert_eq!(hexadecimal(-0.1), "-0x1.999999999999ap-4");
        assert_eq!(hexadecimal(0.0), "0x0p+0");
        assert_eq!(hexadecimal(-0.0), "-0x0p+0");
        assert_eq!(hexadecimal(5e-324), "0x0.0000000000001p-1022");
        assert_eq!(hexadecimal(f64::MAX), "0x1.fffffffffffffp+1023");
        assert_eq!(literal(0.1_f32), "0x1.99999ap-4f");
    }
}
