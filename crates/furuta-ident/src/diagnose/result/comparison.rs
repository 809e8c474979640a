//! Two states of one rig held against each other.

use serde::{Deserialize, Serialize};

use super::{Estimate, Verdict, plain, significant};
use crate::answer::null_if_not_finite;

/// A difference of more than this many of its standard deviations is one: noise makes so large a one once in 16,000.
const DIFFERS: f64 = 4.0;

/// What recordings of the rig in another state say of the effects named in either.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// Names of the recordings of the other state.
    pub there: Vec<String>,
    /// The verdict on them.
    pub verdict: Verdict,
    /// Ids of the effects named from them.
    pub named: Vec<String>,
    /// The numbers of all effects named in either state.
    pub differences: Vec<Difference>,
}

/// One number of an effect in both states, each fitted beside all that was named in either.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Difference {
    /// Id of the effect.
    pub id: String,
    /// Name of its parameter.
    pub parameter: String,
    /// From the recordings that were diagnosed.
    pub here: Estimate,
    /// From those of the other state.
    pub there: Estimate,
    /// `here` less `there`, in standard deviations of that difference.
    #[serde(with = "null_if_not_finite")]
    pub deviations: f64,
    /// Whether the two differ.
    pub differs: bool,
}

impl Difference {
    pub(crate) fn new(id: &str, parameter: &str, here: Estimate, there: Estimate) -> Self {
        let deviations = (here.value - there.value) / here.std.hypot(there.std);
        Self {
            id: id.to_owned(),
            parameter: parameter.to_owned(),
            here,
            there,
            deviations,
            differs: deviations.abs() > DIFFERS,
        }
    }

    /// `arm.spring stiffness: 0.0020 ± 1e-5 here, 2e-6 ± 1e-5 there [N m/rad]: differs (180 standard deviations)`.
    #[must_use]
    pub fn sentence(&self) -> String {
        let value =
            |e: &Estimate| format!("{} ± {}", significant(e.value, 3), significant(e.std, 2));
        let unit = match plain(&self.here.unit) {
            "" => String::new(),
            unit => format!(" [{unit}]"),
        };
        let word = if self.differs {
            "differs"
        } else {
            "no difference shows"
        };
        format!(
            "{} {}: {} here, {} there{unit}: {word} ({} standard deviations)",
            self.id,
            self.parameter,
            value(&self.here),
            value(&self.there),
            significant(self.deviations.abs(), 2)
        )
    }
}

impl Comparison {
    /// The comparison in lines.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        let named = match self.named.as_slice() {
            [] => "nothing is named".to_owned(),
            ids => format!("named: {}", ids.join(", ")),
        };
        let mut out = vec![format!(
            "Against {} ({named}; verdict {}):",
            self.there.join(", "),
            self.verdict
        )];
        if self.differences.is_empty() {
            out.push("  no effect is named in either state: nothing differs".into());
        }
        out.extend(
            self.differences
                .iter()
                .map(|d| format!("  {}", d.sentence())),
        );
        out
    }
}
