//! What a calibration says: read by other programs, so fields may be added, but none changes name, unit or meaning
//! without a new [`SCHEMA`].
//!
//! A number that could not be determined is `NaN` here and `null` in the JSON.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::answer::{Channel, null_if_not_finite};
use crate::validate::Validation;

/// Version of the JSON contract, the field `schema`.
pub const SCHEMA: u32 = 1;

/// A parameter before and after.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Calibrated {
    /// Value in the rig file.
    pub nominal: f64,
    /// Fitted value; equal to `nominal` where it was held.
    pub fitted: f64,
    /// Standard deviation of `fitted`; `NaN` where it was held or is at its bound.
    #[serde(with = "null_if_not_finite")]
    pub std: f64,
    /// The 95 % interval, cut at the bounds of what is physical.
    pub interval: Option<[f64; 2]>,
    /// SI unit, `1` where there is none.
    pub unit: String,
    /// Whether it was fitted: the recordings determine it, given what is held.
    pub identifiable: bool,
    /// Whether the fit ended at a bound of what is physical: then the model lacks something, or what is held is wrong.
    pub at_bound: bool,
}

/// How much a parameter changes for one per cent of another, in per cent; or its exponent in a product.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Partner {
    /// Its key.
    pub key: String,
    /// The change, or the exponent.
    pub change: f64,
}

/// Why a parameter is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Why {
    /// The motion does not depend on it.
    NoInfluence,
    /// Others that are fitted imitate it exactly.
    OnlyTogether,
    /// It would be known too badly.
    TooWeak,
    /// It was not asked for.
    NotAsked,
}

/// A parameter that is held at the rig file's value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Held {
    /// Its key.
    pub key: String,
    /// Why.
    pub why: Why,
    /// What its change by one per cent looks like: by so much would the fitted ones be wrong if it is.
    pub partners: Vec<Partner>,
    /// Relative standard deviation with which it would be known if all others were.
    #[serde(with = "null_if_not_finite")]
    pub alone: f64,
    /// The same beside those that are fitted.
    #[serde(with = "null_if_not_finite")]
    pub freed: f64,
    /// The same in words.
    pub sentence: String,
}

/// A combination of parameters, and how well it shows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Direction {
    /// Relative standard deviation.
    #[serde(with = "null_if_not_finite")]
    pub std: f64,
    /// Its larger exponents.
    pub exponents: Vec<Partner>,
    /// The product in words.
    pub words: String,
}

/// What the recordings can tell, found before anything is fitted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identifiability {
    /// How many independent combinations show.
    pub rank: usize,
    /// Of how many parameters.
    pub parameters: usize,
    /// Condition number of the scaled sensitivities of what is fitted: 1 is best, beyond some hundreds the parameters
    /// are known as a bundle only.
    #[serde(with = "null_if_not_finite")]
    pub condition: f64,
    /// All of them, the best known first.
    pub directions: Vec<Direction>,
    /// What is held, and why.
    pub held: Vec<Held>,
}

/// A ratio of what the equations of motion are made of: right whatever the held parameters are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Combination {
    /// Short name.
    pub name: String,
    /// What it is made of.
    pub formula: String,
    /// Of the rig file.
    pub nominal: f64,
    /// Of the fit.
    pub fitted: f64,
    /// Its standard deviation.
    #[serde(with = "null_if_not_finite")]
    pub std: f64,
    /// SI unit, `1` where there is none.
    pub unit: String,
}

/// How well the model follows one angle of one recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChannelFit {
    /// Name of the recording.
    pub run: String,
    /// Which angle.
    pub channel: Channel,
    /// RMS error of the rig file as given, rad.
    #[serde(with = "null_if_not_finite")]
    pub nominal: f64,
    /// The same calibrated, rad.
    #[serde(with = "null_if_not_finite")]
    pub calibrated: f64,
    /// What the encoder's noise alone would leave, rad.
    pub noise_floor: f64,
    /// `100 (1 - |y - ŷ| / |y - mean y|)` of the calibrated model, over the windows.
    #[serde(with = "null_if_not_finite")]
    pub fit_percent: f64,
}

/// The cost along one parameter, all others fitted anew at each point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Profile {
    /// The parameter.
    pub key: String,
    /// SI unit.
    pub unit: String,
    /// Its values.
    pub values: Vec<f64>,
    /// Rise of the cost at each, in units of what the fit leaves per sample: 3.84 bounds the 95 % interval.
    pub rise: Vec<f64>,
    /// Where the rise crosses 3.84; `None` on a side where it does not.
    pub interval: [Option<f64>; 2],
}

/// Rig file and calibrated rig, judged by recordings that the fit did not see.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verification {
    /// The rig file as it was.
    pub as_given: Validation,
    /// The rig with the fitted values.
    pub calibrated: Validation,
}

/// The result of `calibrate`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// [`SCHEMA`].
    pub schema: u32,
    /// Name of the rig.
    pub rig: String,
    /// All parameters by their keys.
    pub parameters: BTreeMap<String, Calibrated>,
    /// The fitted ones, in the order of `correlation`.
    pub fitted: Vec<String>,
    /// Correlation of the fitted parameters' errors.
    pub correlation: Vec<Vec<Option<f64>>>,
    /// What the equations of motion are made of, over the weight's moment `m g c`.
    pub combinations: Vec<Combination>,
    /// What the recordings can tell.
    pub identifiability: Identifiability,
    /// How well the model follows, by recording and angle.
    pub fit: Vec<ChannelFit>,
    /// Root mean square of the residuals over the noise: 1 is the floor.
    #[serde(with = "null_if_not_finite")]
    pub chi: f64,
    /// Length of the predictions that were fitted, where the pendulum hangs, s.
    pub horizon: f64,
    /// Standard deviation of the encoders' noise, `[theta, alpha]`, rad; rounding included.
    pub noise: [f64; 2],
    /// Cost of the profiles asked for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub profiles: Vec<Profile>,
    /// How well both follow recordings that the fit did not see, where there were any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub verification: Option<Verification>,
    /// What a person should know.
    pub notices: Vec<String>,
    /// Wall-clock time, s.
    pub seconds: f64,
}

impl Calibration {
    /// The JSON contract, pretty-printed.
    #[must_use]
    pub fn to_json(&self) -> String {
        // Maps have string keys and numbers are finite or null: nothing can fail.
        serde_json::to_string_pretty(self).unwrap_or_default()
    }

    /// A calibration from its JSON.
    ///
    /// # Errors
    /// Text that is not of this contract.
    pub fn from_json(text: &str) -> Result<Self, serde_json::Error> {
        serde_json::from_str(text)
    }
}
