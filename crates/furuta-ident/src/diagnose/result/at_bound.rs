//! Numbers of a fitted model that no rig has.

use serde::{Deserialize, Serialize};

use super::{Best, Diagnosis, Part, Verdict, plain, significant};
use crate::answer::null_if_not_finite;

/// A number of a fitted model that stands at a bound of what a rig can have: something else took its place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AtBound {
    /// Whether the refitted or the repaired model has it.
    pub model: Best,
    /// `table.key` of the rig file, or an effect's id and its parameter.
    pub parameter: String,
    /// The value, in `unit`.
    #[serde(with = "null_if_not_finite")]
    pub value: f64,
    /// SI unit, `1` where there is none.
    pub unit: String,
    /// What the bound means.
    pub reason: String,
}

impl AtBound {
    /// `0.0105 N m/A: a quarter of the rig file's`.
    #[must_use]
    pub fn text(&self) -> String {
        let value = format!("{} {}", significant(self.value, 3), plain(&self.unit));
        format!("{}: {}", value.trim_end(), self.reason)
    }
}

impl Diagnosis {
    fn is_at_bound(&self, model: Best) -> bool {
        self.at_bound.iter().any(|b| b.model == model)
    }

    /// Each number at a bound once: where nothing is added to the refitted model, the repaired one is the same.
    pub fn bounds(&self) -> impl Iterator<Item = &AtBound> {
        let earlier = |i: usize, here: &AtBound| {
            let mut before = self.at_bound[..i].iter();
            before.any(|b| b.parameter == here.parameter && b.text() == here.text())
        };
        let all = self.at_bound.iter().enumerate();
        all.filter(move |(i, b)| !earlier(*i, b)).map(|(_, b)| b)
    }

    /// Whether the repaired model has this number at a bound, too.
    #[must_use]
    pub fn keeps(&self, bound: &AtBound) -> bool {
        let mut of_repaired = self.at_bound.iter().filter(|b| b.model == Best::Repaired);
        of_repaired.any(|b| b.parameter == bound.parameter)
    }

    /// What a repaired rig file holds, and why, where it is not the repaired model.
    #[must_use]
    pub fn written(&self) -> Option<String> {
        let what = match self.best {
            Best::Repaired => return None,
            Best::Refitted => "the rig file with refitted parameters",
            Best::Given => "the rig file as given",
        };
        if self.held_out.is_none() {
            return Some(format!(
                "Nothing was judged on data kept apart: a repaired rig file holds {what}."
            ));
        }
        let impossible = [Best::Refitted, Best::Repaired].map(|model| self.is_at_bound(model));
        if impossible == [true, true] {
            return Some(format!(
                "The fitted models have numbers that cannot be: a repaired rig file holds {what}."
            ));
        }
        let of = match impossible {
            [false, false] => "On data kept apart",
            [true, false] => "The refitted model has numbers that cannot be; on data kept apart",
            _ => "The repaired model has numbers that cannot be; on data kept apart",
        };
        let rest = match self.best {
            Best::Given => {
                "it is what a repaired rig file holds. If the pendulum was balanced, the controller hid what it \
                 suppresses: record it hanging, with a test signal"
            }
            _ => "it is what a repaired rig file holds, without the effects",
        };
        let best = if impossible[1] && self.best == Best::Given {
            "predicts better than the refitted one"
        } else {
            "predicts best"
        };
        Some(format!("{of} {what} {best}: {rest}."))
    }

    /// Why no limits are stated of effects that are not named, where the model that they would stand beside is wrong.
    #[must_use]
    pub fn why_no_limits(&self) -> Option<&'static str> {
        if self.is_at_bound(Best::Repaired) {
            Some(
                "How large effects that are not named could be is not said: the fitted model has numbers that cannot \
                 be.",
            )
        } else if self.best == Best::Given && self.verdict == Verdict::Unexplained {
            Some(
                "How large effects that are not named could be is not said: something remains, and the rig file as \
                 given predicts best.",
            )
        } else {
            None
        }
        .filter(|_| !self.unfinished.contains(&Part::Limits))
    }
}
