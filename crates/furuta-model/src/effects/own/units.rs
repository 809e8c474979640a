//! Units of measurement: powers of the SI's base units, with the radian kept for people to read.

use std::fmt::{self, Display, Formatter};

/// A unit as powers of kg, m, s, A and rad. The radian is a pure number, as the SI has it: it is written, and no
/// difference.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Unit([i8; 5]);

const KG: usize = 0;
const S: usize = 2;
const A: usize = 3;
const RAD: usize = 4;
const BASE: [&str; 5] = ["kg", "m", "s", "A", "rad"];

/// What can be written for a unit.
static KNOWN: [(&str, [i8; 5]); 11] = [
    ("rad", [0, 0, 0, 0, 1]),
    ("kg", [1, 0, 0, 0, 0]),
    ("m", [0, 1, 0, 0, 0]),
    ("s", [0, 0, 1, 0, 0]),
    ("A", [0, 0, 0, 1, 0]),
    ("N", [1, 1, -2, 0, 0]),
    ("J", [1, 2, -2, 0, 0]),
    ("W", [1, 2, -3, 0, 0]),
    ("V", [1, 2, -3, -1, 0]),
    ("Ohm", [1, 2, -3, -2, 0]),
    ("Hz", [0, 0, -1, 0, 0]),
];

impl Unit {
    pub(super) const NONE: Self = Self([0; 5]);
    pub(super) const TORQUE: Self = Self([1, 2, -2, 0, 0]);
    pub(super) const VOLT: Self = Self([1, 2, -3, -1, 0]);
    pub(super) const RADIAN: Self = Self([0, 0, 0, 0, 1]);
    pub(super) const SPEED: Self = Self([0, 0, -1, 0, 1]);
    pub(super) const SECOND: Self = Self([0, 0, 1, 0, 0]);

    /// Whether both measure the same kind of thing.
    pub(super) fn is_like(self, other: Self) -> bool {
        self.0[..RAD] == other.0[..RAD]
    }

    /// `self other^times`.
    pub(super) fn times(self, other: Self, times: i8) -> Self {
        Self(std::array::from_fn(|i| {
            self.0[i].saturating_add(other.0[i].saturating_mul(times))
        }))
    }

    /// The unit of the square root, where all powers are even; an odd power of rad is left out.
    pub(super) fn root(self) -> Option<Self> {
        let even = self.0[..RAD].iter().all(|n| n % 2 == 0);
        even.then(|| Self(self.0.map(|n| n / 2)))
    }

    /// Reads a unit as the catalogue writes it: `N m s2/rad2`, `rad/s`, `1/s`, `N m/(rad V)`; `-` is a pure number.
    ///
    /// # Errors
    /// From and to which byte it is no unit.
    pub(super) fn read(text: &str) -> Result<Self, std::ops::Range<usize>> {
        let mut unit = Self::NONE;
        let (mut below, mut closing, mut any) = (false, false, false);
        let mut at = 0;
        let bytes = text.as_bytes();
        while at < bytes.len() {
            let from = at;
            let word_end = |from: usize| {
                from + bytes[from..]
                    .iter()
                    .take_while(|b| b.is_ascii_alphabetic())
                    .count()
            };
            match bytes[at] {
                b' ' | b'*' => at += 1,
                b'/' if !below => {
                    below = true;
                    at += 1;
                    if bytes.get(at) == Some(&b'(') {
                        closing = true;
                        at += 1;
                    }
                }
                b')' if closing => {
                    (closing, below) = (false, false);
                    at += 1;
                }
                b'-' | b'1' if !any && matches!(text.trim(), "-" | "1") => {
                    (any, at) = (true, at + 1);
                }
                b'1' if !any && text[at + 1..].trim_start().starts_with('/') => {
                    (any, at) = (true, at + 1);
                }
                b if b.is_ascii_alphabetic() => {
                    at = word_end(at);
                    let known = KNOWN.iter().find(|(word, _)| *word == &text[from..at]);
                    let Some((_, powers)) = known else {
                        return Err(from..at);
                    };
                    if bytes.get(at) == Some(&b'^') {
                        at += 1;
                    }
                    let digits = at;
                    if bytes.get(at) == Some(&b'-') {
                        at += 1;
                    }
                    while bytes.get(at).is_some_and(u8::is_ascii_digit) {
                        at += 1;
                    }
                    let power: i8 = match &text[digits..at] {
                        "" => 1,
                        n => n.parse().map_err(|_| digits..at)?,
                    };
                    if !(-9..=9).contains(&power) {
                        return Err(digits..at);
                    }
                    unit = unit.times(Self(*powers), if below { -power } else { power });
                    any = true;
                    below = below && closing;
                }
                _ => {
                    let width = text[at..].chars().next().map_or(1, char::len_utf8);
                    return Err(from..from + width);
                }
            }
        }
        if any && !closing && !below {
            Ok(unit)
        } else {
            Err(text.len()..text.len())
        }
    }

    /// `in N m`, or `a pure number`.
    pub(super) fn words(self) -> String {
        if self == Self::NONE {
            "a pure number".to_owned()
        } else {
            format!("in {self}")
        }
    }

    /// The names of the units that can be written.
    pub(super) fn known() -> String {
        KNOWN.map(|(word, _)| word).join(", ")
    }
}

impl Display for Unit {
    /// With the torque or the voltage that is in it taken out: `N m rad/s`.
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let (head, rest) = match (self.0[KG], self.0[A], self.0[S]) {
            (1, 0, s) if s < 0 => (Some("N m"), self.times(Self::TORQUE, -1)),
            (1, -1, _) => (Some("V"), self.times(Self::VOLT, -1)),
            _ => (None, *self),
        };
        let written = |i: usize, n: i8| match n {
            1 => BASE[i].to_owned(),
            n => format!("{}{n}", BASE[i]),
        };
        let part = |above: bool| -> Vec<String> {
            let powers = rest.0.iter().enumerate();
            let wanted = powers.filter(|(_, n)| if above { **n > 0 } else { **n < 0 });
            wanted.map(|(i, n)| written(i, n.abs())).collect()
        };
        let mut above: Vec<String> = head.iter().map(|h| (*h).to_owned()).collect();
        above.extend(part(true));
        let below = part(false);
        if above.is_empty() {
            f.write_str(if below.is_empty() { "pure number" } else { "1" })?;
        }
        f.write_str(&above.join(" "))?;
        match below.len() {
            0 => Ok(()),
            1 => write!(f, "/{}", below[0]),
            _ => write!(f, "/({})", below.join(" ")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_read_and_written() {
        for (text, shown) in [
            ("N m s2/rad2", "kg m2/rad2"),
            ("rad/s", "rad/s"),
            ("-", "pure number"),
            ("1/s", "1/s"),
            ("Hz", "1/s"),
            ("V s/rad", "V s/rad"),
            ("kg m2", "kg m2"),
            ("N m/(rad V)", "s A/rad"),
            ("W/V", "A"),
            ("m s^-2", "m/s2"),
        ] {
            let unit = Unit::read(text).expect(text);
            assert_eq!(unit.to_string(), shown);
        }
        for (text, from) in [
            ("N m q", 4),
            ("", 0),
            ("N/", 2),
            ("rad/(s", 6),
            ("2 m", 0),
            ("m99", 1),
            ("m é", 2),
        ] {
            assert_eq!(Unit::read(text).expect_err(text).start, from, "{text}");
        }
    }

    #[test]
    fn a_radian_is_a_pure_number() {
        let read = |text| Unit::read(text).expect("a unit");
        assert!(read("N m/rad").is_like(Unit::TORQUE));
        assert!(read("A V s").is_like(Unit::TORQUE));
        assert!(!read("rad/s").is_like(Unit::RADIAN));
        assert_eq!(read("m2/s2").root(), Some(read("m/s")));
        assert_eq!(read("m").root(), None);
    }
}
