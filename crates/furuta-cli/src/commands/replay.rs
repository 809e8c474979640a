//! `furuta replay`: a log through the estimator and controller that made it, compared bit for bit; or through others.

use std::fmt::Write as _;
use std::io::Write;
use std::path::PathBuf;

use furuta_ctrl::ControllerFile;
use furuta_hw::replay::{Finding, Hole};
use furuta_hw::{Replay, ReplayOptions, replay};
use furuta_log::{Log, LogError, Mode};
use furuta_model::Rig;
use serde_json::{Value, json};

use crate::failure::Failure;
use crate::outputs::{self, Output};
use crate::streams::{self, note};

/// Run a log through the estimator and controller that made it and compare what they command with what is logged, bit
/// for bit. With --controller or --rig: what another controller, or the same one designed for another rig file, would
/// have commanded.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Log of `furuta run`.
    #[arg(value_name = "LOG")]
    log: PathBuf,
    /// Another controller: what it would have commanded at these measurements.
    #[arg(long, value_name = "FILE.toml")]
    controller: Option<PathBuf>,
    /// Another rig file to design the controller for.
    #[arg(long, value_name = "RIG")]
    rig: Option<String>,
    /// Take a rig file of another rig than the log's all the same.
    #[arg(long)]
    any_rig: bool,
    /// Compare all the same where another version of furuta wrote the log.
    #[arg(long)]
    any_version: bool,
    /// Write both commands, modes and estimates, one row per sample.
    #[arg(long, value_name = "OUT.csv", value_parser = outputs::data())]
    csv: Option<Output>,
    /// Print JSON in place of text.
    #[arg(long)]
    json: bool,
}

/// Runs the command. Fails where the log's own controller does not give what is logged.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let name = args.log.display();
    let log = furuta_log::read(&args.log).map_err(|e| match e {
        LogError::Open { .. } => Failure::from(e), // names the file itself
        other => Failure::new(format!("{name}: {other}")),
    })?;
    let options = ReplayOptions {
        controller: args
            .controller
            .as_ref()
            .map(ControllerFile::load)
            .transpose()?,
        rig: args.rig.as_deref().map(Rig::load).transpose()?,
        any_rig: args.any_rig,
        any_version: args.any_version,
    };
    let replayed = replay(&log, &options).map_err(|e| Failure::new(format!("{name}: {e}")))?;
    if let Some(path) = &args.csv {
        path.write(csv(&log, &replayed));
    }
    if args.json {
        writeln!(streams::output(), "{}", report(args, &log, &replayed))?;
    } else {
        if let Some(notice) = &log.notice {
            note!("{name}: {notice}");
        }
        if replayed.is_identical() || !replayed.same_pilot {
            let text = replayed.to_string();
            writeln!(streams::output(), "{}", furuta_input::plain(&text))?;
        }
    }
    if replayed.same_pilot && !replayed.is_identical() {
        return Err(Failure::new(format!("{name}: {replayed}")));
    }
    Ok(())
}

/// A recording with the replayed columns behind the logged ones: `furuta diagnose` and every spreadsheet read it.
fn csv(log: &Log, replayed: &Replay) -> String {
    let mut text = String::from(
        "t,u,theta,alpha,theta_dot,alpha_dot,reference,command,mode,replayed_theta_dot,replayed_alpha_dot,\
         replayed_reference,replayed_command,replayed_mode\n",
    );
    for (logged, r) in log.records.iter().zip(&replayed.samples) {
        // Writing to a String cannot fail.
        let _ = writeln!(
            text,
            "{},{},{},{},{},{},{},{},{},{},{},{},{},{}",
            logged.t,
            logged.u,
            logged.theta,
            logged.alpha,
            logged.theta_dot,
            logged.alpha_dot,
            logged.reference,
            logged.command,
            logged.mode,
            r.theta_dot,
            r.alpha_dot,
            r.reference,
            r.command,
            r.mode
        );
    }
    text
}

fn report(args: &Args, log: &Log, replayed: &Replay) -> Value {
    json!({
        "log": args.log.display().to_string(),
        "identical": replayed.is_identical(),
        "same_pilot": replayed.same_pilot,
        "pilot": replayed.pilot,
        "records": log.records.len(),
        "replayed": replayed.samples.len(),
        "equal": replayed.equal,
        "first": replayed.first.as_ref().map(first),
        "largest": replayed.largest.map(|(index, value)| json!({ "index": index, "value": value, "unit": "V" })),
        "missing": replayed.hole.map(|Hole { index, records, t }| {
            json!({ "index": index, "records": records, "t": t })
        }),
        "fault": replayed.fault.as_ref().map(|(index, fault)| json!({ "index": index, "says": fault.to_string() })),
        "notice": log.notice.as_ref().map(ToString::to_string),
        "summary": replayed.to_string(),
    })
}

fn first(finding: &Finding) -> Value {
    match finding {
        Finding::Impossible(found) => json!({
            "index": found.index, "seq": found.seq, "column": found.name, "value": found.value,
            "says": found.to_string(),
        }),
        Finding::Differs(found) => {
            let quantities = found.quantities.iter().map(|q| {
                json!({ "column": q.name, "unit": q.unit, "logged": q.logged, "replayed": q.replayed, "ulps": q.ulps })
            });
            json!({
                "index": found.index, "seq": found.seq, "t": found.t, "modes": found.modes.map(Mode::name),
                "quantities": quantities.collect::<Vec<_>>(), "says": found.to_string(),
            })
        }
    }
}
