//! `furuta diagnose`: what is the model of this rig missing?

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::time::Duration;

use furuta_ident::diagnose::{Options, Outcome, Request, STAGES, diagnose_with};
use furuta_ident::recording::{Notice, Recording, against_rig};
use furuta_ident::report;
use furuta_model::Rig;
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
        let repaired = args.write_rig.as_deref();
        let rig = repaired.map_or_else(|| args.rig.clone(), |path| path.display().to_string());
        let mut text = report::text(&outcome.diagnosis, &rig);
        if args.plan && outcome.diagnosis.plan.is_empty() {
            text += "\nNo experiment is planned: nothing is confusable that a recording could tell apart.\n";
        }
        text
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
