//! What a diagnosis says: the JSON contract, and the curves that only the report shows.
//!
//! [`Diagnosis`] is read by other programs: fields may be added, but none of the present ones changes name, unit or
//! meaning without a new [`SCHEMA`]. A number that could not be determined is `NaN` here and `null` in the JSON, never
//! an invented zero.

mod at_bound;
mod best;
mod comparison;
mod curves;
mod jitter;
mod left_out;
mod missing_torque;
mod moved;
mod sentence;
mod suspected;
#[cfg(test)]
mod tests;
mod zero;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

pub use self::at_bound::AtBound;
pub use self::best::Best;
pub use self::comparison::{Comparison, Difference};
pub use self::curves::{CandidateEvidence, Curves, GapBar, RunCurves, TorqueByState, TorqueInTime};
pub use self::jitter::Jitter;
pub use self::left_out::LeftOut;
pub use self::missing_torque::{MissingTorque, Shape};
pub use self::suspected::Suspected;
pub use self::zero::{Against, Zero};
pub use super::expression::{CustomTerm, Expression};
use crate::answer::null_if_not_finite;
pub use crate::answer::{Channel, significant};
use crate::pendulum::Pendulum;

/// Version of the JSON contract, the field `schema`.
pub const SCHEMA: u32 = 1;

/// The answer in one word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The model as given predicts down to the noise floor.
    NoGap,
    /// Refitted parameters predict down to the noise floor: no effect is missing.
    ParametersOnly,
    /// Named effects are missing; with them the gap closes.
    MissingEffects,
    /// A gap remains that no entry of the catalogue explains (effects may still be named: they help, and are not the
    /// whole of it).
    Unexplained,
}

impl Verdict {
    /// The word used in the JSON.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::NoGap => "no_gap",
            Self::ParametersOnly => "parameters_only",
            Self::MissingEffects => "missing_effects",
            Self::Unexplained => "unexplained",
        }
    }
}

/// A part of a diagnosis that Ctrl-C or the time limit left undone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Part {
    /// Refitting the parameters alone.
    Parameters,
    /// Looking through the catalogue: effects that are not named may be missing all the same.
    Search,
    /// Comparing each named effect with others in its place: [`NamedEffect::confusable_with`] holds the catalogue's
    /// look-alikes, none of them ruled out.
    Rivals,
    /// Looking for an empirical expression for what no effect explains.
    Expression,
    /// Leading an incomplete model to whole runs.
    LongHorizons,
    /// Judging by data kept apart.
    HeldOut,
    /// How large effects that are not named could be.
    Limits,
    /// The experiments to make next.
    Plan,
}

impl Part {
    /// What it means that this was left undone, for a sentence.
    #[must_use]
    pub const fn undone(self) -> &'static str {
        match self {
            Self::Parameters => "the parameters were not fitted to the end",
            Self::Search => "effects that are not named may be missing all the same",
            Self::Rivals => "nothing was tried in the place of what is named",
            Self::Expression => "no expression was looked for",
            Self::LongHorizons => "the parameters were not led to whole runs",
            Self::HeldOut => "nothing was judged on data kept apart",
            Self::Limits => "no limits of other effects",
            Self::Plan => "not every experiment was thought through",
        }
    }
}

impl core::fmt::Display for Verdict {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.as_str())
    }
}

/// One number per measured angle, in rad.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Channels {
    /// The arm's angle, rad.
    #[serde(with = "null_if_not_finite")]
    pub theta: f64,
    /// The pendulum's angle, rad.
    #[serde(with = "null_if_not_finite")]
    pub alpha: f64,
}

impl Channels {
    /// Neither is known.
    pub const UNKNOWN: Self = Self {
        theta: f64::NAN,
        alpha: f64::NAN,
    };

    /// The number of one channel.
    #[must_use]
    pub const fn get(&self, channel: Channel) -> f64 {
        match channel {
            Channel::Theta => self.theta,
            Channel::Alpha => self.alpha,
        }
    }
}

impl Default for Channels {
    fn default() -> Self {
        Self::UNKNOWN
    }
}

impl From<[f64; 2]> for Channels {
    fn from([theta, alpha]: [f64; 2]) -> Self {
        Self { theta, alpha }
    }
}

impl From<Channels> for [f64; 2] {
    fn from(value: Channels) -> Self {
        [value.theta, value.alpha]
    }
}

/// A fitted number of an effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Fitted value in `unit`.
    #[serde(with = "null_if_not_finite")]
    pub value: f64,
    /// Standard deviation of `value` in `unit`; `NaN` for what is chosen, not fitted (a whole number, one of several
    /// words), and for what the recordings do not show.
    #[serde(with = "null_if_not_finite")]
    pub std: f64,
    /// SI unit, `1` where there is none.
    pub unit: String,
    /// What the rig file writes for the value, where that is a word.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub word: Option<String>,
}

impl Estimate {
    /// `0.03 ± 5e-6 N m/rad`, the value in as many digits; the word for what is a choice, the number alone for what is
    /// not fitted.
    ///
    /// ```
    /// use furuta_ident::diagnose::result::Estimate;
    /// let scale = Estimate { value: 1.02034, std: 0.00123, unit: "1".into(), word: None };
    /// assert_eq!(scale.text(4), "1.020 ± 0.0012");
    /// ```
    #[must_use]
    pub fn text(&self, digits: usize) -> String {
        let unit = plain(&self.unit);
        let text = match &self.word {
            Some(word) => word.clone(),
            None if self.std.is_finite() => {
                let (value, std) = (significant(self.value, digits), significant(self.std, 2));
                format!("{value} ± {std} {unit}")
            }
            None => format!("{} {unit}", significant(self.value, digits)),
        };
        text.trim_end().to_owned()
    }
}

/// A unit as the JSON contract has it: 1 for a pure number.
pub(crate) fn si(unit: &str) -> String {
    if unit == "-" { "1" } else { unit }.to_owned()
}

/// A unit for people, who write none where the contract has `1`.
pub(crate) fn plain(unit: &str) -> &str {
    if unit == "1" { "" } else { unit }
}

/// An effect that the model lacks, found in the data.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NamedEffect {
    /// Id in the catalogue, for example `arm.coulomb`.
    pub id: String,
    /// The catalogue's name, for example `Coulomb friction on the arm`.
    pub name: String,
    /// Fitted parameters by the names that the rig file uses.
    pub parameters: BTreeMap<String, Estimate>,
    /// Fall of the Bayesian information criterion when the effect is added to everything else named; larger is stronger
    /// evidence.
    #[serde(with = "null_if_not_finite")]
    pub delta_bic: f64,
    /// Share of the remaining squared prediction error on held-out data that the effect removes, at most 1.
    #[serde(with = "null_if_not_finite")]
    pub held_out_gain: f64,
    /// Ids that explain these data nearly as well.
    pub confusable_with: Vec<String>,
}

/// An effect that was not named, and how large it could be all the same.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Limit {
    /// Id in the catalogue.
    pub id: String,
    /// The parameter that says how strong it is.
    pub parameter: String,
    /// With a confidence of 95 per cent the parameter is no further than this from where the effect does nothing, in
    /// `unit`.
    #[serde(with = "null_if_not_finite")]
    pub at_most: f64,
    /// Standard deviation with which these data determine the parameter, were the effect there, in `unit`: what is
    /// several times as large is found.
    #[serde(default = "not_a_number", with = "null_if_not_finite")]
    pub std: f64,
    /// A size that would be noticed on this rig, in `unit`.
    #[serde(with = "null_if_not_finite")]
    pub typical: f64,
    /// SI unit, `1` where there is none.
    pub unit: String,
}

/// A parameter of the rig file as given and refitted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParameterEstimate {
    /// Value in the rig file.
    #[serde(with = "null_if_not_finite")]
    pub nominal: f64,
    /// Fitted value; equal to `nominal` where the data cannot tell.
    #[serde(with = "null_if_not_finite")]
    pub fitted: f64,
    /// Standard deviation of `fitted`; `NaN` where it is not identifiable.
    #[serde(with = "null_if_not_finite")]
    pub std: f64,
    /// Standard deviation of the sheet's value, a share of it, as the rig file's `[tolerance]` says; `NaN` where
    /// nothing is known of it.
    #[serde(default = "not_a_number", with = "null_if_not_finite")]
    pub tolerance: f64,
    /// SI unit, `1` where there is none.
    pub unit: String,
    /// Whether these data determine the parameter (given the torque scale `mass*com`).
    pub identifiable: bool,
    /// Whether the fit ended at a bound of what can be ([`Diagnosis::at_bound`] says which): something else took the
    /// number's place.
    #[serde(default)]
    pub at_bound: bool,
}

/// RMS error of prediction over a fixed horizon from estimated initial states, by model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gap {
    /// Unit of all numbers, `rad`.
    pub unit: String,
    /// Length of a prediction, s.
    #[serde(default = "not_a_number", with = "null_if_not_finite")]
    pub horizon: f64,
    /// The rig file as given.
    pub nominal: Channels,
    /// The rig file with refitted parameters.
    pub recalibrated: Channels,
    /// Refitted, with the named effects (and the expression of [`Diagnosis::custom`]).
    pub augmented: Channels,
    /// What a perfect model would leave.
    pub noise_floor: Channels,
}

/// As [`Gap`], on data that neither the search nor the fit has seen.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HeldOut {
    /// The rig file with refitted parameters.
    pub recalibrated: Channels,
    /// Refitted, with the named effects (and the expression of [`Diagnosis::custom`]).
    pub augmented: Channels,
    /// What a perfect model would leave.
    pub noise_floor: Channels,
}

/// Where the gap of the refitted model sits: in which run, in which angle, under which condition.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GapShare {
    /// Name of the run, or `all`.
    pub run: String,
    /// The angle that disagrees.
    pub channel: Channel,
    /// The condition, in the field's symbols: `abs(theta_dot) < 0.3 rad/s`.
    pub condition: String,
    /// Share of the run's squared prediction error that falls under the condition, 0 to 1.
    #[serde(with = "null_if_not_finite")]
    pub share_of_gap: f64,
}

/// One recording predicted again by the models side by side, one angle of it: a row of the table of `--verify`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VerificationRow {
    /// Name of the run.
    pub run: String,
    /// The angle compared.
    pub channel: Channel,
    /// RMS error of the rig file as given, rad.
    #[serde(with = "null_if_not_finite")]
    pub nominal: f64,
    /// RMS error with refitted parameters, rad.
    #[serde(with = "null_if_not_finite")]
    pub recalibrated: f64,
    /// RMS error of the repaired model: refitted, with the named effects, rad.
    #[serde(with = "null_if_not_finite")]
    pub repaired: f64,
}

/// An experiment that would tell two explanations apart: a row of the plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlannedExperiment {
    /// What is done, in words.
    pub excitation: String,
    /// The same for the command line, behind `furuta run --task` (or `furuta simulate --input`).
    pub arguments: String,
    /// Length of the recording, s.
    pub seconds: f64,
    /// The largest voltage, V.
    pub volts: f64,
    /// Its root mean square, V.
    #[serde(default)]
    pub volts_rms: f64,
    /// Ids of the effect named and of the one that could stand in its place.
    pub separates: [String; 2],
    /// By how much the Bayesian information criterion of the wrong one is expected to be above that of the right one,
    /// whichever of the two is right: above 10 counts as very strong, below 0 the experiment tells nothing.
    #[serde(with = "null_if_not_finite")]
    pub expected_evidence: f64,
    /// The same if the first of the two is right, and if the second is.
    pub if_true: [f64; 2],
}

/// The result of `diagnose`: the JSON contract.
///
/// ```
/// use furuta_ident::diagnose::result::{Diagnosis, Verdict};
/// let mut diagnosis = Diagnosis::new(Verdict::NoGap);
/// diagnosis.gap.nominal = [0.0012, f64::NAN].into();
/// let json = diagnosis.to_json();
/// assert!(json.contains(r#""verdict": "no_gap""#) && json.contains(r#""alpha": null"#));
/// assert_eq!(Diagnosis::from_json(&json)?.gap.nominal.theta, 0.0012);
/// # Ok::<(), serde_json::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Diagnosis {
    /// Version of this contract, [`SCHEMA`].
    pub schema: u32,
    /// The answer in one word.
    pub verdict: Verdict,
    /// Effects that are missing, the strongest evidence first.
    pub effects: Vec<NamedEffect>,
    /// Effects that fit the recordings better and predict data kept apart worse; left out of the JSON where there are
    /// none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub suspected: Vec<Suspected>,
    /// An empirical expression for what no effect explains, where the verdict is `unexplained` and one helps; left out
    /// of the JSON otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub custom: Option<Expression>,
    /// A stretch of one recording in which something else happened, if what explains all else shows one: the verdict is
    /// `unexplained` then, and everything else is said of the rest. Left out of the JSON where there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub left_out: Option<LeftOut>,
    /// The zeros of the recordings' encoders, where each has its own; left out of the JSON where there is one
    /// recording.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub zeros: Vec<Zero>,
    /// The rig file's parameters by `table.key`.
    pub parameters: BTreeMap<String, ParameterEstimate>,
    /// How large each effect that was not named could still be, what is ruled out most firmly (against its typical
    /// size) first. Empty where the model that they would stand beside is wrong ([`Diagnosis::why_no_limits`]).
    #[serde(default)]
    pub limits: Vec<Limit>,
    /// Prediction error on the data given.
    pub gap: Gap,
    /// Prediction error on data kept apart; absent where there were too few.
    #[serde(default)]
    pub held_out: Option<HeldOut>,
    /// Numbers of the refitted and the repaired model that no rig has: such a model is never the best. Left out of the
    /// JSON where there are none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub at_bound: Vec<AtBound>,
    /// Which of the three models predicts data kept apart best, of those whose numbers can be: the one that is written
    /// as a rig file. The rig file as given where nothing was judged on data kept apart.
    #[serde(default)]
    pub best: Best,
    /// Where the gap of the refitted model sits, the largest share first.
    #[serde(rename = "where")]
    pub location: Vec<GapShare>,
    /// Which torque the refitted model lacks, and on what it depends most; the axis where that says most first. Left
    /// out of the JSON where no torque explains the gap.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub missing_torque: Vec<MissingTorque>,
    /// What to measure next, in a sentence.
    pub next_experiment: Option<String>,
    /// Experiments that would tell confusable effects apart, the clearest first for each pair, where they were asked
    /// for; left out of the JSON where there are none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub plan: Vec<PlannedExperiment>,
    /// Recordings of `--verify`, predicted over their whole length; left out of the JSON where there are none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub verification: Vec<VerificationRow>,
    /// The same effects in recordings of another state of the rig, where such were given (`--compare`); left out of the
    /// JSON otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub comparison: Option<Comparison>,
    /// How far samples scatter about their time stamps, where it shows; left out of the JSON otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub jitter: Option<Jitter>,
    /// What was noticed about the recordings and dealt with, one sentence each; left out of the JSON where there is
    /// nothing.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notices: Vec<String>,
    /// Whether a person ended the diagnosis before it was done: what it says holds for what was looked at.
    #[serde(default)]
    pub interrupted: bool,
    /// What was left undone then, or when the time limit was reached; left out of the JSON where there is nothing.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub unfinished: Vec<Part>,
    /// Wall-clock time that the diagnosis took, s.
    #[serde(with = "null_if_not_finite")]
    pub seconds: f64,
}

impl Diagnosis {
    /// A diagnosis with a verdict and nothing else; every number is unknown.
    #[must_use]
    pub fn new(verdict: Verdict) -> Self {
        let gap = Gap {
            unit: "rad".into(),
            horizon: f64::NAN,
            nominal: Channels::UNKNOWN,
            recalibrated: Channels::UNKNOWN,
            augmented: Channels::UNKNOWN,
            noise_floor: Channels::UNKNOWN,
        };
        Self {
            schema: SCHEMA,
            verdict,
            effects: Vec::new(),
            suspected: Vec::new(),
            custom: None,
            left_out: None,
            zeros: Vec::new(),
            parameters: BTreeMap::new(),
            limits: Vec::new(),
            gap,
            held_out: None,
            at_bound: Vec::new(),
            best: Best::Repaired,
            location: Vec::new(),
            missing_torque: Vec::new(),
            next_experiment: None,
            plan: Vec::new(),
            verification: Vec::new(),
            comparison: None,
            jitter: None,
            notices: Vec::new(),
            interrupted: false,
            unfinished: Vec::new(),
            seconds: f64::NAN,
        }
    }

    /// Leaves out what is said of an angle that does not tell of the model in this state.
    pub(super) fn forget(&mut self, state: Pendulum) {
        let [theta, alpha] = state.tells();
        let gap = &mut self.gap;
        let of_gap = [&mut gap.nominal, &mut gap.recalibrated, &mut gap.augmented];
        let held_out = self.held_out.iter_mut();
        let of_held_out =
            held_out.flat_map(|h| [&mut h.recalibrated, &mut h.augmented, &mut h.noise_floor]);
        for channels in of_gap
            .into_iter()
            .chain(of_held_out)
            .chain([&mut gap.noise_floor])
        {
            if !theta {
                channels.theta = f64::NAN;
            }
            if !alpha {
                channels.alpha = f64::NAN;
            }
        }
        for zero in &mut self.zeros {
            if !theta {
                zero.theta = f64::NAN;
            }
            if !alpha {
                zero.alpha = f64::NAN;
            }
        }
        let is_seen = |channel| match channel {
            Channel::Theta => theta,
            Channel::Alpha => alpha,
        };
        self.verification.retain(|row| is_seen(row.channel));
        self.missing_torque.retain(|torque| is_seen(torque.axis));
    }

    /// The contract as indented JSON. Numbers that are not finite become `null`.
    #[must_use]
    pub fn to_json(&self) -> String {
        // Maps have string keys and nothing here returns an error of its own, so serde_json has nothing to fail on.
        serde_json::to_string_pretty(self).unwrap_or_default()
    }

    /// Reads what [`Self::to_json`] wrote; `null` becomes `NaN`.
    ///
    /// # Errors
    /// Where the text is not JSON or lacks a field of the contract.
    pub fn from_json(json: &str) -> Result<Self, serde_json::Error> {
        serde_json::from_str(json)
    }
}

fn not_a_number() -> f64 {
    f64::NAN
}
