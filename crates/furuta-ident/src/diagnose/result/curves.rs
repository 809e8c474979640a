//! What only the report shows: curves, bars and evidence.

use serde::{Deserialize, Serialize};

use super::Channel;
use crate::answer::{nan_for_null, null_if_not_finite};

/// A recording beside what the models predict: report only, not part of the JSON contract.
///
/// Every series has the length of `t`. A model that was not run leaves its series empty.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RunCurves {
    /// Name of the run, the file's name without its folder.
    pub name: String,
    /// Time, s.
    #[serde(deserialize_with = "nan_for_null::list")]
    pub t: Vec<f64>,
    /// Motor command.
    #[serde(deserialize_with = "nan_for_null::list")]
    pub u: Vec<f64>,
    /// Its unit; V where that is empty.
    #[serde(default)]
    pub unit: String,
    /// Measured `[theta, alpha]`, rad.
    #[serde(deserialize_with = "nan_for_null::pair")]
    pub measured: [Vec<f64>; 2],
    /// Predicted by the rig file as given, rad.
    #[serde(deserialize_with = "nan_for_null::pair")]
    pub nominal: [Vec<f64>; 2],
    /// Predicted with refitted parameters, rad.
    #[serde(deserialize_with = "nan_for_null::pair")]
    pub recalibrated: [Vec<f64>; 2],
    /// Predicted with refitted parameters and the named effects, rad.
    #[serde(deserialize_with = "nan_for_null::pair")]
    pub augmented: [Vec<f64>; 2],
    /// Indices at which the prediction starts anew from an estimated state (0 alone for a whole-run prediction).
    pub restarts: Vec<usize>,
    /// Whether the search or the fit has not seen this run.
    pub held_out: bool,
}

/// How the gap divides over one condition, before and after: a bar of the report.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GapBar {
    /// The angle that disagrees.
    pub channel: Channel,
    /// What the condition divides by, the heading of a group of bars: `arm speed`, `time`, `run`.
    pub group: String,
    /// The condition: `abs(theta_dot) < 0.3 rad/s`.
    pub condition: String,
    /// Share of the samples under the condition, 0 to 1.
    #[serde(with = "null_if_not_finite")]
    pub share_of_samples: f64,
    /// Mean squared error under the condition with refitted parameters, in units of the noise floor's.
    #[serde(with = "null_if_not_finite")]
    pub recalibrated: f64,
    /// The same with the named effects added.
    #[serde(with = "null_if_not_finite")]
    pub augmented: f64,
}

/// A candidate that was tried, named or not.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CandidateEvidence {
    /// Id in the catalogue.
    pub id: String,
    /// Fall of the Bayesian information criterion when this effect alone is added to the refitted model.
    #[serde(with = "null_if_not_finite")]
    pub delta_bic: f64,
    /// Whether it was named in the end.
    pub named: bool,
}

/// What the report shows beyond [`Diagnosis`](super::Diagnosis).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Curves {
    /// Name of the rig.
    pub rig: String,
    /// The diagnosed recordings, predicted window by window over the horizon of [`Gap::horizon`](super::Gap::horizon).
    pub runs: Vec<RunCurves>,
    /// Where the gap sits, before and after.
    pub bars: Vec<GapBar>,
    /// The torque that the model lacks, against each state.
    pub torque_by_state: Vec<TorqueByState>,
    /// The torque that the model lacks, over time, run by run.
    pub torque_in_time: Vec<TorqueInTime>,
    /// ALL candidates tried, in any order.
    pub evidence: Vec<CandidateEvidence>,
    /// The recordings of `--verify`, predicted over their whole length.
    pub verification: Vec<RunCurves>,
    /// The repaired rig file, whole, as TOML.
    pub repaired_rig: Option<String>,
}

impl Curves {
    /// All of it as JSON; numbers that are not finite become `null`.
    #[must_use]
    pub fn to_json(&self) -> String {
        // As for [`Diagnosis::to_json`].
        serde_json::to_string(self).unwrap_or_default()
    }

    /// Curves from their JSON; `null` becomes NaN.
    ///
    /// # Errors
    /// Text that [`Curves::to_json`] does not write.
    pub fn from_json(json: &str) -> Result<Self, serde_json::Error> {
        serde_json::from_str(json)
    }
}

/// The torque that the model lacks on one axis, against one state: report only.
///
/// A line through some points over the state, by least squares on the residuals of half-second windows through the
/// model's impulse responses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TorqueByState {
    /// The axis it acts on.
    pub axis: Channel,
    /// `theta`, `theta_dot`, `alpha`, `alpha_dot` or `u`.
    pub state: String,
    /// Unit of the state.
    pub unit: String,
    /// The points of the state: between them lie equally many samples.
    #[serde(deserialize_with = "nan_for_null::list")]
    pub at: Vec<f64>,
    /// Missing with refitted parameters, N m, and its standard deviations.
    #[serde(deserialize_with = "nan_for_null::list")]
    pub recalibrated: Vec<f64>,
    /// Standard deviations of `recalibrated`, N m.
    #[serde(deserialize_with = "nan_for_null::list")]
    pub recalibrated_std: Vec<f64>,
    /// Missing with the named effects added, N m.
    #[serde(deserialize_with = "nan_for_null::list")]
    pub augmented: Vec<f64>,
    /// Standard deviations of `augmented`, N m.
    #[serde(deserialize_with = "nan_for_null::list")]
    pub augmented_std: Vec<f64>,
}

/// The torque on `[arm, pendulum]` that the model lacks over time: report only.
///
/// The most likely course under a prior that it is smooth over some 0.06 s and as large as the residuals say.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TorqueInTime {
    /// Name of the run.
    pub run: String,
    /// Time, s.
    #[serde(deserialize_with = "nan_for_null::list")]
    pub t: Vec<f64>,
    /// Missing with refitted parameters, N m.
    #[serde(deserialize_with = "nan_for_null::pair")]
    pub recalibrated: [Vec<f64>; 2],
    /// Standard deviations of `recalibrated`, N m.
    #[serde(deserialize_with = "nan_for_null::pair")]
    pub recalibrated_std: [Vec<f64>; 2],
    /// Missing with the named effects added, N m.
    #[serde(deserialize_with = "nan_for_null::pair")]
    pub augmented: [Vec<f64>; 2],
    /// Standard deviations of `augmented`, N m.
    #[serde(deserialize_with = "nan_for_null::pair")]
    pub augmented_std: [Vec<f64>; 2],
}
