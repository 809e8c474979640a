//! Lists whose numbers that are not finite are `null` in JSON, as serde_json writes them: read back as NaN.

use serde::{Deserialize, Deserializer};

pub(crate) fn list<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<f64>, D::Error> {
    Ok(filled(Deserialize::deserialize(deserializer)?))
}

pub(crate) fn pair<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[Vec<f64>; 2], D::Error> {
    <[Vec<Option<f64>>; 2]>::deserialize(deserializer).map(|lists| lists.map(filled))
}

fn filled(list: Vec<Option<f64>>) -> Vec<f64> {
    list.into_iter().map(|x| x.unwrap_or(f64::NAN)).collect()
}
