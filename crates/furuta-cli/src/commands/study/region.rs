//! `furuta study region`: from where each controller brings the pendulum back.

use std::io::Write;
use std::path::{Path, PathBuf};

use furuta_chart::{Map, Maps};
use furuta_ctrl::controllers;
use furuta_ctrl::settings::Settings;
use furuta_ctrl::supervisor::Supervisor;
use furuta_ctrl::{Config, ConfigError, ControllerFile, Site};
use furuta_design::region::{Grid, On, Reach, Region};
use furuta_model::{Rig, State};
use serde_json::json;

use super::parts::{PartArgs, Parts};
use super::rig_with;
use crate::commands::emulate::positive;
use crate::commands::progress::bar;
use crate::commands::run::of_controller;
use crate::failure::Failure;
use crate::outputs::{self, Output};
use crate::streams;

/// From which angles and speeds of the pendulum, the arm at rest, each controller brings it upright: the share of a
/// grid about upright, with perfect states and the rig's voltage limit. Beside it the share from which the voltage
/// suffices for the linearised plant: no linear reasoning promises more.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Built-in rig or rig file; may be repeated. All built-in ones if not given.
    #[arg(long, value_name = "RIG")]
    rig: Vec<String>,
    /// Replace a value of the rig files, for example motor.command_limit=15; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Controller file, or `all` for every kind with its standard settings; may be repeated.
    #[arg(long, value_name = "FILE.toml|all")]
    controller: Vec<PathBuf>,
    /// Largest angle from upright.
    #[arg(long, value_name = "RAD", default_value_t = 1.2, value_parser = positive)]
    alpha: f64,
    /// Largest speed, of the pendulum's small-angle frequency.
    #[arg(long, value_name = "RATIO", default_value_t = 2.0, value_parser = positive)]
    speed: f64,
    /// Points along each axis.
    #[arg(long, value_name = "N", default_value_t = 61, value_parser = clap::value_parser!(u16).range(2..=1000))]
    points: u16,
    /// Samples per second.
    #[arg(long, value_name = "HZ", default_value_t = 500.0, value_parser = positive)]
    rate: f64,
    /// Arm limit; that of the rig or controller file if not given, else a turn.
    #[arg(long, value_name = "RAD", value_parser = positive)]
    arm_limit: Option<f64>,
    /// Draw a map per rig and controller (SVG).
    #[arg(long, value_name = "OUT.svg", value_parser = outputs::picture())]
    plot: Option<Output>,
    #[command(flatten)]
    part: PartArgs,
    /// Print one line of JSON per rig in place of text.
    #[arg(long)]
    json: bool,
}

/// One controller on one rig.
struct Row {
    name: String,
    /// `None` where the rig cannot have it, and why.
    region: Result<Region, String>,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let names: Vec<&str> = if args.rig.is_empty() {
        Rig::VOLTAGE.to_vec()
    } else {
        args.rig.iter().map(String::as_str).collect()
    };
    let parts = args.part.open(args.plot.is_some())?;
    let contenders = contenders(&args.controller)?;
    let grid = Grid {
        alpha: args.alpha,
        speed: args.speed,
        points: usize::from(args.points),
    };
    let mut maps = Vec::new();
    for name in names {
        let mut rig = rig_with(name, &args.set)?;
        if args.arm_limit.is_some() {
            rig.limits.arm_angle = args.arm_limit;
        }
        let reach = Reach::of(&rig)?;
        let Some(rows) = rows(args, &rig, &contenders, &grid, &parts)? else {
            continue;
        };
        let possible = share_possible(reach.as_ref(), &rows);
        if args.json {
            print_json(args, &rig, possible, &rows)?;
        } else {
            print_text(&rig, possible, &rows)?;
        }
        let frequency = Site::of(&rig, 1.0 / args.rate).frequency();
        let of_rig = rows
            .iter()
            .map(|row| map(row, reach.as_ref(), &grid, frequency));
        maps.push((rig.name.clone(), of_rig.collect()));
    }
    let Some(path) = &args.plot else {
        return Ok(());
    };
    let maps = Maps {
        title: "Starts that come upright; dashed: what any command holds, were the plant linear",
        across: ("alpha [rad]", grid.alpha),
        up: ("alpha_dot over frequency", grid.speed),
        rows: maps,
    };
    path.write(maps.svg());
    Ok(())
}

/// A controller asked for.
struct Contender<'a> {
    name: String,
    /// `None` of one of the catalogue with its standard settings.
    file: Option<&'a Path>,
    config: Config,
}

fn contenders(files: &[PathBuf]) -> Result<Vec<Contender<'_>>, Failure> {
    let mut out = Vec::new();
    let every = controllers::CATALOGUE.iter().map(|spec| Contender {
        name: spec.id.to_owned(),
        file: None,
        config: Config::with_controller(Settings::new(spec)),
    });
    if files.is_empty() {
        out.extend(every.clone());
    }
    for file in files {
        if file.as_os_str() == "all" {
            out.extend(every.clone());
            continue;
        }
        let name = file.file_stem().unwrap_or(file.as_os_str());
        out.push(Contender {
            name: name.to_string_lossy().into_owned(),
            file: Some(file),
            config: ControllerFile::load(file)?.config,
        });
    }
    Ok(out)
}

fn rows(
    args: &Args,
    rig: &Rig,
    contenders: &[Contender<'_>],
    grid: &Grid,
    parts: &Parts,
) -> Result<Option<Vec<Row>>, Failure> {
    let period = 1.0 / args.rate;
    let starts = grid.starts();
    let progress = bar((starts * contenders.len()) as u64);
    let (mut rows, mut whole) = (Vec::new(), true);
    for (k, contender) in contenders.iter().enumerate() {
        let config = &contender.config;
        let region = match Supervisor::<f64>::design(config, &Site::of(rig, period)) {
            Ok(control) => {
                let about = format!("region {rig:?} {config:?} {grid:?} {period}");
                let inside = parts.runs(&about, starts, |some| {
                    Ok(Region::part(
                        rig,
                        On::Rig,
                        &control.balance,
                        grid,
                        period,
                        control.thresholds.arm_angle_limit,
                        some,
                        &|done| progress.set_position((k * starts + done) as u64),
                    )?)
                })?;
                let Some(inside) = inside else {
                    whole = false;
                    continue;
                };
                Ok(Region::from_inside(rig, grid, period, inside))
            }
            Err(error @ ConfigError::Unsuitable { .. }) => Err(error.to_string()),
            Err(error) => return Err(of_controller(contender.file, &error)),
        };
        rows.push(Row {
            name: contender.name.clone(),
            region,
        });
    }
    progress.finish_and_clear();
    Ok(whole.then_some(rows))
}

/// The share of the grid from which the linearised plant can be held at all.
fn share_possible(reach: Option<&Reach>, rows: &[Row]) -> Option<f64> {
    let grid = rows.iter().find_map(|row| row.region.as_ref().ok())?;
    let reach = reach?;
    let starts = grid.alpha_dot.iter().flat_map(|v| {
        let at = move |a: &f64| State::new(0.0, *a, 0.0, *v);
        grid.alpha.iter().map(at)
    });
    let held = starts.filter(|x| reach.holds(x)).count();
    Some(held as f64 / grid.inside.len() as f64)
}

fn print_text(rig: &Rig, possible: Option<f64>, rows: &[Row]) -> Result<(), Failure> {
    let mut out = streams::output();
    match possible {
        Some(share) => writeln!(
            out,
            "{}: linearised, {:.1} % of the starts can be held by {} {}",
            rig.name,
            100.0 * share,
            rig.params.motor.command_limit,
            rig.params.motor.actuation.unit()
        )?,
        None => writeln!(out, "{}", rig.name)?,
    }
    for row in rows {
        match &row.region {
            Ok(region) => writeln!(out, "  {:22}{:5.1} %", row.name, 100.0 * region.share())?,
            Err(why) => writeln!(out, "  {:22}{why}", row.name)?,
        }
    }
    Ok(())
}

fn print_json(args: &Args, rig: &Rig, possible: Option<f64>, rows: &[Row]) -> Result<(), Failure> {
    let controllers: Vec<_> = rows
        .iter()
        .map(|row| match &row.region {
            Ok(region) => json!({"name": row.name, "share": region.share()}),
            Err(why) => json!({"name": row.name, "share": null, "why": why}),
        })
        .collect();
    let line = json!({
        "rig": rig.name, "set": args.set, "rate": args.rate,
        "grid": {"points": args.points, "alpha": {"value": args.alpha, "unit": "rad"},
            "speed_over_frequency": args.speed},
        "linear_share": possible, "controllers": controllers,
    });
    writeln!(streams::output(), "{line}")?;
    Ok(())
}

fn map(row: &Row, reach: Option<&Reach>, grid: &Grid, frequency: f64) -> Map {
    let edge = |sign: f64, reach: &Reach| -> Vec<(f64, f64)> {
        [-grid.alpha, grid.alpha]
            .map(|a| (a, reach.edge(a, sign) / frequency))
            .to_vec()
    };
    let (share, filled) = match &row.region {
        Ok(region) => (
            format!("{:.0} %", 100.0 * region.share()),
            region.inside.clone(),
        ),
        Err(_) => ("not on this rig".to_owned(), Vec::new()),
    };
    Map {
        title: format!("{}, {share}", row.name),
        columns: grid.points,
        filled,
        lines: reach.map_or_else(Vec::new, |r| vec![edge(1.0, r), edge(-1.0, r)]),
    }
}
