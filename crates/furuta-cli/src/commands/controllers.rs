//! `furuta controllers`: what a controller file may say.

use std::io::Write;

use furuta_ctrl::ControllerFile;
use furuta_ctrl::config::{SECTIONS, specs};
use furuta_ctrl::settings::{ParameterSpec, Shape, Spec};
use serde_json::{Value, json};

use crate::failure::Failure;
use crate::print;
use crate::streams;

/// List the controllers, estimators and other sections of a controller file, or explain one: its keys, their units,
/// ranges and defaults.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Controller, estimator or section to explain, for example lqr; all are listed if not given.
    #[arg(value_name = "ID")]
    id: Option<String>,
    /// Check a controller file and print what it says.
    #[arg(long, value_name = "FILE.toml", conflicts_with = "id")]
    check: Option<std::path::PathBuf>,
    /// Print JSON in place of text.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut out = streams::output();
    if let Some(path) = &args.check {
        let file = ControllerFile::load(path)?;
        if args.json {
            writeln!(out, "{}", file_json(&file))?;
        } else {
            write!(out, "{}", file.to_toml())?;
        }
        return Ok(());
    }
    let Some(id) = &args.id else {
        return list(&mut out, args.json);
    };
    let spec = specs().find(|spec| spec.id == id).ok_or_else(|| {
        let known: Vec<_> = specs().map(|spec| spec.id).collect();
        Failure::new(format!(
            "nothing is called {id:?} in a controller file: give one of {}",
            known.join(", ")
        ))
    })?;
    if args.json {
        writeln!(out, "{}", spec_json(spec))?;
        return Ok(());
    }
    explain(&mut out, spec)
}

fn list(out: &mut impl Write, as_json: bool) -> Result<(), Failure> {
    if as_json {
        let all: serde_json::Map<_, _> = SECTIONS
            .iter()
            .map(|(section, kinds)| {
                let kinds: Value = kinds.iter().map(|spec| spec_json(spec)).collect();
                ((*section).to_owned(), kinds)
            })
            .collect();
        writeln!(out, "{}", Value::Object(all))?;
        return Ok(());
    }
    for (section, kinds) in &SECTIONS {
        writeln!(out, "[{section}]")?;
        for spec in *kinds {
            writeln!(out, "  {:16} {}", spec.id, spec.sentence)?;
        }
    }
    Ok(())
}

/// The section of a controller file that it belongs to.
fn section(spec: &Spec) -> &'static str {
    let has = |(_, kinds): &&(&str, &[&Spec])| kinds.iter().any(|kind| kind.id == spec.id);
    SECTIONS.iter().find(has).map_or("", |(name, _)| *name)
}

fn explain(out: &mut impl Write, spec: &Spec) -> Result<(), Failure> {
    let section = section(spec);
    writeln!(out, "{}: {}\n\n[{section}]", spec.id, spec.sentence)?;
    if section != spec.id {
        writeln!(out, "kind = \"{}\"", spec.id)?;
    }
    for p in spec.parameters {
        writeln!(out, "{:16} {}; {}", p.name, described(p), p.sentence)?;
    }
    Ok(())
}

/// Shape, unit, range and default in a line.
fn described(p: &ParameterSpec) -> String {
    let unit = if p.unit.is_empty() {
        String::new()
    } else {
        format!(" {}", p.unit)
    };
    let range = format!("{} to {}{unit}", p.min, p.max);
    let what = match p.shape {
        Shape::Number => range,
        Shape::Numbers(n) => format!("{n} numbers, each {range}"),
        Shape::Whole => format!("whole number, {range}"),
        Shape::Switch => "true or false".to_owned(),
        Shape::Word(words) => words.join(" or "),
    };
    match (p.shape, p.default) {
        (_, None) => what,
        (Shape::Switch, Some(v)) => format!("{what}, {} if left out", v == 1.0),
        (Shape::Word(_), Some(v)) => {
            format!(
                "{what}, {} if left out",
                p.shape.word(v).unwrap_or_default()
            )
        }
        (_, Some(v)) => format!("{what}, {} if left out", print::significant(v)),
    }
}

fn spec_json(spec: &Spec) -> Value {
    let parameters: Value = spec
        .parameters
        .iter()
        .map(|p| {
            let words = match p.shape {
                Shape::Word(words) => json!(words),
                _ => Value::Null,
            };
            json!({
                "name": p.name, "unit": p.unit, "sentence": p.sentence, "numbers": p.shape.len(), "words": words,
                "whole": p.shape == Shape::Whole, "switch": p.shape == Shape::Switch, "min": p.min, "max": p.max,
                "default": p.default,
            })
        })
        .collect();
    json!({"id": spec.id, "section": section(spec), "sentence": spec.sentence, "parameters": parameters})
}

fn file_json(file: &ControllerFile) -> Value {
    let sections: serde_json::Map<_, _> = SECTIONS
        .iter()
        .zip(file.config.sections())
        .map(|((section, _), settings)| {
            let given: serde_json::Map<_, _> = settings
                .given()
                .map(|(p, values)| (p.name.to_owned(), json!(values)))
                .collect();
            let entry = json!({"kind": settings.spec().id, "given": given});
            ((*section).to_owned(), entry)
        })
        .collect();
    json!({"made_for": {"rig": file.made_for.rig, "rate": file.made_for.rate}, "sections": sections})
}
