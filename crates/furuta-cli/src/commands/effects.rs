//! `furuta effects`: what a real rig does and the rigid-body equations leave out, and how to tell.

use std::io::Write;

use furuta_model::effects::{self, Kind, Offered, ParameterSpec, own};
use furuta_model::{Actuation, Rig, Spec};
use serde_json::{Value, json};

use crate::failure::Failure;
use crate::print;
use crate::streams;

/// List the effects that can be simulated, hidden and found, or explain one: law, how it shows, look-alikes, the
/// experiment that tells.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Effect to explain, for example arm.coulomb, or a file with laws of your own (its name ends in .toml); all are
    /// listed if not given.
    #[arg(value_name = "ID|FILE.toml")]
    id: Option<String>,
    /// Rig on which the typical sizes are; qube-servo-2 if not given, or stepper-kit for what only stepper motors do.
    #[arg(long, value_name = "RIG", requires = "id")]
    rig: Option<String>,
    /// Print JSON in place of text.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut out = streams::output();
    let Some(id) = &args.id else {
        return list(&mut out, args.json);
    };
    for (n, spec) in entries(id)?.into_iter().enumerate() {
        let name = args.rig.as_deref().unwrap_or_else(|| usual(spec));
        let rig = Rig::load(name)?;
        if args.json {
            writeln!(out, "{}", explained_json(spec, &rig))?;
            continue;
        }
        if n > 0 {
            writeln!(out)?;
        }
        explain(&mut out, spec, &rig, (name, id.as_str()))?;
    }
    Ok(())
}

/// A rig that can have the effect.
fn usual(spec: &Spec) -> &'static str {
    match spec.acts.not_on(Actuation::Voltage) {
        None => "qube-servo-2",
        Some(_) => "stepper-kit",
    }
}

/// The entry of this id, or the laws of this file.
fn entries(id: &str) -> Result<Vec<&'static Spec>, Failure> {
    if id.ends_with(".toml") {
        return own::load(id).map_err(|e| Failure::new(e.to_string()));
    }
    let spec = effects::spec(id).ok_or_else(|| {
        let known: Vec<_> = effects::all().map(|s| s.id).collect();
        Failure::new(format!(
            "unknown effect {id:?}: give a file with laws of your own (its name ends in .toml), or one of {}",
            known.join(", ")
        ))
    })?;
    Ok(vec![spec])
}

fn list(out: &mut impl Write, as_json: bool) -> Result<(), Failure> {
    if as_json {
        let all: Value = effects::all()
            .map(|s| {
                let parameters: Value = s
                    .parameters
                    .iter()
                    .map(|p| json!({"name": p.name, "unit": p.unit}))
                    .collect();
                json!({"id": s.id, "name": s.name, "parameters": parameters, "offered": s.offered.word(),
                    "kinds": s.acts.kinds().collect::<Vec<_>>()})
            })
            .collect();
        writeln!(out, "{all}")?;
        return Ok(());
    }
    for s in effects::all() {
        let parameters: Vec<_> = s
            .parameters
            .iter()
            .map(|p| match p.kind {
                Kind::Choice(words) => format!("{} [{}]", p.name, words.join(" or ")),
                _ if p.unit == "-" => p.name.to_owned(),
                _ => format!("{} [{}]", p.name, p.unit),
            })
            .collect();
        writeln!(out, "{:29} {:44} {}", s.id, s.name, parameters.join(", "))?;
    }
    Ok(())
}

/// `given` is how rig and effect were named on the command line.
fn explain(
    out: &mut impl Write,
    spec: &Spec,
    rig: &Rig,
    given: (&str, &str),
) -> Result<(), Failure> {
    writeln!(out, "{}: {}\n{}\n", spec.id, spec.name, spec.sentence)?;
    writeln!(out, "law           {}", spec.law)?;
    writeln!(out, "shows         {}", spec.shows)?;
    if !spec.look_alikes.is_empty() {
        writeln!(out, "looks like    {}", spec.look_alikes.join(", "))?;
    }
    writeln!(out, "to tell       {}", spec.experiment)?;
    let kinds: Vec<_> = spec.acts.kinds().collect();
    writeln!(out, "rigs          motor.kind = {}", kinds.join(", "))?;
    let (id, why) = (given.1, spec.offered.why());
    match spec.offered {
        Offered::Always => {}
        Offered::OnRequest(_) => writeln!(
            out,
            "looked for    where others leave something, or with furuta diagnose --candidate {id}: {why}"
        )?,
        Offered::Never(_) => writeln!(out, "looked for    never: {why}")?,
    }
    writeln!(out)?;
    for p in spec.parameters {
        writeln!(out, "  {:14}{}", p.name, described(p, rig))?;
    }
    let hide: Vec<_> = spec
        .parameters
        .iter()
        .filter(|p| p.default.is_none())
        .map(|p| format!("{}={}", p.name, written(p, typical(p, rig))))
        .collect();
    writeln!(
        out,
        "\nfuruta simulate --rig {} --hide {}:{}",
        given.0,
        if spec.own.is_some() {
            format!("{}#{}", given.1, spec.id)
        } else {
            spec.id.to_owned()
        },
        hide.join(",")
    )?;
    Ok(())
}

/// Unit, range, default and typical size in a line.
fn described(p: &ParameterSpec, rig: &Rig) -> String {
    let default = p
        .default
        .map(|v| format!("; {} if not given", written(p, v)))
        .unwrap_or_default();
    if let Kind::Choice(words) = p.kind {
        return format!("{}{default}", words.join(" or "));
    }
    let unit = match (p.kind.is_whole(), p.unit) {
        (true, _) => "whole number",
        (false, "-") => "number",
        (false, unit) => unit,
    };
    format!(
        "{unit}, {} to {}{default}; typical on {}: {}",
        p.min,
        p.max,
        rig.name,
        written(p, typical(p, rig))
    )
}

/// A value that would be noticed on this rig.
fn typical(p: &ParameterSpec, rig: &Rig) -> f64 {
    p.off + p.typical(&rig.params)
}

/// A value as one writes it: a word where there is one.
fn written(p: &ParameterSpec, value: f64) -> String {
    p.word(value)
        .map_or_else(|| print::significant(value), str::to_owned)
}

fn explained_json(spec: &Spec, rig: &Rig) -> Value {
    let parameters: Value = spec
        .parameters
        .iter()
        .map(|p| {
            let value = |v: f64| p.word(v).map_or_else(|| json!(v), |word| json!(word));
            let choices = match p.kind {
                Kind::Choice(words) => json!(words),
                _ => Value::Null,
            };
            json!({
                "name": p.name, "unit": p.unit, "choices": choices,
                "whole": choices.is_null() && p.kind.is_whole(), "min": p.min, "max": p.max,
                "off": value(p.off), "default": p.default.map(value), "typical": value(typical(p, rig)),
            })
        })
        .collect();
    json!({
        "id": spec.id, "name": spec.name, "law": spec.law, "sentence": spec.sentence, "shows": spec.shows,
        "look_alikes": spec.look_alikes,
        "offered": spec.offered.word(), "kinds": spec.acts.kinds().collect::<Vec<_>>(),
        "experiment": spec.experiment, "rig": rig.name, "parameters": parameters,
    })
}
