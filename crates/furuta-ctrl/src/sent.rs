//! Settings as sent to a microcontroller: the section's id, which parameters are given, their numbers. What comes in is
//! checked as a file would be.

use crate::config::find;
use crate::section::{MAX_NUMBERS, Settings};
use arrayvec::{ArrayString, ArrayVec};
use serde::de::{Deserialize, Deserializer, Error};
use serde::ser::{Serialize, Serializer};

/// Longest id that can be sent, bytes.
const ID: usize = 32;

#[derive(serde::Serialize, serde::Deserialize)]
struct Sent {
    id: ArrayString<ID>,
    given: u32,
    numbers: ArrayVec<f64, MAX_NUMBERS>,
}

impl Serialize for Settings {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let id = ArrayString::from(self.spec().id)
            .map_err(|_| serde::ser::Error::custom("the section's id is too long"))?;
        Sent {
            id,
            given: self.given,
            numbers: self.numbers.clone(),
        }
        .serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Settings {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let sent = Sent::deserialize(deserializer)?;
        let spec = find(&sent.id)
            .ok_or_else(|| D::Error::custom(format_args!("unknown section `{}`", sent.id)))?;
        let mut settings = Settings::new(spec);
        let mut rest = sent.numbers.as_slice();
        for (i, p) in spec.parameters.iter().enumerate() {
            if sent.given & (1 << i) == 0 {
                continue;
            }
            let (values, after) = rest
                .split_at_checked(p.shape.len())
                .ok_or_else(|| D::Error::custom(format_args!("{}: numbers missing", spec.id)))?;
            settings = settings.with(p.name, values).map_err(D::Error::custom)?;
            rest = after;
        }
        if rest.is_empty() && u64::from(sent.given) >> spec.parameters.len() == 0 {
            Ok(settings)
        } else {
            Err(D::Error::custom(format_args!(
                "{}: numbers that belong to no parameter",
                spec.id
            )))
        }
    }
}
