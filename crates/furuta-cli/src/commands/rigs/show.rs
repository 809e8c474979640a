//! One rig, as text and as JSON.

use std::fmt::Write as _;

use furuta_ctrl::design::{self, Controllability};
use furuta_model::Actuation;
use furuta_model::params::RANGES;
use furuta_model::{Linear, Rig, State, linearize};
use nalgebra::Complex;
use serde_json::{Map, Value, json};

use super::published;
use crate::failure::Failure;
use crate::print;

/// The rig's linear model at an equilibrium, its effects left out, and what follows from it.
struct Equilibrium {
    name: &'static str,
    linear: Linear,
    poles: Vec<Complex<f64>>,
    controllability: Controllability<f64, 4>,
}

impl Equilibrium {
    fn both(rig: &Rig) -> Result<[Self; 2], Failure> {
        Ok([
            Self::of(rig, "upright", State::upright())?,
            Self::of(rig, "hanging", State::hanging())?,
        ])
    }

    fn of(rig: &Rig, name: &'static str, x: State<f64>) -> Result<Self, Failure> {
        let linear = linearize(&rig.nominal_plant(), x, 0.0);
        let poles = design::poles(&linear.a).ok_or_else(|| {
            Failure::new(format!("rig {}: its poles cannot be computed", rig.name))
        })?;
        let controllability = design::controllability(&linear.a, &linear.b)
            .map_err(|e| Failure::new(format!("rig {}: {e}", rig.name)))?;
        Ok(Self {
            name,
            linear,
            poles: poles.to_vec(),
            controllability,
        })
    }
}

fn limits(rig: &Rig) -> [(&'static str, Option<f64>, &'static str); 3] {
    [
        ("arm_angle", rig.limits.arm_angle, "rad"),
        ("arm_speed", rig.limits.arm_speed, "rad/s"),
        ("pendulum_speed", rig.limits.pendulum_speed, "rad/s"),
    ]
}

/// The rig as one JSON object.
pub(super) fn json(rig: &Rig) -> Result<Value, Failure> {
    let actuation = rig.params.motor.actuation;
    let parameters: Map<String, Value> = RANGES
        .iter()
        .zip(rig.params.to_array())
        .filter(|(r, _)| actuation.uses(r.key))
        .map(|(r, v)| {
            let share = rig.tolerance.share(r.key);
            (
                r.key.to_owned(),
                json!({"value": v, "unit": r.unit_for(actuation), "tolerance": share}),
            )
        })
        .collect();
    let effects: Map<String, Value> = rig
        .effects
        .iter()
        .map(|e| {
            let spec = e.spec();
            let values: Map<String, Value> = spec
                .parameters
                .iter()
                .zip(e.values())
                .map(|(p, v)| {
                    (
                        p.name.to_owned(),
                        json!({"value": v, "unit": actuation.unit_of(p.unit)}),
                    )
                })
                .collect();
            (spec.id.to_owned(), Value::Object(values))
        })
        .collect();
    let linearisation: Map<String, Value> = Equilibrium::both(rig)?
        .iter()
        .map(|e| {
            let c = &e.controllability;
            let value = json!({
                "a": print::matrix_json(&e.linear.a), "b": e.linear.b.as_slice(), "poles": print::poles_json(&e.poles),
                // An infinite condition is null in JSON.
                "controllability": {"rank": c.rank, "condition": c.condition()},
            });
            (e.name.to_owned(), value)
        })
        .collect();
    Ok(json!({
        "name": rig.name, "source": rig.source, "motor": {"kind": actuation.kind(), "unit": actuation.unit()},
        "parameters": parameters,
        "sensors": {"arm_counts_per_rev": rig.sensors.arm_counts_per_rev,
            "pendulum_counts_per_rev": rig.sensors.pendulum_counts_per_rev},
        "limits": limits(rig).iter().map(|(name, value, _)| ((*name).to_owned(), json!(value))).collect::<Map<_, _>>(),
        "effects": effects, "linearisation": linearisation, "published": published::json(rig),
    }))
}

/// The rig for a reader.
pub(super) fn text(rig: &Rig) -> Result<String, Failure> {
    let mut out = format!("{}\n{}\n\n", rig.name, rig.source);
    // Writing to a String cannot fail.
    let _ = writeln!(
        out,
        "  (±: one standard deviation of the sheet, [tolerance] in the rig file; ?: a guess)"
    );
    let actuation = rig.params.motor.actuation;
    if actuation != Actuation::Voltage {
        let what = format!("{actuation}, in {}", actuation.unit());
        let _ = writeln!(out, "  {:30} {what:>12}", "motor.kind");
    }
    let all = RANGES.iter().zip(rig.params.to_array());
    for (range, value) in all.filter(|(range, _)| actuation.uses(range.key)) {
        let known = match rig.tolerance.share(range.key) {
            Some(share) if share > 0.0 => format!("± {} %", print::significant(100.0 * share)),
            Some(_) => String::new(),
            None => "± ?".to_owned(),
        };
        let line = format!(
            "  {:30} {value:12} {:8} {known}",
            range.key,
            range.unit_for(actuation)
        );
        let _ = writeln!(out, "{}", line.trim_end());
    }
    let [arm, pendulum] = rig.sensors.resolution();
    let _ = writeln!(
        out,
        "  {:30} {arm:12.6} rad, pendulum {pendulum:.6} rad",
        "encoders, arm"
    );
    for (name, value, unit) in limits(rig) {
        if let Some(value) = value {
            let _ = writeln!(out, "  {:30} {value:12} {unit}", format!("limits.{name}"));
        }
    }
    for effect in &rig.effects {
        let spec = effect.spec();
        for (p, v) in spec.parameters.iter().zip(effect.values()) {
            let key = format!("{}.{}", spec.id, p.name);
            let _ = writeln!(out, "  {key:30} {v:12} {}", actuation.unit_of(p.unit));
        }
    }
    let left_out = match rig.effects.len() {
        0 => "the rig has no effects beyond it".to_owned(),
        n => format!("the rig's {n} effect(s) left out"),
    };
    let _ = writeln!(
        out,
        "\ndx/dt = A x + B u, x = [theta, alpha, theta_dot, alpha_dot] from the equilibrium; rigid-body \
         model, {left_out}"
    );
    for e in Equilibrium::both(rig)? {
        let (a, b) = (print::matrix(&e.linear.a), print::matrix(&e.linear.b));
        let _ = write!(out, "\n{}\n  A\n{a}  B\n{b}", e.name);
        let _ = writeln!(out, "  poles  {} rad/s", print::poles(&e.poles));
        let c = &e.controllability;
        let word = match c.is_full() {
            true => format!(
                "yes, rank 4 of 4, condition {}",
                print::significant(c.condition())
            ),
            false => format!("no, rank {} of 4", c.rank),
        };
        let _ = writeln!(out, "  controllable  {word}");
    }
    out.push_str(&published::text(rig));
    Ok(out)
}
