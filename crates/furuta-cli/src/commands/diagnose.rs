//! `furuta diagnose`: what is the model of this rig missing?

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::time::Duration;

use crate::print::estimate;
use furuta_ident::diagnose::result::significant;
use furuta_ident::diagnose::result::{Channel, Diagnosis, Part};
use furuta_ident::diagnose::{Options, Outcome, Request, STAGES, diagnose_with};
use furuta_ident::recording::{Notice, Recording, against_rig};
use furuta_ident::report;
use furuta_model::{Rig, effects};
use indicatif::{ProgressBar, ProgressStyle};

use crate::failure::Failure;
use crate::interrupt;

/// Find where recordings and model disagree, name the missing effects, and repair the rig file.
///
/// Ctrl-C ends the search and gives what was found by then, files included, with exit code 130; a second Ctrl-C ends the program at once.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Recordings of one rig, CSV or MCAP.
    #[arg(value_name = "DATA", required = true)]
    data: Vec<PathBuf>,
    /// Built-in rig or rig file: the model as the data sheet describes it.
    #[arg(long, value_name = "RIG")]
    rig: String,
    /// Write the answer as JSON to this file; `-` for standard output, in place of text.
    #[arg(long, value_name = "OUT")]
    json: Option<PathBuf>,
    /// Write a report, one HTML page that needs no network.
    #[arg(long, value_name = "OUT.html")]
    report: Option<PathBuf>,
    /// Write the repaired rig file: refitted parameters and the named effects.
    #[arg(long, value_name = "OUT.toml")]
    write_rig: Option<PathBuf>,
    /// Recordings that the search must not see, predicted afterwards by the model as given, refitted and repaired.
    #[arg(long, value_name = "DATA", num_args = 1..)]
    verify: Vec<PathBuf>,
    /// Where the data cannot tell effects apart, look for the experiment that would: simulates both with every test signal.
    #[arg(long)]
    plan: bool,
    /// Diagnose recordings even if they look as if a convention were broken (degrees, alpha from hanging, a flipped sign).
    #[arg(long)]
    accept_suspicious: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<ExitCode, Failure> {
    let rig = Rig::load(&args.rig)?;
    let mut notices = Vec::new();
    let recordings = load(&args.data, args.accept_suspicious, &mut notices)?;
    let verify = load(&args.verify, args.accept_suspicious, &mut notices)?;
    let everything: Vec<Recording> = recordings.iter().chain(&verify).cloned().collect();
    for notice in against_rig(&everything, &rig) {
        refuse_suspicion(&notice, args.accept_suspicious)?;
        notices.push(notice.to_string());
    }
    let request = Request {
        recordings: &recordings,
        rig: &rig,
        verify: &verify,
    };
    let mut outcome = search(&request, args.plan)?;
    let interrupted = outcome.diagnosis.interrupted;
    outcome.diagnosis.notices.splice(0..0, notices);
    write(args, &outcome)?;
    let to_stdout = args.json.as_deref() == Some(Path::new("-"));
    let text = if to_stdout {
        outcome.diagnosis.to_json() + "\n"
    } else {
        summary(&outcome.diagnosis) + &planned(args, &outcome.diagnosis)
    };
    std::io::stdout().lock().write_all(text.as_bytes())?;
    Ok(if interrupted {
        ExitCode::from(interrupt::EXIT)
    } else {
        ExitCode::SUCCESS
    })
}

/// Diagnoses with a progress bar where there is a terminal; Ctrl-C ends it early.
pub(crate) fn search(request: &Request<'_>, plan: bool) -> Result<Outcome, Failure> {
    let bar = ProgressBar::new(STAGES.len() as u64);
    let template = "{spinner} {elapsed:>4} [{bar:12}] {prefix} {wide_msg}";
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.progress_chars("=> "));
    }
    bar.enable_steady_tick(Duration::from_millis(100));
    let flag = interrupt::flag_then_exit();
    let options = Options {
        stop: Some(flag),
        plan,
    };
    let outcome = diagnose_with(request, options, &|progress| {
        let stage = STAGES.iter().position(|s| *s == progress.stage);
        bar.set_position(stage.unwrap_or_default() as u64);
        bar.set_prefix(progress.stage);
        bar.set_message(if flag.load(Ordering::Relaxed) {
            "(interrupted; again: at once)".into()
        } else {
            progress.candidate.unwrap_or_default()
        });
    });
    bar.finish_and_clear();
    Ok(outcome?)
}

pub(super) fn refuse_suspicion(notice: &Notice, accepted: bool) -> Result<(), Failure> {
    if notice.kind.is_suspicion() && !accepted {
        return Err(Failure::new(format!(
            "{notice}; mend the recording, or pass --accept-suspicious if it is right as it is"
        )));
    }
    Ok(())
}

pub(super) fn load(
    paths: &[PathBuf],
    accept_suspicious: bool,
    notices: &mut Vec<String>,
) -> Result<Vec<Recording>, Failure> {
    let mut recordings = Vec::new();
    for path in paths {
        let (recording, found) = Recording::load_with_notices(path)?;
        for notice in found {
            refuse_suspicion(&notice, accept_suspicious)?;
            notices.push(notice.to_string());
        }
        recordings.push(recording);
    }
    Ok(recordings)
}

fn write(args: &Args, outcome: &Outcome) -> Result<(), Failure> {
    let file = |path: &Path, text: &str| {
        std::fs::write(path, text)
            .map_err(|e| Failure::new(format!("{}: cannot be written: {e}", path.display())))
    };
    if let Some(path) = args.json.as_deref().filter(|p| *p != Path::new("-")) {
        file(path, &(outcome.diagnosis.to_json() + "\n"))?;
    }
    if let Some(path) = &args.report {
        file(path, &report::html(&outcome.diagnosis, &outcome.curves))?;
    }
    if let Some(path) = &args.write_rig {
        file(path, &outcome.repaired.to_toml())?;
    }
    Ok(())
}

/// The answer for a person.
pub(crate) fn summary(d: &Diagnosis) -> String {
    let mut out = vec![d.sentence()];
    out.extend(d.interruption());
    for notice in &d.notices {
        out.push(format!("note: {notice}"));
    }
    for e in &d.effects {
        out.push(String::new());
        out.push(format!("{}  {}", e.id, e.name));
        for (name, p) in &e.parameters {
            out.push(format!("  {name} = {}", estimate(p, 4)));
        }
        let held_out = if e.held_out_gain < 0.0 {
            "; it does not help on data kept apart".to_owned()
        } else if e.held_out_gain.is_finite() {
            format!(
                "; {:.0} % of the remaining squared error on held-out data goes",
                100.0 * e.held_out_gain
            )
        } else {
            String::new()
        };
        out.push(format!(
            "  evidence: BIC falls by {:.0}{held_out}",
            e.delta_bic
        ));
        if let Some(spec) = effects::spec(&e.id) {
            out.push(format!("  {}", spec.sentence));
        }
        if !e.confusable_with.is_empty() {
            let rivals = e.confusable_with.join(", ");
            out.push(if d.unfinished.contains(&Part::Rivals) {
                format!("  not compared with {rivals}")
            } else {
                format!("  these data cannot tell it from {rivals}")
            });
        }
    }
    expression(d, &mut out);
    out.push(String::new());
    let repaired = match (&d.custom, d.effects.is_empty()) {
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
        out.push(format!("  {name:<36} {:>9.5} {:>9.5}", g.theta, g.alpha));
    }
    if let Some(h) = &d.held_out {
        out.push("  on data kept apart:".into());
        out.push(format!(
            "    {:<34} {:>9.5} {:>9.5}",
            "parameters refitted", h.recalibrated.theta, h.recalibrated.alpha
        ));
        out.push(format!(
            "    {:<34} {:>9.5} {:>9.5}",
            repaired, h.augmented.theta, h.augmented.alpha
        ));
    }
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
    limits(d, &mut out);
    verification(d, &mut out);
    if let Some(next) = &d.next_experiment {
        out.push(String::new());
        out.push(format!("Next: {next}."));
    }
    out.push(format!("\n{:.1} s", d.seconds));
    out.join("\n") + "\n"
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
                estimate(coefficient, 4)
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

/// The table of `--plan`, and the command line that records the best.
fn planned(args: &Args, d: &Diagnosis) -> String {
    if !args.plan {
        return String::new();
    }
    let Some(first) = d.plan.first() else {
        return "\nNo experiment is planned: nothing is confusable that a recording could tell apart.\n".into();
    };
    let mut out = format!(
        "\nExperiments that would tell what these data cannot, the clearest first:\n  {:<56} {:>5} {:>6}  {:<40} {:>12}\n",
        "", "s", "V", "tells apart", "evidence"
    );
    for row in &d.plan {
        out += &format!(
            "  {:<56} {:>5} {:>6}  {:<40} {:>12.0}\n",
            row.excitation,
            row.seconds,
            significant(row.volts, 2),
            row.separates.join(" or "),
            row.expected_evidence
        );
    }
    let rig = args
        .write_rig
        .as_deref()
        .map_or_else(|| args.rig.clone(), |path| path.display().to_string());
    out + &format!(
        "Expected rise of the wrong one's BIC, whichever is right (simulated with these encoders; above 10 is very strong). The first:\n  \
         furuta run --port PORT --rig {rig} --task {} --log next.mcap\n",
        first.arguments
    )
}

/// What was not named, and how large it could be all the same: what is ruled out at a size that would be noticed.
fn limits(d: &Diagnosis, out: &mut Vec<String>) {
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
            if l.unit == "1" { "" } else { &l.unit },
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
        let all = |value: fn(&&furuta_ident::diagnose::result::VerificationRow) -> f64| {
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
