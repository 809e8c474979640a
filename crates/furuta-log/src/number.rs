//! Numbers in JSON, which has neither NaN nor infinity: null, and the names that protocol buffers give the infinities
//! in JSON.

use serde::{Deserialize, Deserializer, Serializer};

const INFINITY: &str = "Infinity";
const NEGATIVE: &str = "-Infinity";

pub(crate) fn serialize<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    match *value {
        f64::INFINITY => serializer.serialize_str(INFINITY),
        f64::NEG_INFINITY => serializer.serialize_str(NEGATIVE),
        // Written as null where it is no number.
        value => serializer.serialize_f64(value),
    }
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Json<'a> {
    Number(f64),
    Null(()),
    Name(&'a str),
}

pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    match Json::deserialize(deserializer)? {
        Json::Number(value) => Ok(value),
        Json::Null(()) => Ok(f64::NAN),
        Json::Name(INFINITY) => Ok(f64::INFINITY),
        Json::Name(NEGATIVE) => Ok(f64::NEG_INFINITY),
        Json::Name(name) => Err(serde::de::Error::invalid_value(
            serde::de::Unexpected::Str(name),
            &"a number, null, \"Infinity\" or \"-Infinity\"",
        )),
    }
}
