//! `furuta study fong2014`: paper A's identification, from noise to transfer function.

use std::io::Write;

use furuta_hw::emulate::hidden_effect;
use furuta_ident::frequency::bands::Band;
use furuta_ident::frequency::bode::Bode;
use furuta_ident::frequency::fong2014::{Experiment, ExperimentError, Outcome, published};
use furuta_ident::frequency::transfer::polynomial_text;
use furuta_ident::frequency::words::roots;
use furuta_ident::frequency::{FrequencyError, Hold, Transfer};
use furuta_model::Rig;
use serde_json::{Value, json};

use super::{hertz, seconds};
use crate::commands::emulate::positive;
use crate::commands::identify::tf::{curve, fit_json};
use crate::failure::Failure;
use crate::outputs::{self, Output};
use crate::streams::{self, note};

/// Fong, Jamaludin, Abdullah 2014, sec. 3.2: band-limited white noise into the hanging pendulum, 180 s at 1 kHz;
/// response and transient estimated together; transfer functions of orders 2/4 and 3/4 fitted; beside the
/// first-principles model (28) up to 23 Hz. On the emulated rig, with its encoders.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Built-in rig or rig file.
    #[arg(long, value_name = "RIG", default_value = "fong2014-emecs")]
    rig: String,
    /// Add an effect that the model (28) does not know: ID or ID:NAME=VALUE,... in SI units; may be repeated.
    #[arg(long, value_name = "EFFECT")]
    hide: Vec<String>,
    /// RMS of the noise, units of command.
    #[arg(long, value_name = "VOLTS", default_value_t = Experiment::default().rms,
        value_parser = positive)]
    rms: f64,
    /// Length of the recording, s.
    #[arg(long, value_name = "SECONDS", default_value_t = 180.0, value_parser = seconds)]
    duration: f64,
    /// Samples per second.
    #[arg(long, value_name = "HZ", default_value_t = 1000.0, value_parser = hertz)]
    rate: f64,
    /// Another noise.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Draw the response, the model (28) and the fit: magnitude, phase, coherence (SVG).
    #[arg(long, value_name = "OUT.svg", value_parser = outputs::picture())]
    plot: Option<Output>,
    /// Print one line of JSON in place of text.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut rig = Rig::load(&args.rig)?;
    for text in &args.hide {
        rig.effects.push(hidden_effect(text, &rig.params)?);
    }
    let experiment = Experiment {
        rms: args.rms,
        duration: args.duration,
        rate: args.rate,
        seed: args.seed,
        ..Experiment::default()
    };
    let outcome = experiment.run(&rig).map_err(|error| match error {
        // The resolution is the study's: it is no option.
        ExperimentError::Frequency(FrequencyError::TooShort {
            resolution, needed, ..
        }) => Failure::new(format!(
            "--duration {} s is too short for lines {resolution} Hz apart: give at least {needed} s",
            args.duration
        )),
        other => Failure::from(other),
    })?;
    let hold = Hold::ZeroOrder(1.0 / args.rate);
    if let Some(path) = &args.plot {
        let over = |g: &Transfer| curve(&outcome.frf, hold, g);
        let bode = Bode::new("Fong et al. 2014, sec. 3.2: alpha / u, hanging")
            .measured(&outcome.frf)?
            .model("fit 2/4", &over(&outcome.paper_orders[0].transfer), false)
            .model("(28)", &over(&outcome.first_principles), true);
        path.write(bode.chart().svg());
    }
    for notice in &outcome.notices {
        note!("note: {notice}");
    }
    let mut out = streams::output();
    if args.json {
        return Ok(writeln!(out, "{}", as_json(&rig, &outcome))?);
    }
    out.write_all(text(&rig, &experiment, &outcome).as_bytes())?;
    Ok(())
}

/// The models in the order of [`Outcome::bands`].
fn names(outcome: &Outcome) -> [String; 4] {
    let [zeros, poles] = outcome.chosen.transfer.orders();
    [
        "(28)".to_owned(),
        "fit 2/4".to_owned(),
        "fit 3/4".to_owned(),
        format!("fit {zeros}/{poles}"),
    ]
}

fn text(rig: &Rig, experiment: &Experiment, outcome: &Outcome) -> String {
    let frf = &outcome.frf;
    let mut text = format!(
        "{}: noise of {} RMS up to {} Hz, {} s at {} Hz; the pendulum swings by {:.3} rad RMS\n{}, {:.1} \
         independent averages, {} lines to {} Hz\n",
        rig.name,
        experiment.rms,
        experiment.high,
        experiment.duration,
        experiment.rate,
        outcome.swing,
        frf.method,
        frf.averages,
        frf.frequency.len(),
        experiment.band[1]
    );
    let polynomials = |name: &str, g: &Transfer| {
        format!(
            "  {name:8} ({}) / ({})\n",
            polynomial_text(&g.numerator, 4),
            polynomial_text(&g.denominator, 4)
        )
    };
    let names = names(outcome);
    text += &polynomials(&names[0], &outcome.first_principles);
    let fits = || outcome.paper_orders.iter().chain([&outcome.chosen]);
    for (name, fit) in names[1..].iter().zip(fits()) {
        text += &polynomials(name, &fit.transfer);
    }
    if let Some(paper) = published() {
        text += &polynomials("(29)", &paper);
    }
    text += "  poles, rad/s\n";
    for (name, fit) in names[1..].iter().zip(fits()) {
        let remark = if *name == names[3] {
            ", BIC's choice"
        } else {
            ""
        };
        text += &format!(
            "  {name:8} {}; chi2 {:.2}{remark}\n",
            roots(&fit.poles),
            fit.chi2
        );
    }
    text += "errors against the measured response, RMS: relative %, magnitude dB, phase deg\n";
    text += "  band [Hz]       lines";
    for name in &names {
        text += &format!("  {name:>20}");
    }
    text += "\n";
    for (k, first) in outcome.bands[0].iter().enumerate() {
        text += &format!("  {:>5} to {:>4} {:>8}", first.low, first.high, first.lines);
        for bands in &outcome.bands {
            let b = &bands[k];
            text += &format!(
                "  {:>6.2} {:>6.3} {:>6.2}",
                100.0 * b.relative,
                b.magnitude_db,
                b.phase_deg
            );
        }
        text += "\n";
    }
    text
}

fn as_json(rig: &Rig, outcome: &Outcome) -> Value {
    let bands = |bands: &[Band]| -> Value {
        bands
            .iter()
            .map(|b| {
                json!({"low": b.low, "high": b.high, "lines": b.lines, "relative": b.relative,
                    "magnitude_db": b.magnitude_db, "phase_deg": b.phase_deg})
            })
            .collect()
    };
    let fits = outcome.paper_orders.iter().chain([&outcome.chosen]);
    let models: Vec<Value> = names(outcome)[1..]
        .iter()
        .zip(fits)
        .zip(&outcome.bands[1..])
        .map(|((name, fit), b)| {
            let mut model = fit_json(fit);
            model["name"] = json!(name);
            model["bands"] = bands(b);
            model
        })
        .collect();
    let g = &outcome.first_principles;
    json!({
        "rig": rig.name, "swing": outcome.swing,
        "first_principles": {"numerator": g.numerator, "denominator": g.denominator, "bands": bands(&outcome.bands[0])},
        "fits": models,
    })
}
