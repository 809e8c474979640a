//! The answer in plain text, for a terminal and for Python's `summary()`.

use furuta_model::effects;

use crate::diagnose::result::{
    AtBound, Channel, Channels, Diagnosis, NamedEffect, Part, VerificationRow, Zero, plain,
    significant,
};

/// The answer for a person: what is missing and by how much, where the model disagrees, what is ruled out, what to
/// measure next. `rig` is how the rig file is called in the command line of a planned experiment.
///
/// ```
/// use furuta_ident::diagnose::result::{Diagnosis, Verdict};
/// assert!(furuta_ident::report::text(&Diagnosis::new(Verdict::NoGap), "rig.toml").contains("nothing is missing"));
/// ```
#[must_use]
pub fn text(d: &Diagnosis, rig: &str) -> String {
    let mut out = vec![d.sentence()];
    out.extend(d.interruption());
    for notice in &d.notices {
        out.push(format!("note: {notice}"));
    }
    if let Some(jitter) = &d.jitter {
        out.push(format!("note: {}", jitter.sentence()));
    }
    let mut explain = true;
    for e in &d.effects {
        effect(
            e,
            d.unfinished.contains(&Part::Rivals),
            &mut explain,
            &mut out,
        );
    }
    out.extend(d.zeros.iter().filter_map(Zero::sentence));
    for e in &d.suspected {
        out.push(String::new());
        out.push(format!(
            "Suspected, not named: {} ({}): {}.",
            e.name, e.id, e.reason
        ));
    }
    expression(d, &mut out);
    let mut moved = d.moved().peekable();
    if moved.peek().is_some() {
        out.push(String::new());
        out.push("Numbers of the sheet that moved, refitted beside what is named:".into());
    }
    out.extend(moved.map(|(key, change)| format!("  {key:<28} {change}")));
    let (left, resolved): (Vec<&AtBound>, Vec<&AtBound>) = d.bounds().partition(|b| d.keeps(b));
    for (bounds, heading) in [
        (
            left,
            "Numbers at a bound, where no rig is: something else took their place, or the rig file is wrong.",
        ),
        (
            resolved,
            "Numbers at a bound where the parameters alone are refitted; beside what is added none of them is:",
        ),
    ] {
        if !bounds.is_empty() {
            out.extend([String::new(), heading.to_owned()]);
        }
        out.extend((bounds.iter()).map(|b| format!("  {:<28} {}", b.parameter, b.text())));
    }
    out.push(String::new());
    let imitated = d.suspected.iter().any(|s| s.kept);
    let repaired = match (&d.custom, d.effects.is_empty()) {
        (None, _) if imitated => "with named and imitating effects",
        (None, _) => "with the named effects",
        (Some(_), true) => "with the expression",
        (Some(_), false) => "with named effects and expression",
    };
    out.push(format!(
        "RMS prediction error over {} s [rad]      theta     alpha",
        d.gap.horizon
    ));
    for (name, g) in [
        ("rig file as given", d.gap.nominal),
        ("parameters refitted", d.gap.recalibrated),
        (repaired, d.gap.augmented),
        ("noise of the encoders", d.gap.noise_floor),
    ] {
        out.push(format!("  {name:<36} {}", both(g)));
    }
    if let Some(h) = &d.held_out {
        out.push("  on data kept apart:".into());
        for (name, channels) in [
            ("parameters refitted", h.recalibrated),
            (repaired, h.augmented),
        ] {
            out.push(format!("    {name:<34} {}", both(channels)));
        }
    }
    out.extend(d.written());
    let mut where_it_sits = d.location.iter().take(3).peekable();
    if where_it_sits.peek().is_some() {
        out.push(String::new());
        out.push("Where the refitted model disagrees:".into());
    }
    for w in where_it_sits {
        out.push(format!(
            "  {:>3.0} % of the {}'s error where {} ({})",
            100.0 * w.share_of_gap,
            w.channel.part(),
            w.condition,
            w.run
        ));
    }
    out.extend(
        d.missing_torque
            .iter()
            .map(|t| format!("  {}", t.sentence())),
    );
    limits(d, &mut out);
    verification(d, &mut out);
    if let Some(comparison) = &d.comparison {
        out.push(String::new());
        out.extend(comparison.lines());
    }
    if let Some(next) = &d.next_experiment {
        out.push(String::new());
        out.push(format!("Next: {next}."));
    }
    plan(d, rig, &mut out);
    out.push(format!("\n{:.1} s", d.seconds));
    out.join("\n") + "\n"
}

/// The errors of both angles, as columns of a table; a dash where one is not known.
fn both(channels: Channels) -> String {
    let column = |c: Channel| match channels.get(c) {
        error if error.is_finite() => format!("{error:>9.5}"),
        _ => format!("{:>9}", "-"),
    };
    Channel::ALL.map(column).join(" ")
}

/// An effect that was named; `uncompared` with others in its place. What stands behind the first ± is explained.
fn effect(e: &NamedEffect, uncompared: bool, explain: &mut bool, out: &mut Vec<String>) {
    out.push(String::new());
    out.push(format!("{}  {}", e.id, e.name));
    for (name, p) in &e.parameters {
        let value = p.text(4);
        let explanation = if *explain && value.contains('±') {
            *explain = false;
            "  (± one standard deviation)"
        } else {
            ""
        };
        out.push(format!("  {name} = {value}{explanation}"));
    }
    out.push(format!("  evidence: BIC falls by {:.0}", e.delta_bic));
    if e.held_out_gain < 0.0 {
        out.push("  On data that the fit had not seen, it does not help: its size is not to be relied on.".into());
    } else if e.held_out_gain.is_finite() {
        out.push(format!(
            "  On data that the fit had not seen, it takes away {:.1} % of the remaining squared error.",
            100.0 * e.held_out_gain
        ));
    }
    if let Some(spec) = effects::spec(&e.id) {
        out.push(format!("  {}", spec.sentence));
    }
    if !e.confusable_with.is_empty() {
        let rivals = e.confusable_with.join(", ");
        out.push(if uncompared {
            format!("  not compared with {rivals}")
        } else {
            format!("  these data cannot tell it from {rivals}")
        });
    }
}

/// The empirical expression, each axis on a line, and its coefficients as they stand in the rig file.
fn expression(d: &Diagnosis, out: &mut Vec<String>) {
    let Some(custom) = &d.custom else {
        return;
    };
    out.push(String::new());
    out.push("What is left is imitated by a torque [N m] on the".into());
    for torque in custom.torques() {
        out.push(format!("  {torque}"));
    }
    for term in &custom.terms {
        if let Some(coefficient) = term.parameters.get("coefficient") {
            out.push(format!(
                "  {} coefficient = {}",
                term.id,
                coefficient.text(4)
            ));
        }
    }
    out.push(format!("  {}", custom.sentence()));
    let [before, after] = [custom.without, custom.with];
    out.push(format!(
        "  RMS error there: arm {} to {} rad, pendulum {} to {} rad",
        significant(before.theta, 3),
        significant(after.theta, 3),
        significant(before.alpha, 3),
        significant(after.alpha, 3)
    ));
}

/// What was not named, and how large it could be all the same: what is ruled out at a size that would be noticed.
fn limits(d: &Diagnosis, out: &mut Vec<String>) {
    if let Some(why) = d.why_no_limits() {
        out.push(String::new());
        out.push(why.into());
    }
    let small: Vec<_> = d.limits.iter().filter(|l| l.at_most < l.typical).collect();
    if small.is_empty() {
        return;
    }
    out.push(String::new());
    out.push("Not named, and (95 %) at most of this size:".into());
    for l in small {
        out.push(format!(
            "  {:<28} {:<14} {:>9} {:<10} {:>5.1} % of what would be noticed",
            l.id,
            l.parameter,
            significant(l.at_most, 2),
            plain(&l.unit),
            100.0 * l.at_most / l.typical
        ));
    }
}

fn verification(d: &Diagnosis, out: &mut Vec<String>) {
    if d.verification.is_empty() {
        return;
    }
    out.push(String::new());
    out.push(
        "Recordings that the search never saw, RMS error [rad]   as given  refitted  repaired"
            .into(),
    );
    for row in &d.verification {
        out.push(format!(
            "  {:<36} {:<14} {:>10.4} {:>9.4} {:>9.4}",
            row.run,
            row.channel.to_string(),
            row.nominal,
            row.recalibrated,
            row.repaired
        ));
    }
    for channel in Channel::ALL {
        let rows: Vec<_> = d
            .verification
            .iter()
            .filter(|r| r.channel == channel)
            .collect();
        if rows.is_empty() {
            continue;
        }
        let all = |value: fn(&&VerificationRow) -> f64| {
            (rows.iter().map(|r| value(r).powi(2)).sum::<f64>() / rows.len().max(1) as f64).sqrt()
        };
        out.push(format!(
            "  {:<36} {:<14} {:>10.4} {:>9.4} {:>9.4}",
            "all together",
            channel.to_string(),
            all(|r| r.nominal),
            all(|r| r.recalibrated),
            all(|r| r.repaired)
        ));
    }
}

/// The experiments that would tell what these data cannot, and the command line that records the first.
fn plan(d: &Diagnosis, rig: &str, out: &mut Vec<String>) {
    let Some(first) = d.plan.first() else {
        return;
    };
    out.push("\nExperiments that would tell what these data cannot, the clearest first:".into());
    out.push(format!(
        "  {:<56} {:>5} {:>6} {:>6}  {:<40} {:>12}",
        "", "s", "V peak", "V RMS", "tells apart", "evidence"
    ));
    for row in &d.plan {
        out.push(format!(
            "  {:<56} {:>5} {:>6} {:>6}  {:<40} {:>12.0}",
            row.excitation,
            row.seconds,
            significant(row.volts, 2),
            significant(row.volts_rms, 2),
            row.separates.join(" or "),
            row.expected_evidence
        ));
    }
    out.push("Expected rise of the wrong one's BIC, whichever is right (simulated with these encoders; above 10 is \
              very strong). The first:".into());
    out.push(format!(
        "  furuta run --port PORT --rig {rig} --task {} --log next.mcap",
        first.arguments
    ));
}
