//! What is said of a hypothesis: its entry beside those of the catalogue, and its lines in a file.

use super::define::{Definition, LAWS, Parameter, Side, Tapes};
use super::registry::leak;
use super::tape::{Operation, Variable};
use crate::effects::{Acts, AtRest, Footprint, Kind, ParameterSpec, Spec, Typical};
use std::fmt::Write as _;

impl Definition {
    pub(super) fn spec(&self, id: &'static str, parameters: &[Parameter], tapes: &Tapes) -> Spec {
        let name = if self.name.is_empty() {
            id
        } else {
            leak(&self.name)
        };
        let laws = LAWS.iter().filter_map(|key| {
            let text = self.law(key)?;
            Some(match (&self.state, *key) {
                (Some(state), "state.rate") => format!("d{}/dt = {text}", state.name),
                _ => format!("{key}: {text}"),
            })
        });
        let uses = |wanted: &[Variable]| {
            let all = tapes.iter().flat_map(|t| &t.operations);
            let mut seen = all.filter_map(|o| match o {
                Operation::Variable(v) => Some(v),
                _ => None,
            });
            seen.any(|v| wanted.contains(v))
        };
        let kinked = |o: &Operation| matches!(o, Operation::Abs | Operation::Min | Operation::Max);
        let [arm, pendulum, voltage, state] = tapes.each_ref().map(|t| !t.operations.is_empty());
        let mut acts = Acts::NOWHERE;
        let mut add = |when: bool, what: Acts| {
            if when {
                acts = acts.and(what);
            }
        };
        let on_motor = self.side == Side::Motor;
        add((arm || pendulum) && !state, Acts::TORQUE);
        add(state, Acts::INNER.and(Acts::STATE));
        add(on_motor, Acts::SHAFT);
        add(arm && !pendulum && !voltage && !on_motor, Acts::ARM);
        add(voltage, Acts::VOLTAGE);
        add(uses(&[Variable::Theta]), Acts::ANGLE);
        let timed = uses(&[Variable::T]);
        add(timed, Acts::CLOCK);
        Spec {
            id,
            name,
            law: leak(&laws.collect::<Vec<_>>().join("; ")),
            sentence: "A law that the user wrote; what it stands for is in its name and its text.",
            shows: "What is left of the gap follows the law.",
            experiment: if self.experiment.is_empty() {
                "motions in which its law differs most from what it could be confused with"
            } else {
                leak(&self.experiment)
            },
            look_alikes: &[],
            strengths: parameters
                .iter()
                .filter(|p| p.strength == Some(true))
                .count(),
            parameters: Vec::leak(parameters.iter().map(parameter).collect()),
            footprint: if timed {
                Footprint::UNCOMMANDED
            } else {
                Footprint::Nothing(
                    "a law of the user's own is looked for in motions, not in frequency responses",
                )
            },
            acts,
            at_rest: if timed {
                AtRest::UNCOMMANDED
            } else if state {
                AtRest::LeftOut("it depends on a state of its own, which the matrices do not have")
            } else if tapes[2].operations.iter().any(kinked) {
                AtRest::KINKED
            } else {
                AtRest::Slope
            },
            own: None,
            offered: crate::effects::Offered::OnRequest("it is a user's own law"),
        }
    }

    /// The lines of its table in a file: what is written can be read, and is the same.
    pub(super) fn to_toml(&self, parameters: &[Parameter]) -> String {
        let mut out = String::new();
        let text = |s: &str| toml::Value::from(s).to_string();
        // Writing to a String cannot fail.
        for (key, value) in [("name", &self.name), ("experiment", &self.experiment)] {
            if !value.is_empty() {
                let _ = writeln!(out, "{key} = {}", text(value));
            }
        }
        for key in &LAWS[..3] {
            if let Some(law) = self.law(key) {
                let _ = writeln!(out, "{key} = {}", text(law));
            }
        }
        if self.side == Side::Motor {
            let _ = writeln!(out, "side = \"motor\"");
        }
        if let Some(state) = &self.state {
            let _ = writeln!(
                out,
                "state = {{ name = {}, unit = {}, rate = {}, start = {:?} }}",
                text(&state.name),
                text(&state.unit),
                text(&state.rate),
                state.start
            );
        }
        for p in parameters {
            let _ = write!(
                out,
                "parameters.{} = {{ unit = {}, min = {:?}, max = {:?}, typical = {:?}",
                p.name,
                text(&p.unit),
                p.min,
                p.max,
                p.typical
            );
            if p.off != 0.0 {
                let _ = write!(out, ", off = {:?}", p.off);
            }
            if p.strength == Some(true) {
                let _ = write!(out, ", strength = true");
            }
            if !p.starts.is_empty() {
                let _ = write!(out, ", starts = {:?}", p.starts);
            }
            let _ = writeln!(out, " }}");
        }
        for c in &self.constants {
            let _ = writeln!(
                out,
                "constants.{} = {{ value = {:?}, unit = {} }}",
                c.name,
                c.value,
                text(&c.unit)
            );
        }
        out
    }
}

/// What a search knows of a parameter.
fn parameter(p: &Parameter) -> ParameterSpec {
    let multiples = |x: &f64| (x - p.off) / p.typical;
    let starts: &'static [f64] = if !p.starts.is_empty() {
        Vec::leak(p.starts.iter().map(multiples).collect())
    } else if p.strength != Some(true) {
        &[1.0]
    } else if p.min >= p.off {
        &[0.3]
    } else if p.max <= p.off {
        &[-0.3]
    } else {
        &[0.0]
    };
    ParameterSpec {
        name: leak(&p.name),
        unit: leak(p.unit.trim()),
        kind: Kind::Real,
        default: None,
        min: p.min,
        max: p.max,
        off: p.off,
        typical: Typical::Is(p.typical),
        starts,
    }
}
