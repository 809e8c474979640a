//! `furuta diagnose`: what is the model of this rig missing?

use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::Duration;

use furuta_ident::diagnose::{Options, Outcome, Request, diagnose_with, samples_looked_at};
use furuta_ident::{Pendulum, Task, report};
use furuta_model::effects::own;
use furuta_model::{Rig, Spec, effects};

use super::progress;
use super::recorded::RecordedArgs;
use crate::failure::Failure;
use crate::interrupt;
use crate::outputs::{self, Output};

/// Find where recordings and model disagree, name the missing effects, and repair the rig file.
///
/// Ctrl-C ends the search and gives what was found by then, files included, with exit code 130; a second Ctrl-C ends
/// the program at once.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    #[command(flatten)]
    recorded: RecordedArgs,
    /// Write a report, one HTML page that needs no network.
    #[arg(long, value_name = "OUT.html", value_parser = outputs::page())]
    report: Option<Output>,
    /// Write the repaired rig file: refitted parameters and the named effects.
    #[arg(long, value_name = "OUT.toml", value_parser = outputs::data())]
    write_rig: Option<Output>,
    /// Recordings that the search must not see, predicted afterwards by the model as given, refitted and repaired.
    #[arg(long, value_name = "DATA", num_args = 1..)]
    verify: Vec<PathBuf>,
    /// Recordings of the same rig in another state (the cable taken off, say): they are diagnosed as well, and for each
    /// effect named in either state it is said whether it differs.
    #[arg(long, value_name = "DATA", num_args = 1..)]
    compare: Vec<PathBuf>,
    /// Where the data cannot tell effects apart, look for the experiment that would: simulates both with every test
    /// signal.
    #[arg(long)]
    plan: bool,
    /// All recordings count their angles from the same zeros: no encoder was switched off between them. Otherwise each
    /// has zeros of its own.
    #[arg(long)]
    same_zero: bool,
    /// After this many seconds the search ends with what was found by then; `unfinished` in the JSON says what was left
    /// undone. What was not judged on data kept apart and does not explain the data is then suspected, not named. Of
    /// more than 1,000 samples for each second of it only stretches are looked at.
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0, value_parser = positive)]
    time_limit: f64,
    /// Follow every candidate from every start to the end, however little it promises: several times as slow, and to
    /// the same names where what saves time is sound.
    #[arg(long)]
    thorough: bool,
    /// Look for this effect from the outset, one of those that few rigs have (furuta effects ID says more), or for the
    /// laws of your own in this file (its name ends in .toml; docs/own-hypothesis.md); may be repeated.
    #[arg(long = "candidate", value_name = "ID|FILE.toml", value_parser = candidate)]
    candidates: Vec<Candidate>,
    /// What the pendulum did in the recordings: swings, removed (taken off), locked (hanging, held to the arm),
    /// alone (it swings, the arm is held) or driven (it swings, the arm moves as theta says). Where it is off or locked
    /// the arm alone is diagnosed, whatever alpha says; where the arm is held the pendulum alone, whatever theta and u
    /// say; where it is driven the pendulum alone, whatever u says.
    #[arg(
        long,
        value_name = "STATE",
        default_value = "swings",
        conflicts_with = "plan"
    )]
    pendulum: Pendulum,
}

/// An entry of the catalogue, or the laws of a file.
#[derive(Clone, Debug)]
struct Candidate(Vec<&'static Spec>);

fn candidate(given: &str) -> Result<Candidate, String> {
    if given.ends_with(".toml") {
        return own::load(given).map(Candidate).map_err(|e| e.to_string());
    }
    let entry = effects::all().find(|s| s.id == given);
    let entry = entry.ok_or_else(|| {
        let ids: Vec<&str> = effects::on_request().map(|s| s.id).collect();
        format!(
            "no such effect: give a file with laws of your own (its name ends in .toml), or one of {}",
            ids.join(", ")
        )
    })?;
    Ok(Candidate(vec![entry]))
}

/// All that are to be looked for.
fn asked(candidates: &[Candidate]) -> Result<Vec<&'static Spec>, Failure> {
    let mut all: Vec<&'static Spec> = Vec::new();
    for spec in candidates.iter().flat_map(|c| c.0.iter().copied()) {
        if all
            .iter()
            .any(|other| other.id == spec.id && !other.is_same(spec))
        {
            let id = spec.id;
            return Err(Failure::new(format!(
                "--candidate: two different laws are called {id}: give one of them another id"
            )));
        }
        all.push(spec);
    }
    Ok(all)
}

/// A time that is more than none, s.
fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds > 0.0 && seconds <= MOST_SECONDS => Ok(seconds),
        _ => Err(format!(
            "give a number of seconds above 0, {MOST_SECONDS} at most"
        )),
    }
}

/// The longest time limit, s: a year.
const MOST_SECONDS: f64 = 365.0 * 86400.0;

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<u8, Failure> {
    let rig = Rig::load(&args.recorded.rig)?;
    let candidates = asked(&args.candidates)?;
    let mut notices = Vec::new();
    let [recordings, verify] =
        (args.recorded).load(&rig, &args.verify, args.pendulum, &mut notices)?;
    let [there, _] =
        (args.recorded).load_from(&args.compare, &[], (&rig, args.pendulum), &mut notices)?;
    let request = Request {
        recordings: &recordings,
        rig: &rig,
        verify: &verify,
    };
    let options = Options {
        plan: args.plan,
        same_zero: args.same_zero,
        time_limit: Some(Duration::from_secs_f64(args.time_limit)),
        thorough: args.thorough,
        candidates: &candidates,
        pendulum: args.pendulum,
        compare: &there,
        ..Options::default()
    };
    let samples = samples_looked_at(&recordings, &options);
    args.recorded.foretell(Task::Diagnose, samples);
    let mut outcome = search(&request, options)?;
    let interrupted = outcome.diagnosis.interrupted;
    outcome.diagnosis.notices.splice(0..0, notices);
    if let Some(path) = &args.report {
        path.write(report::html(&outcome.diagnosis, &outcome.curves));
    }
    if let Some(path) = &args.write_rig {
        path.write(outcome.repaired.to_toml());
    }
    let text = || {
        let repaired = args.write_rig.as_ref();
        let given = || args.recorded.rig.clone();
        let rig = repaired.map_or_else(given, Output::to_string);
        let mut text = report::text(&outcome.diagnosis, &rig);
        if args.plan && outcome.diagnosis.plan.is_empty() {
            text += "\nNo experiment is planned: nothing is confusable that a recording could tell apart.\n";
        }
        text
    };
    args.recorded.answer(|| outcome.diagnosis.to_json(), text)?;
    Ok(if interrupted {
        interrupt::EXIT
    } else {
        crate::DONE
    })
}

/// Diagnoses with a progress bar where there is a terminal; Ctrl-C ends it early.
pub(crate) fn search(request: &Request<'_>, options: Options<'_>) -> Result<Outcome, Failure> {
    let bar = progress::stages();
    let flag = interrupt::flag_then_exit();
    let options = Options {
        stop: Some(flag),
        ..options
    };
    let outcome = diagnose_with(request, options, &|progress| {
        bar.set_position(progress.percent as u64);
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
