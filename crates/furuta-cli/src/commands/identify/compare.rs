//! `furuta identify compare`: what a measured transfer function knows that a rig file does not.

use std::io::Write;
use std::path::PathBuf;

use furuta_ident::frequency::compare::{self, Explanation, Measured};
use furuta_ident::frequency::first_principles::Output;
use furuta_ident::frequency::words::csv;
use furuta_ident::frequency::{Transfer, fong2014};
use furuta_ident::report;
use furuta_model::effects::{BaseParameter, Footprint};
use furuta_model::{CATALOGUE, Rig};
use nalgebra::Complex;
use serde_json::{Value, json};

use super::frf::Measure;
use crate::failure::Failure;
use crate::outputs;
use crate::streams::{self, note};

/// Which effects of the catalogue explain what a measured transfer function has and the rig file has not: each with a
/// linear footprint is fitted, alone and together with others, beside the rig's refitted parameters, and ranked by
/// evidence.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Recordings to measure the response from, in place of a transfer function.
    #[arg(value_name = "DATA", conflicts_with_all = ["published", "numerator", "denominator"],
        required_unless_present_any = ["published", "numerator"])]
    data: Vec<PathBuf>,
    /// Built-in rig or rig file.
    #[arg(long, value_name = "RIG")]
    rig: String,
    /// A published transfer function: `fong2014`, equation (29).
    #[arg(long, value_name = "PAPER", conflicts_with = "numerator", value_parser = ["fong2014"])]
    published: Option<String>,
    /// CoefficientList of the measured numerator by falling power of s.
    #[arg(long, value_name = "B,...", value_parser = coefficients, allow_hyphen_values = true,
        requires = "denominator")]
    numerator: Option<CoefficientList>,
    /// The same of the denominator.
    #[arg(long, value_name = "A,...", value_parser = coefficients, allow_hyphen_values = true, requires = "numerator")]
    denominator: Option<CoefficientList>,
    #[command(flatten)]
    measure: Measure,
    /// Draw what was measured, the rig as given, its parameters refitted and the best explanation (SVG).
    #[arg(long, value_name = "OUT.svg", value_parser = outputs::picture())]
    plot: Option<outputs::Output>,
    /// Write what was measured, the rig as given, its parameters refitted and the best explanation, line by line (CSV).
    #[arg(long, value_name = "OUT.csv", value_parser = outputs::data())]
    csv: Option<outputs::Output>,
    /// Write a report, one HTML page that needs no network: the plot, what should be known, the ranking.
    #[arg(long, value_name = "OUT.html", value_parser = outputs::page())]
    report: Option<outputs::Output>,
    /// Print one line of JSON in place of text.
    #[arg(long)]
    json: bool,
}

/// CoefficientList by falling power.
#[derive(Clone, Debug)]
struct CoefficientList(Vec<f64>);

fn coefficients(text: &str) -> Result<CoefficientList, String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|c| c.trim().parse().ok()).collect();
    numbers
        .map(CoefficientList)
        .ok_or_else(|| "must be numbers with commas between them, by falling power of s".to_owned())
}

/// The band of a transfer function if none is given, Hz: that of the paper's figure.
const BAND: [f64; 2] = [0.1, 23.0];

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let rig = Rig::load(&args.rig)?;
    let output = args.measure.angle()?;
    let given = match (&args.published, &args.numerator, &args.denominator) {
        (Some(_), ..) => fong2014::published(),
        (None, Some(b), Some(a)) => Some(Transfer::new(&b.0, &a.0)?),
        _ => None,
    };
    let mut notices = Vec::new();
    let measured = match &given {
        Some(g) => Measured::function(g, output, args.measure.band_or(BAND))?,
        None => {
            let (frf, said) = args.measure.response(&args.data)?;
            notices = said;
            Measured::response(frf, output)
        }
    };
    let found = compare::compare(&measured, &rig)?;
    for notice in &notices {
        note!("note: {notice}");
    }
    let what = args.measure.what();
    let bode = compare::plot(&rig.name, &what, &measured, &found)?;
    let text = compare::text(&rig.name, &what, given.as_ref(), &measured, &found);
    if let Some(path) = &args.csv {
        let mut curves: Vec<(&str, &[Complex<f64>])> = vec![("as_given", &found.as_given)];
        if let Some(alone) = found.parameters_alone() {
            curves.push(("refitted", &alone.response));
        }
        if let Some(best) = found.explanations.first() {
            curves.push(("best", &best.response));
        }
        path.write(csv(&measured.frf, &curves));
    }
    if let Some(path) = &args.report {
        let title = format!("What {what} of {} has and its file has not", rig.name);
        path.write(report::frequency(&title, bode.clone(), &text, &notices));
    }
    if let Some(path) = &args.plot {
        path.write(bode.chart().svg());
    }
    let mut out = streams::output();
    if args.json {
        let explanations: Vec<Value> = found.explanations.iter().map(as_json).collect();
        let line = json!({
            "rig": rig.name, "what": what, "as_given_error": found.as_given_error, "explanations": explanations,
            "footprints": footprints(output), "notices": notices,
        });
        return Ok(writeln!(out, "{line}")?);
    }
    out.write_all(text.as_bytes())?;
    Ok(())
}

/// What the catalogue's effects show in a transfer function.
fn footprints(output: Output) -> Value {
    CATALOGUE
        .iter()
        .map(|spec| {
            let value = match spec.footprint.seen_in(output) {
                Footprint::Own(_) => json!({"kind": "own"}),
                Footprint::Like(other, why) => json!({"kind": "like", "other": other, "why": why}),
                Footprint::Refitted(parameter, why) => {
                    json!({"kind": "parameter", "other": parameter.name(), "why": why})
                }
                Footprint::Nothing(why) => json!({"kind": "nothing", "why": why}),
                // Seen in an output, a factor is one of the others.
                Footprint::Scale(_) => {
                    json!({"kind": "parameter", "other": BaseParameter::MotorGain.name()})
                }
            };
            (spec.id.to_owned(), value)
        })
        .collect::<serde_json::Map<_, _>>()
        .into()
}

fn finite(x: f64) -> Value {
    if x.is_finite() { json!(x) } else { Value::Null }
}

fn as_json(e: &Explanation) -> Value {
    let values: Vec<Value> = e
        .values
        .iter()
        .map(|v| json!({"effect": v.effect, "parameter": v.parameter, "value": v.value, "std": finite(v.std),
            "unit": v.unit}))
        .collect();
    let refitted: serde_json::Map<String, Value> = e
        .refitted
        .iter()
        .map(|r| {
            (
                r.name.to_owned(),
                json!({"factor": r.factor, "std": finite(r.std)}),
            )
        })
        .collect();
    json!({
        "effects": e.effects, "values": values, "refitted": refitted, "relative_error": e.relative_error,
        "parameters": e.parameters,
        "bic": e.bic, "evidence": e.evidence, "same_as": e.same_as,
    })
}
