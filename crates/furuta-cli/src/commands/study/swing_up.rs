//! `furuta study swing-up`: many rigs that are not quite as their file says, swung up from hanging.

use std::io::Write;
use std::path::{Path, PathBuf};

use furuta_chart::{Chart, Line, Panel};
use furuta_ctrl::Config;
use furuta_ctrl::trajectory::WhenLost;
use furuta_design::optimal::{SwingUp, SwingUpError, SwingUpProblem};
use furuta_design::reach::{Reach, Search};
use furuta_design::swing_up::{
    Attempt, Outcome, PUSH, SETTLED, Study, StudyError, UPRIGHT as NEAR,
};
use furuta_model::Rig;
use serde_json::json;

use super::parts::{PartArgs, Parts};
use super::rig_with;
use crate::commands::emulate::positive;
use crate::commands::progress::bar;
use crate::commands::run::{load_controller, of_controller};
use crate::failure::Failure;
use crate::outputs::{self, Output};
use crate::streams;

/// The share of the drawn rigs that shall come up. Where fewer do, the command looks for the reason.
const GOAL: f64 = 0.995;
/// More rigs than anyone waits for.
const MOST_DRAWS: usize = 1_000_000;
/// Nearer to upright than this, a search has brought a rig up, rad.
const UPRIGHT: f64 = 0.1;

/// Swing up rigs drawn about a rig file, from hanging, with its encoders and voltage limit, dry friction that the
/// control system does not know, and one sample of delay; push each one over once it is up. Where fewer than 99.5 of
/// 100 come up, a search over all voltages says whether the rig can be brought up at all.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Built-in rig or rig file; may be repeated. All built-in ones if not given.
    #[arg(long, value_name = "RIG")]
    rig: Vec<String>,
    /// Replace a value of the rig files, for example motor.command_limit=15; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Controller file; the standard control system if not given.
    #[arg(long, value_name = "FILE.toml")]
    controller: Option<PathBuf>,
    /// How many rigs are drawn.
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = draws)]
    draws: usize,
    /// Seed of the draws.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// How far each parameter is off at most, of its value.
    #[arg(long, value_name = "SHARE", default_value_t = 0.1, value_parser = share)]
    spread: f64,
    /// Samples per second.
    #[arg(long, value_name = "HZ", default_value_t = 500.0, value_parser = positive)]
    rate: f64,
    /// Arm limit; that of the rig or controller file if not given, else a turn.
    #[arg(long, value_name = "RAD", value_parser = positive)]
    arm_limit: Option<f64>,
    /// An attempt ends after this time.
    #[arg(long, value_name = "SECONDS", default_value_t = 30.0, value_parser = positive)]
    patience: f64,
    /// Beside energy swing-up, follow one that is optimised for the rig file (`furuta design swing-up`) on the same
    /// draws.
    #[arg(long)]
    optimise: bool,
    /// Draw the share that is up over time, from hanging and after the push (SVG).
    #[arg(long, value_name = "OUT.svg", value_parser = outputs::picture())]
    plot: Option<Output>,
    #[command(flatten)]
    part: PartArgs,
    /// Print one line of JSON per rig in place of text.
    #[arg(long)]
    json: bool,
}

/// How many rigs can be drawn and waited for.
fn draws(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(n) if (1..=MOST_DRAWS).contains(&n) => Ok(n),
        _ => Err(format!("must be a whole number from 1 to {MOST_DRAWS}")),
    }
}

fn share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.0..=0.5).contains(&value) => Ok(value),
        _ => Err("must be a number from 0 to 0.5".to_owned()),
    }
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let names: Vec<&str> = if args.rig.is_empty() {
        Rig::VOLTAGE.to_vec()
    } else {
        args.rig.iter().map(String::as_str).collect()
    };
    let file = args.controller.as_deref();
    let config = load_controller(file)?.config;
    let parts = args.part.open(args.plot.is_some())?;
    let mut drawn = Vec::new();
    let mut followed = Vec::new();
    for name in names {
        let mut rig = rig_with(name, &args.set)?;
        if args.arm_limit.is_some() {
            rig.limits.arm_angle = args.arm_limit;
        }
        let study = Study {
            config: config.clone(),
            period: 1.0 / args.rate,
            seed: args.seed,
            spread: args.spread,
            patience: args.patience,
            ..Study::new(rig.clone(), args.draws)
        };
        let attempts = attempts(&study, file, &parts)?;
        let optimised = if args.optimise {
            Some(optimised(&study, file, &parts)?)
        } else {
            None
        };
        let Some(attempts) = attempts else {
            continue;
        };
        let outcome = Outcome::of(&attempts);
        let limit = if (outcome.up as f64) < GOAL * outcome.attempts as f64 {
            Some(best_possible(&rig)?)
        } else {
            None
        };
        let optimised = optimised.flatten();
        if args.json {
            print_json(
                args,
                &rig.name,
                &outcome,
                limit.as_ref(),
                optimised.as_ref(),
            )?;
        } else {
            print_text(&rig, &outcome, limit.as_ref())?;
            if let Some(optimised) = &optimised {
                print_optimised(&outcome, optimised)?;
            }
        }
        if let Some(Ok(found)) = optimised {
            followed.push((format!("{}, optimised", rig.name), found.attempts));
        }
        drawn.push((rig.name, attempts));
    }
    if let Some(path) = &args.plot {
        drawn.extend(followed);
        path.write(chart(&drawn, args.draws).svg());
    }
    Ok(())
}

/// Every draw of a study, unless one part of them was asked for.
fn attempts(
    study: &Study,
    file: Option<&Path>,
    parts: &Parts,
) -> Result<Option<Vec<Attempt>>, Failure> {
    parts.runs(&format!("swing-up {study:?}"), study.draws, |draws| {
        let progress = bar(draws.len() as u64);
        let attempts = study.part(draws, &|done| progress.set_position(done as u64));
        let attempts = attempts.map_err(|e| match e {
            StudyError::Config(_) => of_controller(file, &e),
            e => e.into(),
        })?;
        progress.finish_and_clear();
        Ok(attempts)
    })
}

/// A swing-up that is optimised for the rig of the file, and what came of it on the drawn ones.
struct Optimised {
    /// The fastest that the search finds, with all of the voltage.
    fastest: SwingUp,
    /// What is followed: some voltage is left to the feedback.
    design: SwingUp,
    attempts: Vec<Attempt>,
    outcome: Outcome,
}

/// Designs for the rig of the file and follows on the drawn ones; the reason where there is none. Nothing where one
/// part of the draws was asked for.
fn optimised(
    study: &Study,
    file: Option<&Path>,
    parts: &Parts,
) -> Result<Option<Result<Optimised, SwingUpError>>, Failure> {
    let find = |problem: &SwingUpProblem| {
        let progress = bar(problem.programs());
        let found = problem.solve(&|done| progress.set_position(done));
        progress.finish_and_clear();
        found
    };
    let design = match find(&SwingUpProblem::new(study.rig.clone())) {
        Ok(found) => found,
        Err(error @ SwingUpError::NotFound { .. }) => return Ok(Some(Err(error))),
        Err(error) => return Err(Failure::new(error.to_string())),
    };
    let study = Study {
        config: Config {
            trajectory: Some(design.trajectory(WhenLost::Energy)?),
            ..study.config.clone()
        },
        ..study.clone()
    };
    let Some(attempts) = attempts(&study, file, parts)? else {
        return Ok(None);
    };
    let fastest = match find(&SwingUpProblem::fastest(study.rig.clone())) {
        Ok(found) => found,
        Err(error @ SwingUpError::NotFound { .. }) => return Ok(Some(Err(error))),
        Err(error) => return Err(Failure::new(error.to_string())),
    };
    Ok(Some(Ok(Optimised {
        fastest,
        design,
        outcome: Outcome::of(&attempts),
        attempts,
    })))
}

fn print_optimised(
    energy: &Outcome,
    optimised: &Result<Optimised, SwingUpError>,
) -> Result<(), Failure> {
    let mut out = streams::output();
    let found = match optimised {
        Ok(found) => found,
        Err(error) => return Ok(writeln!(out, "  optimised: {error}")?),
    };
    let best = found.fastest.arrival(NEAR);
    writeln!(
        out,
        "  optimised: the rig of the file is within {NEAR} rad of upright from {:.2} s on (fastest: {best:.2} s)",
        found.design.arrival(NEAR)
    )?;
    writeln!(
        out,
        "             {:>9}{:>16}{:>16}{:>14}{:>15}",
        "up", "there, median", "95 of 100", "of fastest", "arm, median"
    )?;
    for (name, o) in [("energy", energy), ("optimised", &found.outcome)] {
        writeln!(
            out,
            "  {name:10} {:>8.1} %{:>14.2} s{:>14.2} s{:>14.2}{:>11.2} rad",
            100.0 * o.up as f64 / o.attempts.max(1) as f64,
            o.arrival[0],
            o.arrival[1],
            o.arrival[0] / best,
            o.median_arm
        )?;
    }
    Ok(())
}

/// What commands that know the model and the future come to on the rig of the file.
fn best_possible(rig: &Rig) -> Result<Reach, Failure> {
    let arm = rig.limits.arm_angle.unwrap_or(std::f64::consts::TAU);
    let search = Search::new(arm);
    let progress = bar(search.restarts * search.rounds);
    let reach = search.run(rig, &|done| progress.set_position(done))?;
    progress.finish_and_clear();
    Ok(reach)
}

fn print_text(rig: &Rig, o: &Outcome, limit: Option<&Reach>) -> Result<(), Failure> {
    let mut out = streams::output();
    let percent = |n: usize, of: usize| 100.0 * n as f64 / of.max(1) as f64;
    writeln!(
        out,
        "{}: {} of {} up for {SETTLED} s ({:.1} %)",
        rig.name,
        o.up,
        o.attempts,
        percent(o.up, o.attempts)
    )?;
    writeln!(out, "  {}", times(o.time))?;
    writeln!(
        out,
        "  pushed to {PUSH} times the pendulum's frequency: {} of {} up again ({:.1} %)",
        o.up_again,
        o.up,
        percent(o.up_again, o.up)
    )?;
    writeln!(out, "  {}", times(o.time_again))?;
    writeln!(
        out,
        "  {:.2} catches let go per draw; the command jumps at a catch by {:.0} % of its range (median; \
         {:.0} % at most); arm to {:.2} rad at most, {} faults",
        o.dropped,
        100.0 * o.jump[0],
        100.0 * o.jump[1],
        o.arm,
        o.faults
    )?;
    let Some(r) = limit else { return Ok(()) };
    let actuation = rig.params.motor.actuation;
    let (command, unit) = (actuation.name(), actuation.unit());
    let most = rig.params.motor.command_limit;
    if r.nearest < UPRIGHT {
        writeln!(
            out,
            "  why: not for want of {command}: a search over every course of it brings the rig of the file up in \
             {:.2} s",
            r.at
        )?;
    } else {
        writeln!(
            out,
            "  why: no {command} within {most} {unit} brings the rig of the file nearer to upright than {:.2} \
             rad, as far as a search finds:\n  of the {:.4} J that the arm puts into the pendulum, the \
             hinge's friction leaves {:.4} J; upright takes {:.4} J",
            r.nearest,
            r.work,
            r.work - r.friction,
            r.needed
        )?;
    }
    Ok(())
}

fn print_json(
    args: &Args,
    name: &str,
    o: &Outcome,
    limit: Option<&Reach>,
    optimised: Option<&Result<Optimised, SwingUpError>>,
) -> Result<(), Failure> {
    let times = |t: [f64; 3]| {
        json!({"median": finite(t[0]), "p95": finite(t[1]), "longest": finite(t[2]),
            "unit": "s"})
    };
    let limit = limit.map(|r| {
        json!({
            "nearest": r.nearest, "nearest_unit": "rad", "work": r.work, "friction": r.friction, "needed": r.needed,
            "energy_unit": "J",
        })
    });
    let optimised = optimised.map(|found| match found {
        Err(error) => json!({"error": error.to_string()}),
        Ok(found) => json!({
            "seconds": found.design.seconds(), "arrival_of_design": found.design.arrival(NEAR),
            "fastest": found.fastest.seconds(), "arrival_of_fastest": found.fastest.arrival(NEAR), "unit": "s",
            "up": found.outcome.up, "time": times(found.outcome.time), "arrival": times(found.outcome.arrival),
            "arm": {"median": found.outcome.median_arm, "largest": found.outcome.arm, "unit": "rad"},
            "faults": found.outcome.faults,
        }),
    });
    let line = json!({
        "rig": name, "set": args.set, "draws": o.attempts, "seed": args.seed, "spread": args.spread, "rate": args.rate,
        "up": o.up, "time": times(o.time), "pushed": o.up, "up_again": o.up_again, "time_again": times(o.time_again),
        "dropped_per_draw": o.dropped, "jump_of_range": {"median": o.jump[0], "largest": o.jump[1]},
        "arm": {"largest": o.arm, "unit": "rad"}, "faults": o.faults, "limit": limit,
        "arrival": times(o.arrival), "median_arm": o.median_arm, "optimised": optimised,
    });
    writeln!(streams::output(), "{line}")?;
    Ok(())
}

fn times([median, late, longest]: [f64; 3]) -> String {
    if median.is_nan() {
        return "none to take the time of".to_owned();
    }
    format!("median {median:.2} s, 95 of 100 within {late:.2} s, longest {longest:.2} s")
}

/// JSON knows no NaN.
fn finite(x: f64) -> Option<f64> {
    x.is_finite().then_some(x)
}

/// The share that is up, over time; on the right, where most of them are long up, nothing is to be seen.
fn chart(drawn: &[(String, Vec<Attempt>)], draws: usize) -> Chart {
    const SHOWN: f64 = 12.0;
    let panel = |label: &str, time: fn(&Attempt) -> Option<f64>, of: fn(&Attempt) -> bool| {
        let lines = drawn.iter().map(|(name, attempts)| {
            let asked = attempts.iter().filter(|a| of(a)).count().max(1) as f64;
            let mut t: Vec<f64> = attempts.iter().filter_map(time).collect();
            t.sort_by(f64::total_cmp);
            let up_at = |at: f64| 100.0 * t.partition_point(|t| *t <= at) as f64 / asked;
            Line::new(
                name,
                (0..=240)
                    .map(|k| SHOWN / 240.0 * f64::from(k))
                    .map(|s| (s, up_at(s))),
            )
        });
        Panel::new(label, lines.collect()).showing(0.0, 102.0)
    };
    Chart::new(
        &format!("Swing-up of {draws} drawn rigs each"),
        "t [s]",
        vec![
            panel("up from hanging [%]", |a| a.up, |_| true),
            panel("up after the push [%]", |a| a.up_again, |a| a.up.is_some()),
        ],
    )
}
