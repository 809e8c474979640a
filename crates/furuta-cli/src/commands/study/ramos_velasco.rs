//! `furuta study ramos-velasco`: a pendulum that follows a sine, on wrong parameters.

use std::io::Write;

use furuta_chart::{Chart, Line, Panel};
use furuta_design::closed_loop::Sample;
use furuta_design::largest_sine;
use furuta_design::ramos_velasco::{
    Contender, Draws, Experiment, Factors, NOMINAL, Outcome, draws,
};
use furuta_model::Rig;
use serde_json::{Value, json};

use crate::commands::emulate::positive;
use crate::commands::progress::bar;
use crate::failure::Failure;
use crate::outputs::{self, Output};
use crate::print::significant;
use crate::streams;

/// Ramos-Velasco, Ruiz-Leon, Celikovsky: the pendulum follows a sine from beta = -alpha far off, while arm length,
/// pendulum length and pendulum mass are off for a while. Output regulator, sliding mode in normal form, sliding modes
/// on an LQR's surface.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// On what.
    #[arg(long, value_enum, default_value_t = On::Planar)]
    on: On,
    /// Draws of the three parameters, each uniform within the spread.
    #[arg(long, value_name = "N", default_value_t = 500)]
    draws: usize,
    /// How far parameters are off, of their value.
    #[arg(long, value_name = "SHARE", default_value_t = 0.2, value_parser = share)]
    spread: f64,
    /// Seed of the draws.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Built-in rig or rig file.
    #[arg(long, value_name = "RIG", default_value = "ramos-velasco")]
    rig: String,
    /// Frequency of the sine.
    #[arg(long, value_name = "RAD/S", value_parser = positive)]
    lambda: Option<f64>,
    /// Its amplitude.
    #[arg(long, value_name = "RAD", value_parser = positive)]
    amplitude: Option<f64>,
    /// beta at the start.
    #[arg(long, value_name = "RAD", allow_hyphen_values = true)]
    start: Option<f64>,
    /// Order of the power series, 1 to 7.
    #[arg(long, value_name = "N")]
    order: Option<usize>,
    /// Size of the switching term of (54).
    #[arg(long, value_name = "RAD/S2", value_parser = positive)]
    gamma: Option<f64>,
    /// Half of its layer's width.
    #[arg(long, value_name = "RAD/S", value_parser = positive)]
    eps: Option<f64>,
    /// Time constant of the filter behind it.
    #[arg(long, value_name = "SECONDS", value_parser = positive)]
    filter: Option<f64>,
    /// Draw it (SVG): nominal, off, and the tracking error over all draws.
    #[arg(long, value_name = "OUT.svg", value_parser = outputs::picture())]
    plot: Option<Output>,
    /// Print one line of JSON in place of text.
    #[arg(long)]
    json: bool,
}

/// On what the controllers work.
#[derive(clap::ValueEnum, Copy, Clone, Debug, PartialEq, Eq)]
enum On {
    /// The paper's planar model with perfect states at 1 kHz.
    Planar,
    /// The full model, with the centrifugal moment, and an amplitude that it can follow.
    Full,
    /// The full model at 500 Hz with encoders and dry friction.
    Rig,
}

fn share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.0..=0.9).contains(&value) => Ok(value),
        _ => Err("must be a number between 0 and 0.9".to_owned()),
    }
}

/// One contender's runs.
struct Row {
    contender: Contender,
    /// Nominal; all three above; all three below.
    runs: [(Outcome, Vec<Sample>); 3],
    draws: Option<Draws>,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let rig = Rig::load(&args.rig)?;
    let experiment = experiment(args, &rig);
    let bar = bar((Contender::ALL.len() * args.draws) as u64);
    let off = |factor: f64| -> Factors { [1.0 + factor * args.spread; 3] };
    let mut rows = Vec::new();
    for contender in Contender::ALL {
        if contender == Contender::Regulator && rig.name != "ramos-velasco" {
            continue; // its gain is printed for the paper's rig alone
        }
        bar.set_prefix(contender.name());
        let tracker = experiment.controller(contender)?;
        let run = |factors| -> Result<_, Failure> {
            let samples = experiment.run(&tracker, factors)?;
            Ok((experiment.outcome(&samples), samples))
        };
        let drawn = match args.draws {
            0 => None,
            n => Some(draws(
                &experiment,
                contender,
                n,
                args.spread,
                args.seed,
                &|| bar.inc(1),
            )?),
        };
        rows.push(Row {
            contender,
            runs: [run(NOMINAL)?, run(off(1.0))?, run(off(-1.0))?],
            draws: drawn,
        });
    }
    bar.finish_and_clear();
    if let Some(path) = &args.plot {
        path.write(chart(args, &experiment, &rows).svg());
    }
    let mut out = streams::output();
    if args.json {
        writeln!(out, "{}", json(args, &experiment, &rows)?)?;
    } else {
        out.write_all(text(args, &experiment, &rows)?.as_bytes())?;
    }
    Ok(())
}

fn experiment(args: &Args, rig: &Rig) -> Experiment {
    let mut e = match args.on {
        On::Planar => Experiment::paper(rig),
        On::Full => Experiment::full(rig),
        On::Rig => Experiment::rig_like(rig),
    };
    let set = |value: Option<f64>, place: &mut f64| *place = value.unwrap_or(*place);
    set(args.lambda, &mut e.lambda);
    set(args.amplitude, &mut e.amplitude);
    set(args.start, &mut e.start);
    set(args.gamma, &mut e.tuning.switching.gamma);
    set(args.eps, &mut e.tuning.switching.eps);
    set(args.filter, &mut e.tuning.switching.filter);
    e.order = args.order.unwrap_or(e.order);
    e
}

/// How well the series solves the regulator equation, and the largest sine that can be followed at all.
fn limits(e: &Experiment) -> Result<(f64, Option<f64>), Failure> {
    let c = e.coefficients(NOMINAL);
    let residual = e.steady()?.residual(&c, e.amplitude);
    Ok((residual, largest_sine::amplitude(&c, e.lambda)))
}

fn json(args: &Args, e: &Experiment, rows: &[Row]) -> Result<Value, Failure> {
    let (residual, largest) = limits(e)?;
    let outcome = |o: &Outcome| {
        json!({"up": o.up, "bound": finite(o.bound), "rms": finite(o.rms), "theta_max": o.theta,
            "u_max": o.command, "chatter": o.chatter})
    };
    let rows: Vec<_> = rows
        .iter()
        .map(|row| {
            let [nominal, above, below] = &row.runs;
            let drawn = row.draws.as_ref().map(|d| {
                let s = d.summary();
                json!({"up": s.up, "median_bound": finite(s.median), "worst_bound": s.worst,
                    "median_rms": finite(s.rms), "median_chatter": s.chatter})
            });
            json!({
                "controller": row.contender.name(), "nominal": outcome(&nominal.0), "above": outcome(&above.0),
                "below": outcome(&below.0),
                "draws": drawn,
            })
        })
        .collect();
    Ok(json!({
        "rig": e.rig.name, "planar": e.planar, "lambda": e.lambda, "amplitude": e.amplitude, "start": e.start,
        "order": e.order,
        "rate": e.rate, "spread": args.spread, "draws": args.draws, "seed": args.seed, "off": e.off,
        "series_residual": residual, "largest_amplitude": largest, "controllers": rows,
    }))
}

/// JSON has no infinity: `null`.
fn finite(x: f64) -> Option<f64> {
    x.is_finite().then_some(x)
}

fn text(args: &Args, e: &Experiment, rows: &[Row]) -> Result<String, Failure> {
    let (residual, largest) = limits(e)?;
    let model = if e.planar {
        "planar model"
    } else {
        "full model"
    };
    let seen = match e.encoders {
        Some(_) => format!(
            "encoders, friction {} N m unknown to the controllers",
            e.friction
        ),
        None => "perfect states".to_owned(),
    };
    let mut text = format!(
        "{}, {model}, {seen}, {} Hz: beta from {} to {} sin({} t), l1, l2, m2 off by {:.0} % from {} to {} s\n",
        e.rig.name,
        e.rate,
        e.start,
        e.amplitude,
        e.lambda,
        100.0 * args.spread,
        e.off[0],
        e.off[1]
    );
    text += &format!(
        "the series of order {} solves the regulator equation to {} %; ",
        e.order,
        significant(100.0 * residual)
    );
    text += &match largest {
        Some(largest) => {
            format!("the largest sine that this pendulum can follow at all: {largest:.4} rad\n")
        }
        None => "any sine up to 1.5 rad can be followed\n".to_owned(),
    };
    text += "                        bound of the tracking error [mrad]    largest   largest   variation";
    text += if args.draws > 0 {
        "   draws: bound [mrad]     up\n"
    } else {
        "\n"
    };
    text += &format!(
        "                         nominal   all +{0:.0} %   all -{0:.0} %    arm [rad]   u [V]    of u [V/s]",
        100.0 * args.spread
    );
    text += if args.draws > 0 {
        "   median    worst       %\n"
    } else {
        "\n"
    };
    for row in rows {
        let bound = |o: &Outcome| milli(if o.up { o.bound } else { f64::INFINITY });
        let [(nominal, _), (above, _), (below, _)] = &row.runs;
        text += &format!(
            "  {:21} {:>9} {:>11} {:>11} {:>12.2} {:>7.1} {:>13.1}",
            row.contender.name(),
            bound(nominal),
            bound(above),
            bound(below),
            nominal.theta,
            nominal.command,
            nominal.chatter
        );
        if let Some(drawn) = &row.draws {
            let s = drawn.summary();
            text += &format!(
                " {:>8} {:>8} {:>7.1}",
                milli(s.median),
                milli(s.worst),
                100.0 * s.up
            );
        }
        text += "\n";
    }
    text += &format!(
        "bound: largest |beta - beta_ref| from {} to {} s; worst: of the draws that stayed up",
        e.off[0] + 2.0,
        e.off[1]
    );
    text += &match args.draws {
        0 => "\n".to_owned(),
        n => format!(", {n} within {:.0} %\n", 100.0 * args.spread),
    };
    Ok(text)
}

fn milli(bound: f64) -> String {
    if bound.is_finite() {
        format!("{:.2}", 1e3 * bound)
    } else {
        "fell".to_owned()
    }
}

fn chart(args: &Args, e: &Experiment, rows: &[Row]) -> Chart {
    let shown = |row: &&Row| row.contender != Contender::RegulatorLqr;
    let beta = |place: usize| {
        let mut lines: Vec<Line> = rows
            .iter()
            .filter(shown)
            .enumerate()
            .map(|(k, row)| {
                let samples = row.runs[place].1.iter();
                Line::new(row.contender.name(), samples.map(|s| (s.t, -s.x.alpha))).colour(k)
            })
            .collect();
        if let Some(row) = rows.first() {
            let samples = row.runs[place].1.iter();
            let reference = samples.map(|s| (s.t, -s.reference.alpha));
            lines.push(Line::new("reference", reference).dashed().colour(6));
        }
        lines
    };
    let range = |panel: Panel| panel.showing(-1.8 * e.amplitude, 1.8 * e.amplitude);
    let percent = 100.0 * args.spread;
    let mut panels = vec![
        range(Panel::new("beta [rad], nominal", beta(0))),
        range(Panel::new(
            &format!("beta [rad], all +{percent:.0} %"),
            beta(1),
        )),
    ];
    // The paper's two; four areas over one another would be one grey.
    let papers = |row: &&Row| matches!(row.contender, Contender::Regulator | Contender::NormalForm);
    let areas: Vec<Line> = rows
        .iter()
        .filter(papers)
        .enumerate()
        .filter_map(|(k, row)| {
            let envelope = &row.draws.as_ref()?.envelope;
            let low = envelope.iter().map(|p| (p.0, p.1));
            let high = envelope.iter().map(|p| (p.0, p.2));
            Some(Line::between(row.contender.name(), low, high).colour(k))
        })
        .collect();
    if !areas.is_empty() {
        let label = format!("error [rad], {} draws", args.draws);
        panels.push(range(Panel::new(&label, areas)));
    }
    let commands = rows
        .iter()
        .filter(shown)
        .enumerate()
        .map(|(k, row)| {
            let samples = row.runs[1].1.iter();
            Line::new(row.contender.name(), samples.map(|s| (s.t, s.u))).colour(k)
        })
        .collect();
    panels.push(Panel::new(&format!("u [V], all +{percent:.0} %"), commands));
    let title = match args.on {
        On::Planar => "Ramos-Velasco et al., Fig. 5 and 6: planar model",
        On::Full => "Ramos-Velasco et al. on the full model",
        On::Rig => "Ramos-Velasco et al. on the full model, encoders, friction",
    };
    Chart::new(title, "t [s]", panels)
}
