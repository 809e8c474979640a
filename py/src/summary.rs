//! A diagnosis in words that a student understands.

use furuta_ident::diagnose::result::{Diagnosis, Estimate, Part, significant};
use furuta_model::effects;

/// A few short paragraphs of plain text.
pub(crate) fn text(d: &Diagnosis) -> String {
    let mut lines = vec![d.sentence()];
    lines.extend(d.interruption());
    for e in &d.effects {
        lines.push(String::new());
        lines.push(format!("{} ({})", e.name, e.id));
        if let Some(spec) = effects::spec(&e.id) {
            lines.push(format!("  {}", spec.sentence));
        }
        for (name, p) in &e.parameters {
            lines.push(format!("  {name} = {}", value(p)));
        }
        if e.held_out_gain < 0.0 {
            lines.push(
                "  On data that the fit had not seen, it does not help: its size is not to be relied on."
                    .into(),
            );
        } else if e.held_out_gain.is_finite() {
            lines.push(format!(
                "  On data that the fit had not seen, it takes away {:.1} % of the remaining squared error.",
                100.0 * e.held_out_gain
            ));
        }
        if !e.confusable_with.is_empty() {
            let rivals = e.confusable_with.join(", ");
            lines.push(if d.unfinished.contains(&Part::Rivals) {
                format!("  It was not compared with {rivals}.")
            } else {
                format!("  These data cannot tell it from {rivals}.")
            });
        }
    }
    if let Some(custom) = &d.custom {
        lines.push(String::new());
        lines.push("What is left is imitated by a torque [N m] on the".into());
        lines.extend(custom.torques().iter().map(|t| format!("  {t}")));
        lines.push(format!("  {}", custom.sentence()));
    }
    if !d.location.is_empty() {
        lines.push(String::new());
        lines.push("Where the model disagrees with parameters refitted and nothing added:".into());
    }
    for w in d.location.iter().take(3) {
        lines.push(format!(
            "  {:.0} % of the {}'s error where {} ({})",
            100.0 * w.share_of_gap,
            w.channel.part(),
            w.condition,
            w.run
        ));
    }
    if let Some(next) = &d.next_experiment {
        lines.push(String::new());
        lines.push(format!("Next: {next}."));
    }
    if let Some(best) = d.plan.first() {
        lines.push(format!(
            "  Clearest: {}, {} s, up to {} V (furuta run --task {}); expected evidence {:.0}.",
            best.excitation,
            best.seconds,
            significant(best.volts, 2),
            best.arguments,
            best.expected_evidence
        ));
    }
    for notice in &d.notices {
        lines.push(format!("Note: {notice}"));
    }
    lines.join("\n")
}

fn value(p: &Estimate) -> String {
    let unit = if ["1", "-"].contains(&p.unit.as_str()) {
        ""
    } else {
        &p.unit
    };
    let number = match &p.word {
        Some(word) => return word.clone(),
        None if p.std.is_finite() => {
            format!("{} ± {}", significant(p.value, 4), significant(p.std, 2))
        }
        None => significant(p.value, 4),
    };
    format!("{number} {unit}").trim_end().to_owned()
}
