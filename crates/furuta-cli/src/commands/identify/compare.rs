//! `furuta identify compare`: what a measured transfer function knows that a rig file does not.

use std::io::Write;
use std::path::PathBuf;

use furuta_ident::diagnose::result::significant;
use furuta_ident::frequency::compare::{
    Comparison, Explanation, FAR, Footprint, Measured, OWN, compare, footprint, name,
};
use furuta_ident::frequency::first_principles::Output;
use furuta_ident::frequency::transfer::polynomial_text;
use furuta_ident::frequency::{Transfer, fong2014};
use furuta_model::{CATALOGUE, Rig};
use nalgebra::Complex;
use serde_json::{Value, json};

use super::frf::Measure;
use crate::bode::Bode;
use crate::commands::study::plot;
use crate::failure::Failure;

/// Which effects of the catalogue explain what a measured transfer function has and the rig file has not: each with a linear footprint is fitted, alone
/// and together with others, beside the rig's refitted parameters, and ranked by evidence.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Recordings to measure the response from, in place of a transfer function.
    #[arg(value_name = "DATA", conflicts_with_all = ["published", "numerator", "denominator"], required_unless_present_any = ["published", "numerator"])]
    data: Vec<PathBuf>,
    /// Built-in rig or rig file.
    #[arg(long, value_name = "RIG")]
    rig: String,
    /// A published transfer function: `fong2014`, equation (29).
    #[arg(long, value_name = "PAPER", conflicts_with = "numerator", value_parser = ["fong2014"])]
    published: Option<String>,
    /// Coefficients of the measured numerator by falling power of s.
    #[arg(long, value_name = "B,...", value_parser = coefficients, allow_hyphen_values = true, requires = "denominator")]
    numerator: Option<Coefficients>,
    /// The same of the denominator.
    #[arg(long, value_name = "A,...", value_parser = coefficients, allow_hyphen_values = true, requires = "numerator")]
    denominator: Option<Coefficients>,
    #[command(flatten)]
    measure: Measure,
    /// Draw what was measured, the rig as given, its parameters refitted and the best explanation (SVG).
    #[arg(long, value_name = "OUT.svg")]
    plot: Option<PathBuf>,
    /// Print one line of JSON in place of text.
    #[arg(long)]
    json: bool,
}

/// Coefficients by falling power.
#[derive(Clone, Debug)]
struct Coefficients(Vec<f64>);

fn coefficients(text: &str) -> Result<Coefficients, String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|c| c.trim().parse().ok()).collect();
    numbers
        .map(Coefficients)
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
    let found = compare(&measured, &rig)?;
    for notice in &notices {
        eprintln!("note: {notice}");
    }
    if let Some(path) = &args.plot {
        plot(path, &bode(&args.measure, &measured, &found, &rig)?.chart())?;
    }
    let mut out = std::io::stdout().lock();
    if args.json {
        let explanations: Vec<Value> = found.explanations.iter().map(as_json).collect();
        let line = json!({
            "rig": rig.name, "what": args.measure.what(), "as_given_error": found.as_given_error, "explanations": explanations,
            "footprints": footprints(output), "notices": notices,
        });
        return Ok(writeln!(out, "{line}")?);
    }
    out.write_all(text(&rig, &args.measure, given.as_ref(), &measured, &found).as_bytes())?;
    Ok(())
}

fn bode(
    measure: &Measure,
    measured: &Measured,
    found: &Comparison,
    rig: &Rig,
) -> Result<Bode, Failure> {
    let frf = &measured.frf;
    let over = |response: &[Complex<f64>]| -> Vec<(f64, Complex<f64>)> {
        frf.frequency
            .iter()
            .copied()
            .zip(response.iter().copied())
            .collect()
    };
    let mut bode = Bode::new(&format!("{}, {}", measure.what(), rig.name));
    bode = if frf.std.iter().any(|s| *s > 0.0) {
        bode.measured(frf)?
    } else {
        bode.model("measured", &over(&frf.response), false)
    };
    bode = bode.model("data sheet", &over(&found.as_given), true);
    if let Some(alone) = found.parameters_alone() {
        bode = bode.model("parameters refitted", &over(&alone.response), true);
    }
    let best = found.explanations.first();
    if let Some(best) = best.filter(|b| !b.effects.is_empty()) {
        bode = bode.model(&best.name(), &over(&best.response), true);
    }
    Ok(bode)
}

/// What the catalogue's effects show in a transfer function.
fn footprints(output: Output) -> Value {
    CATALOGUE
        .iter()
        .filter_map(|spec| {
            let value = match footprint(spec.id, output)? {
                Footprint::Own => json!({"kind": "own"}),
                Footprint::Like(other, why) => json!({"kind": "like", "other": other, "why": why}),
                Footprint::Parameter(name, why) => {
                    json!({"kind": "parameter", "other": name, "why": why})
                }
                Footprint::Nothing(why) => json!({"kind": "nothing", "why": why}),
            };
            Some((spec.id.to_owned(), value))
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
        .map(|v| json!({"effect": v.effect, "parameter": v.parameter, "value": v.value, "std": finite(v.std), "unit": v.unit}))
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
        "effects": e.effects, "values": values, "refitted": refitted, "relative_error": e.relative_error, "parameters": e.parameters,
        "bic": e.bic, "evidence": e.evidence, "same_as": e.same_as,
    })
}

/// Sets of effects shown.
const SHOWN: usize = 12;

fn text(
    rig: &Rig,
    measure: &Measure,
    given: Option<&Transfer>,
    measured: &Measured,
    found: &Comparison,
) -> String {
    let frf = &measured.frf;
    let ends = [frf.frequency.first(), frf.frequency.last()];
    let [low, high] = ends.map(|f| significant(f.copied().unwrap_or(0.0), 3));
    let mut text = match given {
        Some(g) => format!(
            "measured: {} = ({}) / ({}), {low} to {high} Hz\n",
            measure.what(),
            polynomial_text(&g.numerator, 4),
            polynomial_text(&g.denominator, 4)
        ),
        None => format!(
            "measured: {}, {} lines from {low} to {high} Hz, {}\n",
            measure.what(),
            frf.frequency.len(),
            frf.method
        ),
    };
    text += &format!(
        "{} as its file has it: relative error {:.1} % (RMS over the band)\n",
        rig.name,
        100.0 * found.as_given_error
    );
    text += "  explanation                                     error %  numbers  evidence\n";
    let row = |e: &Explanation| {
        format!(
            "  {:46} {:>8.2} {:>8} {:>9.1}\n",
            e.name(),
            100.0 * e.relative_error,
            e.parameters,
            e.evidence
        )
    };
    if let Some(alone) = found.parameters_alone() {
        text += &row(alone);
    }
    found.singles().for_each(|e| text += &row(e));
    text += "  several, the best of them\n";
    found
        .explanations
        .iter()
        .filter(|e| e.effects.len() > 1)
        .take(SHOWN - OWN.len())
        .for_each(|e| text += &row(e));
    text += &format!(
        "evidence: fall of BIC against the parameters alone, of {:.0} independent numbers; above 6 is strong\n",
        measured.numbers
    );
    let mut shown: Vec<&Explanation> = found.singles().take(1).collect();
    if let Some(best) = found.explanations.first()
        && best.effects.len() != 1
    {
        shown.push(best);
    }
    for e in shown {
        text += &details(e);
    }
    text += &alike(found, measured.output);
    text
}

/// An explanation's numbers.
fn details(e: &Explanation) -> String {
    let mut text = format!("{}\n", e.name());
    let std = |x: f64| {
        if x.is_finite() {
            format!(" ± {}", significant(x, 2))
        } else {
            ", not determined".to_owned()
        }
    };
    for v in &e.values {
        text += &format!(
            "  {} {} = {}{} {}\n",
            v.effect,
            v.parameter,
            significant(v.value, 4),
            std(v.std),
            if v.unit == "-" { "" } else { v.unit }
        );
    }
    for r in &e.refitted {
        let far = r.factor > FAR || r.factor < 1.0 / FAR;
        text += &format!(
            "  {} x {}{}{}\n",
            r.name,
            significant(r.factor, 3),
            std(r.std),
            if far && r.std.is_finite() {
                "  far from the data sheet"
            } else {
                ""
            }
        );
    }
    text.lines()
        .map(|l| format!("{}\n", l.trim_end()))
        .collect()
}

/// What the response cannot tell apart.
fn alike(found: &Comparison, output: Output) -> String {
    let mut text = String::from("what a response of this angle cannot tell apart\n");
    for e in found.singles().filter(|e| !e.same_as.is_empty()) {
        let others: Vec<String> = e.same_as.iter().map(|o| name(o)).collect();
        text += &format!(
            "  {} and {}: their best fits are the same curve\n",
            e.name(),
            others.join(", ")
        );
    }
    for own in OWN {
        let like: Vec<&str> = CATALOGUE
            .iter()
            .filter(|s| matches!(footprint(s.id, output), Some(Footprint::Like(other, _)) if other == own))
            .map(|s| s.id)
            .collect();
        if !like.is_empty() {
            text += &format!("  {own} and {}\n", like.join(", "));
        }
    }
    for parameter in ["arm damping", "pendulum damping", "motor gain"] {
        let like: Vec<&str> = CATALOGUE
            .iter()
            .filter(|s| {
                matches!(footprint(s.id, output), Some(Footprint::Parameter(name, _)) if name == parameter)
            })
            .map(|s| s.id)
            .collect();
        text += &format!("  {parameter}, refitted, and {}\n", like.join(", "));
    }
    let nothing: Vec<&str> = CATALOGUE
        .iter()
        .filter(|s| matches!(footprint(s.id, output), Some(Footprint::Nothing(_))))
        .map(|s| s.id)
        .collect();
    text += &format!("  nothing at all is seen of {}\n", nothing.join(", "));
    text
}
