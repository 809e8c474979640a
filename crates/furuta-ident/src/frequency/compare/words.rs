//! A comparison in words, and as a picture.

use furuta_model::CATALOGUE;
use furuta_model::effects::{BaseParameter, Footprint};
use nalgebra::Complex;

use super::super::bode::Bode;
use super::super::error::FrequencyError;
use super::super::first_principles::Output;
use super::super::transfer::{Transfer, polynomial_text};
use super::{Comparison, Explanation, FAR, Measured, STRONG, name, own};
use crate::answer::significant;

/// Sets of effects shown.
const SHOWN: usize = 12;

/// The ranking in words: each effect alone, the best sets of several, their numbers, and what a response cannot tell
/// apart.
///
/// `rig` and `what` are names: of the rig, and of what the response is of (`alpha / u`); `given` is the function that
/// stood for a measured response.
#[must_use]
pub fn text(
    rig: &str,
    what: &str,
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
            what,
            polynomial_text(&g.numerator, 4),
            polynomial_text(&g.denominator, 4)
        ),
        None => format!(
            "measured: {}, {} lines from {low} to {high} Hz, {}\n",
            what,
            frf.frequency.len(),
            frf.method
        ),
    };
    text += &format!(
        "{} as its file has it: relative error {:.1} % (RMS over the band)\n",
        rig,
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
        .take(SHOWN.saturating_sub(found.singles().count()))
        .for_each(|e| text += &row(e));
    text += &format!(
        "evidence: fall of BIC against the parameters alone, of {:.0} independent numbers; above {STRONG} is strong\n",
        measured.numbers
    );
    // An effect without evidence is not worth its numbers.
    let mut shown: Vec<&Explanation> = found
        .singles()
        .take(1)
        .filter(|e| e.has_evidence())
        .collect();
    match found.best() {
        Some(best) if best.effects.len() > 1 => shown.push(best),
        Some(_) => {}
        None => {
            text += "no effect has strong evidence\n";
            shown.extend(found.parameters_alone());
        }
    }
    for e in shown {
        text += &details(e);
    }
    text += &alike(found, measured.output);
    text
}

/// An explanation's numbers.
fn details(e: &Explanation) -> String {
    let mut text = format!("{} (± one standard deviation)\n", e.name());
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
    let like = |which: &dyn Fn(Footprint) -> bool| -> String {
        let seen = CATALOGUE
            .iter()
            .filter(|s| which(s.footprint.seen_in(output)));
        seen.map(|s| s.id).collect::<Vec<_>>().join(", ")
    };
    for own in own() {
        let others = like(&|f| matches!(f, Footprint::Like(other, _) if other == own.id));
        if !others.is_empty() {
            text += &format!("  {} and {others}\n", own.id);
        }
    }
    for parameter in [
        BaseParameter::ArmDamping,
        BaseParameter::PendulumDamping,
        BaseParameter::MotorGain,
    ] {
        let others = like(&|f| matches!(f, Footprint::Refitted(other, _) if other == parameter));
        text += &format!("  {parameter}, refitted, and {others}\n");
    }
    let nothing = like(&|f| matches!(f, Footprint::Nothing(_)));
    text += &format!("  nothing at all is seen of {nothing}\n");
    text
}

/// What was measured, the rig as given, its parameters refitted, and the best explanation. `rig` and `what` are names,
/// as for [`text`].
///
/// # Errors
/// As [`super::super::Frf::confidence`].
pub fn plot(
    rig: &str,
    what: &str,
    measured: &Measured,
    found: &Comparison,
) -> Result<Bode, FrequencyError> {
    let frf = &measured.frf;
    let over = |response: &[Complex<f64>]| -> Vec<(f64, Complex<f64>)> {
        frf.frequency
            .iter()
            .copied()
            .zip(response.iter().copied())
            .collect()
    };
    let mut bode = Bode::new(&format!("{what}, {rig}")).measured(frf)?.model(
        "data sheet",
        &over(&found.as_given),
        true,
    );
    if let Some(alone) = found.parameters_alone() {
        bode = bode.model("parameters refitted", &over(&alone.response), true);
    }
    if let Some(best) = found.best() {
        bode = bode.model(&best.name(), &over(&best.response), true);
    }
    Ok(bode)
}
