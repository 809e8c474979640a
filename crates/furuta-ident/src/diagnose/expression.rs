//! What is reported of an empirical expression.

use std::collections::BTreeMap;

use furuta_model::effects::Term;
use serde::{Deserialize, Serialize};

use super::result::{Channels, Estimate};
use crate::answer::{null_if_not_finite, significant};

/// An expression for what no effect explains, fitted to the recordings: it imitates, it does not explain.
///
/// ```
/// use furuta_ident::diagnose::result::{Channels, Expression};
/// let (without, with) = ([0.02, 0.01].into(), [0.012, 0.006].into());
/// let nothing = Expression { terms: vec![], held_out_gain: 0.63, without, with };
/// assert!(nothing.sentence().contains("63 %"));
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Expression {
    /// What it is the sum of.
    pub terms: Vec<CustomTerm>,
    /// Share of the squared prediction error on held-out data that it removes beside the named effects, at most 1.
    #[serde(with = "null_if_not_finite")]
    pub held_out_gain: f64,
    /// RMS error of prediction on held-out data with the named effects alone, rad.
    pub without: Channels,
    /// The same with the expression, rad.
    pub with: Channels,
}

/// One term of it, as the rig file has it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CustomTerm {
    /// Its table in the rig file, `custom.1` and so on.
    pub id: String,
    /// The torque in N m: `-0.0021*theta_dot*abs(theta_dot)`, angles in rad, speeds in rad/s, `u` the motor's voltage
    /// in V.
    pub expression: String,
    /// The axis it acts on, `arm` or `pendulum`.
    pub on: String,
    /// Fitted parameters by the names that the rig file uses.
    pub parameters: BTreeMap<String, Estimate>,
}

impl CustomTerm {
    /// From the parameters as fitted; the coefficient gets the unit that the term leaves it.
    pub(super) fn new(id: &str, term: &Term, mut parameters: BTreeMap<String, Estimate>) -> Self {
        let mut expression = String::new();
        if let Some(coefficient) = parameters.get_mut("coefficient") {
            coefficient.unit = match term.unit {
                "1" => "N m".into(),
                unit => format!("N m/({unit})"),
            };
            expression = significant(coefficient.value, 3);
        }
        if term.word != "1" {
            expression = format!("{expression}*{}", term.word);
        }
        let on = parameters.get("on").and_then(|on| on.word.clone());
        Self {
            id: id.to_owned(),
            expression,
            on: on.unwrap_or_default(),
            parameters,
        }
    }
}

impl Expression {
    /// The torques on one axis in a line, `arm: -0.0021*theta_dot*abs(theta_dot) + 0.003*u*theta`; axes without one are
    /// left out.
    #[must_use]
    pub fn torques(&self) -> Vec<String> {
        ["arm", "pendulum"]
            .into_iter()
            .filter_map(|axis| {
                let terms: Vec<&str> = self
                    .terms
                    .iter()
                    .filter(|t| t.on == axis)
                    .map(|t| t.expression.as_str())
                    .collect();
                let sum = terms.join(" + ").replace("+ -", "- ");
                (!terms.is_empty()).then(|| format!("{axis}: {sum}"))
            })
            .collect()
    }

    /// What it does and what it is not, in a sentence.
    #[must_use]
    pub fn sentence(&self) -> String {
        format!(
            "An empirical expression, fitted and no law of physics, takes {:.0} % of the squared error that is left on \
             held-out data.",
            100.0 * self.held_out_gain
        )
    }
}
