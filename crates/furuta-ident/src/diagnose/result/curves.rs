//! What only the report shows: curves, bars and evidence.

use serde::Serialize;

use super::Channel;

/// A recording beside what the models predict: report only, not part of the JSON contract.
///
/// Every series has the length of `t`. A model that was not run leaves its series empty.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RunCurves {
    /// Name of the run, the file's name without its folder.
    pub name: String,
    /// Time, s.
    pub t: Vec<f64>,
    /// Motor command, V.
    pub u: Vec<f64>,
    /// Measured `[theta, alpha]`, rad.
    pub measured: [Vec<f64>; 2],
    /// Predicted by the rig file as given, rad.
    pub nominal: [Vec<f64>; 2],
    /// Predicted with refitted parameters, rad.
    pub recalibrated: [Vec<f64>; 2],
    /// Predicted with refitted parameters and the named effects, rad.
    pub augmented: [Vec<f64>; 2],
    /// Indices at which the prediction starts anew from an estimated state (0 alone for a whole-run prediction).
    pub restarts: Vec<usize>,
    /// Whether the search or the fit has not seen this run.
    pub held_out: bool,
}

/// How the gap divides over one condition, before and after: a bar of the report.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GapBar {
    /// The angle that disagrees.
    pub channel: Channel,
    /// What the condition divides by, the heading of a group of bars: `arm speed`, `time`, `run`.
    pub group: String,
    /// The condition: `abs(theta_dot) < 0.3 rad/s`.
    pub condition: String,
    /// Share of the samples under the condition, 0 to 1.
    pub share_of_samples: f64,
    /// Mean squared error under the condition with refitted parameters, in units of the noise floor's.
    pub recalibrated: f64,
    /// The same with the named effects added.
    pub augmented: f64,
}

/// A candidate that was tried, named or not.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CandidateEvidence {
    /// Id in the catalogue.
    pub id: String,
    /// Fall of the Bayesian information criterion when this effect alone is added to the refitted model.
    pub delta_bic: f64,
    /// Whether it was named in the end.
    pub named: bool,
}

/// What the report shows beyond [`Diagnosis`](super::Diagnosis).
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
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
}

/// The torque that the model lacks on one axis, against one state: report only.
///
/// A line through some points over the state, by least squares on the residuals of half-second windows through the
/// model's impulse responses.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TorqueByState {
    /// The axis it acts on.
    pub axis: Channel,
    /// `theta`, `theta_dot`, `alpha`, `alpha_dot` or `u`.
    pub state: String,
    /// Unit of the state.
    pub unit: String,
    /// The points of the state: between them lie equally many samples.
    pub at: Vec<f64>,
    /// Missing with refitted parameters, N m, and its standard deviations.
    pub recalibrated: Vec<f64>,
    /// Standard deviations of `recalibrated`, N m.
    pub recalibrated_std: Vec<f64>,
    /// Missing with the named effects added, N m.
    pub augmented: Vec<f64>,
    /// Standard deviations of `augmented`, N m.
    pub augmented_std: Vec<f64>,
}

/// The torque on `[arm, pendulum]` that the model lacks over time: report only.
///
/// The most likely course under a prior that it is smooth over some 0.06 s and as large as the residuals say.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct TorqueInTime {
    /// Name of the run.
    pub run: String,
    /// Time, s.
    pub t: Vec<f64>,
    /// Missing with refitted parameters, N m.
    pub recalibrated: [Vec<f64>; 2],
    /// Standard deviations of `recalibrated`, N m.
    pub recalibrated_std: [Vec<f64>; 2],
    /// Missing with the named effects added, N m.
    pub augmented: [Vec<f64>; 2],
    /// Standard deviations of `augmented`, N m.
    pub augmented_std: [Vec<f64>; 2],
}
