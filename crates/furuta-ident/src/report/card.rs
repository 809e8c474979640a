//! The answer at a glance, for a notebook: a piece of HTML with its styles inside, no script, a few kB.

use core::fmt::Write as _;

use super::escape;
use crate::diagnose::result::{Channel, Diagnosis, NamedEffect, Part, Verdict, significant};

/// The diagnosis as one small piece of HTML: verdict, effects with their parameters, numbers of the
/// sheet that moved, errors by model. It takes colours
/// and font from where it stands, light or dark, and needs neither script nor network.
///
/// ```
/// use furuta_ident::diagnose::result::{Diagnosis, Verdict};
/// let card = furuta_ident::report::card(&Diagnosis::new(Verdict::NoGap));
/// assert!(card.starts_with("<div") && card.contains("nothing is missing") && card.len() < 2000);
/// ```
#[must_use]
pub fn card(diagnosis: &Diagnosis) -> String {
    let (word, colour) = match diagnosis.verdict {
        Verdict::NoGap => ("no gap", "#2f9e6e"),
        Verdict::ParametersOnly => ("parameters only", "#1f6fd6"),
        Verdict::MissingEffects if diagnosis.effects.len() == 1 => {
            ("one effect is missing", "#d9730d")
        }
        Verdict::MissingEffects => ("effects are missing", "#d9730d"),
        Verdict::Unexplained => ("unexplained", "#c2434b"),
    };
    let mut out = format!(
        "<div style=\"max-width:46em;border:1px solid #8886;border-left:5px solid \
         {colour};border-radius:8px;padding:.7em 1em;line-height:1.45\">\
         <div><b style=\"color:{colour}\">{word}</b></div><div style=\"font-size:1.08em;margin:.2em 0 .5em\">{}</div>",
        escape(&diagnosis.sentence())
    );
    for note in diagnosis.interruption().iter().chain(&diagnosis.notices) {
        let _ = write!(
            out,
            "<div style=\"opacity:.75;font-size:.9em\">{}</div>",
            escape(note)
        );
    }
    let compared = !diagnosis.unfinished.contains(&Part::Rivals);
    for e in &diagnosis.effects {
        effect(&mut out, e, compared);
    }
    if let Some(custom) = &diagnosis.custom {
        out.push_str(
            "<div style=\"margin:.5em 0\">What is left is imitated by a torque [N m] on the",
        );
        for torque in custom.torques() {
            let _ = write!(
                out,
                "<div style=\"padding-left:1.2em\"><code>{}</code></div>",
                escape(&torque)
            );
        }
        out.push_str("</div>");
    }
    for (key, change) in diagnosis.moved() {
        let _ = write!(
            out,
            "<div style=\"opacity:.75;font-size:.9em\"><code>{}</code> {}</div>",
            escape(key),
            escape(&change)
        );
    }
    errors(&mut out, diagnosis);
    if let Some(next) = &diagnosis.next_experiment {
        let _ = write!(
            out,
            "<div style=\"margin-top:.5em\"><b>Next:</b> {}</div>",
            escape(next)
        );
    }
    out + "</div>"
}

fn effect(out: &mut String, e: &NamedEffect, compared: bool) {
    let _ = write!(
        out,
        "<div style=\"margin:.5em 0\"><b>{}</b> <code>{}</code>",
        escape(&e.name),
        escape(&e.id)
    );
    for (name, p) in &e.parameters {
        let _ = write!(
            out,
            "<div style=\"padding-left:1.2em\">{} = {}</div>",
            escape(name),
            escape(&p.text(4))
        );
    }
    if let Some(spec) = furuta_model::effects::spec(&e.id) {
        let _ = write!(
            out,
            "<div style=\"padding-left:1.2em;opacity:.75\">{}</div>",
            escape(spec.sentence)
        );
    }
    if !e.confusable_with.is_empty() {
        let _ = write!(
            out,
            "<div style=\"padding-left:1.2em;opacity:.75\">{} {}</div>",
            if compared {
                "These data cannot tell it from"
            } else {
                "Not compared with"
            },
            escape(&e.confusable_with.join(", "))
        );
    }
    out.push_str("</div>");
}

/// The error of prediction by model, where it is known.
fn errors(out: &mut String, diagnosis: &Diagnosis) {
    let gap = &diagnosis.gap;
    if !gap.nominal.theta.is_finite() {
        return;
    }
    let head: String = ["rig file", "refitted", "repaired", "noise"]
        .iter()
        .map(|h| format!("<th style=\"text-align:right;padding:.1em .7em\">{h}</th>"))
        .collect();
    let rows: String = Channel::ALL
        .iter()
        .map(|c| {
            let cells: String = [
                gap.nominal,
                gap.recalibrated,
                gap.augmented,
                gap.noise_floor,
            ]
            .iter()
            .map(|g| {
                format!(
                    "<td style=\"text-align:right;padding:.1em .7em\">{}</td>",
                    significant(g.get(*c), 2)
                )
            })
            .collect();
            format!(
                "<tr><td style=\"text-align:left;padding:.1em .7em .1em 0\">{}</td>{cells}</tr>",
                c.part()
            )
        })
        .collect();
    let _ = write!(
        out,
        "<table style=\"border-collapse:collapse;font-size:.92em;margin-top:.4em\"><tr><th \
         style=\"text-align:left;padding:.1em .7em .1em 0\">RMS error over {} s, rad</th>{head}</tr>{rows}</table>",
        significant(gap.horizon, 2)
    );
}
