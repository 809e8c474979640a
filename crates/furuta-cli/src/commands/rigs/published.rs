//! A paper's figures beside ours, and its errata.

use std::fmt::Write as _;

use furuta_ctrl::design::{Weights, lqr};
use furuta_model::published::{Figure, Paper};
use furuta_model::{Linear, Rig};
use serde_json::{Value, json};

use crate::print::significant;

/// The gain for Q = I, R = 1.
fn identity_gain(linear: &Linear) -> Option<[f64; 4]> {
    let weights = Weights::diagonal([1.0; 4], [1.0]);
    let gain = lqr(&linear.a, &linear.b, &weights).ok()?.gain;
    Some([gain[0], gain[1], gain[2], gain[3]])
}

/// A figure as printed and, where it can be computed, as we find it and how far that is off, relative to the printed
/// one.
fn compare(figure: &Figure, rig: &Rig) -> Option<(f64, f64)> {
    let ours = figure.recompute(rig, identity_gain)?;
    Some((ours, (ours - figure.printed) / figure.printed.abs()))
}

/// In per cent, to two digits: `+0.0011 %`.
fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    let digits = (1 - percent.abs().log10().floor() as i32).clamp(0, 12) as usize;
    format!("{percent:+.digits$} %")
}

/// `{"note": ..., "figures": [...], "errata": [...]}`; null for a rig that comes from no paper.
pub(super) fn json(rig: &Rig) -> Value {
    let Some(paper) = Paper::of(&rig.name) else {
        return Value::Null;
    };
    let figures: Value = paper
        .figures
        .iter()
        .map(|f| {
            let (ours, difference) = compare(f, rig).unzip();
            json!({
                "where": f.place, "what": f.what, "printed": f.printed, "ours": ours, "relative_difference": difference,
                "remark": f.remark,
            })
        })
        .collect();
    let errata: Value = paper
        .errata
        .iter()
        .map(|e| {
            json!({"where": e.place, "printed": e.printed, "corrected": e.corrected, "reason": e.reason})
        })
        .collect();
    json!({"note": paper.note, "figures": figures, "errata": errata})
}

/// The same for a reader; empty for a rig that comes from no paper.
pub(super) fn text(rig: &Rig) -> String {
    let Some(paper) = Paper::of(&rig.name) else {
        return String::new();
    };
    let mut out = format!("\nthe paper's figures beside ours\n{}\n\n", paper.note);
    // Writing to a String cannot fail.
    let _ = writeln!(
        out,
        "  {:9} {:23} {:>11} {:>11} {:>10}  remark",
        "where", "what", "printed", "ours", "difference"
    );
    for f in paper.figures {
        let (ours, difference) = match compare(f, rig) {
            Some((ours, d)) if d.abs() < 1e-12 => (significant(ours), "0".to_owned()),
            Some((ours, d)) => (significant(ours), percent(d)),
            None => ("-".to_owned(), "-".to_owned()),
        };
        let row = format!(
            "  {:9} {:23} {:>11} {ours:>11} {difference:>10}  {}",
            f.place,
            f.what,
            significant(f.printed),
            f.remark
        );
        let _ = writeln!(out, "{}", row.trim_end());
    }
    if !paper.errata.is_empty() {
        let _ = writeln!(
            out,
            "\nerrata of the paper; the model has the corrected form"
        );
        for e in paper.errata {
            let _ = writeln!(
                out,
                "  {}\n    printed    {}\n    corrected  {}\n    because    {}",
                e.place, e.printed, e.corrected, e.reason
            );
        }
    }
    out
}
