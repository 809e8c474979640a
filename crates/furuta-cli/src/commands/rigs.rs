//! `furuta rigs`: what rigs there are, and what one is.

use std::io::Write;

use furuta_ctrl::design;
use furuta_model::params::RANGES;
use furuta_model::{Linear, Rig, State, linearize};
use serde_json::{Map, Value, json};

use crate::failure::Failure;
use crate::print;

/// List the built-in rigs, or show one: parameters, limits, effects, linearisation and poles upright and hanging.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Built-in rig or rig file to show; all built-in rigs are listed if not given.
    #[arg(value_name = "NAME")]
    name: Option<String>,
    /// Print the rig as a rig file, to start an own one from.
    #[arg(long, requires = "name", conflicts_with = "json")]
    toml: bool,
    /// Print JSON in place of text.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    match &args.name {
        None => list(args.json),
        Some(name) if args.toml => {
            let text = match Rig::builtin_text(name) {
                Some(text) => text.to_owned(),
                None => Rig::load(name)?.to_toml(),
            };
            Ok(std::io::stdout().lock().write_all(text.as_bytes())?)
        }
        Some(name) => show(&Rig::load(name)?, args.json),
    }
}

fn list(as_json: bool) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    let rigs = Rig::BUILTIN.iter().filter_map(|name| Rig::builtin(name));
    if as_json {
        let rigs: Value = rigs
            .map(|r| json!({"name": r.name, "source": r.source}))
            .collect();
        writeln!(out, "{rigs}")?;
    } else {
        for rig in rigs {
            writeln!(out, "{:20} {}", rig.name, rig.source)?;
        }
    }
    Ok(())
}

/// Linear model at an equilibrium, and its poles.
fn linear(rig: &Rig, x: State<f64>) -> Result<(Linear, Vec<nalgebra::Complex<f64>>), Failure> {
    let linear = linearize(&rig.nominal_plant(), x, 0.0);
    let poles = design::poles(&linear.a)
        .ok_or_else(|| Failure::new(format!("rig {}: its poles cannot be computed", rig.name)))?;
    Ok((linear, poles.to_vec()))
}

fn show(rig: &Rig, as_json: bool) -> Result<(), Failure> {
    let equilibria = [("upright", State::upright()), ("hanging", State::hanging())];
    let values = rig.params.to_array();
    let limits = [
        ("arm_angle", rig.limits.arm_angle, "rad"),
        ("arm_speed", rig.limits.arm_speed, "rad/s"),
        ("pendulum_speed", rig.limits.pendulum_speed, "rad/s"),
    ];
    let mut out = std::io::stdout().lock();
    if as_json {
        let parameters: Map<String, Value> = RANGES
            .iter()
            .zip(values)
            .map(|(r, v)| (r.key.to_owned(), json!({"value": v, "unit": r.unit})))
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
                    .map(|(p, v)| (p.name.to_owned(), json!({"value": v, "unit": p.unit})))
                    .collect();
                (spec.id.to_owned(), Value::Object(values))
            })
            .collect();
        let mut linearisation = Map::new();
        for (name, x) in equilibria {
            let (l, poles) = linear(rig, x)?;
            linearisation.insert(
                name.to_owned(),
                json!({"a": print::matrix_json(&l.a), "b": l.b.as_slice(), "poles": print::poles_json(&poles)}),
            );
        }
        let line = json!({
            "name": rig.name, "source": rig.source, "parameters": parameters,
            "sensors": {"arm_counts_per_rev": rig.sensors.arm_counts_per_rev, "pendulum_counts_per_rev": rig.sensors.pendulum_counts_per_rev},
            "limits": limits.iter().map(|(name, value, _)| ((*name).to_owned(), json!(value))).collect::<Map<_, _>>(),
            "effects": effects, "linearisation": linearisation,
        });
        writeln!(out, "{line}")?;
        return Ok(());
    }
    writeln!(out, "{}\n{}\n", rig.name, rig.source)?;
    for (range, value) in RANGES.iter().zip(values) {
        writeln!(out, "  {:30} {value:12} {}", range.key, range.unit)?;
    }
    let [arm, pendulum] = rig.sensors.resolution();
    writeln!(
        out,
        "  {:30} {arm:12.6} rad, pendulum {pendulum:.6} rad",
        "encoders, arm"
    )?;
    for (name, value, unit) in limits {
        if let Some(value) = value {
            writeln!(out, "  {:30} {value:12} {unit}", format!("limits.{name}"))?;
        }
    }
    for effect in &rig.effects {
        let spec = effect.spec();
        for (p, v) in spec.parameters.iter().zip(effect.values()) {
            writeln!(
                out,
                "  {:30} {v:12} {}",
                format!("{}.{}", spec.id, p.name),
                p.unit
            )?;
        }
    }
    writeln!(
        out,
        "\ndx/dt = A x + B u, x = [theta, alpha, theta_dot, alpha_dot] from the equilibrium, effects left out"
    )?;
    for (name, x) in equilibria {
        let (l, poles) = linear(rig, x)?;
        write!(
            out,
            "\n{name}\n  A\n{}  B\n{}",
            print::matrix(&l.a),
            print::matrix(&l.b)
        )?;
        writeln!(out, "  poles  {} rad/s", print::poles(&poles))?;
    }
    Ok(())
}
