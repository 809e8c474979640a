//! `furuta identify tf`: a transfer function fitted to a frequency response.

use std::io::Write;
use std::path::PathBuf;

use furuta_ident::diagnose::result::significant;
use furuta_ident::frequency::bode::Bode;
use furuta_ident::frequency::first_principles::of_rig;
use furuta_ident::frequency::fit::Uncertain;
use furuta_ident::frequency::orders::sweep;
use furuta_ident::frequency::words::{csv, fit_text};
use furuta_ident::frequency::{Delay, Fit, Frf, Hold, Request, Transfer, fit};
use furuta_ident::report;
use furuta_model::Rig;
use nalgebra::Complex;
use serde_json::{Value, json};

use super::frf::Measure;
use crate::failure::Failure;
use crate::outputs::{self, Output};
use crate::streams::{self, note};

/// Continuous transfer function fitted to the frequency response of recordings, each line weighted by its deviation;
/// coefficients, poles and zeros with their standard deviations. The hold of the command is accounted for.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Recordings of one rig at one rate, CSV or MCAP.
    #[arg(value_name = "DATA", required = true)]
    data: Vec<PathBuf>,
    #[command(flatten)]
    measure: Measure,
    /// Orders of numerator and denominator; the best of all up to order 5 (by BIC) if not given.
    #[arg(long, value_name = "M/N", value_parser = orders)]
    orders: Option<[usize; 2]>,
    /// Delay beyond the hold's own, s, or `fit`.
    #[arg(long, value_name = "SECONDS", default_value = "0", value_parser = delay)]
    delay: Delay,
    /// Take the response as that of a continuous plant: the signals were analogue, or a hold is to be part of the fit.
    #[arg(long)]
    no_hold: bool,
    /// Draw this rig's linear model beside the fit.
    #[arg(long, value_name = "RIG")]
    rig: Option<String>,
    /// Draw the response and the fit over it: magnitude, phase, coherence (SVG).
    #[arg(long, value_name = "OUT.svg", value_parser = outputs::picture())]
    plot: Option<Output>,
    /// Write the response and the fit's, line by line (CSV).
    #[arg(long, value_name = "OUT.csv", value_parser = outputs::data())]
    csv: Option<Output>,
    /// Write a report, one HTML page that needs no network: the plot, what should be known, the numbers.
    #[arg(long, value_name = "OUT.html", value_parser = outputs::page())]
    report: Option<Output>,
    /// Print one line of JSON in place of text.
    #[arg(long)]
    json: bool,
}

fn orders(text: &str) -> Result<[usize; 2], String> {
    let numbers = text
        .split_once('/')
        .and_then(|(m, n)| Some([m.trim().parse().ok()?, n.trim().parse().ok()?]));
    numbers.ok_or_else(|| "must be two orders, as in 2/4".to_owned())
}

fn delay(text: &str) -> Result<Delay, String> {
    if text == "fit" {
        return Ok(Delay::Fitted);
    }
    match text.parse() {
        Ok(seconds) if (0.0..=10.0).contains(&seconds) => Ok(Delay::Known(seconds)),
        _ => Err("must be `fit` or a number of seconds from 0 to 10".to_owned()),
    }
}

/// The highest order that is tried where none was asked for.
const HIGHEST: usize = 5;

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let (frf, mut notices) = args.measure.response(&args.data)?;
    let (frf, ends) = if args.measure.has_band() {
        (frf, None)
    } else {
        frf.coherent()
    };
    notices.extend(ends.map(|notice| notice.to_string()));
    let hold = if args.no_hold {
        Hold::None
    } else {
        Hold::ZeroOrder(frf.sample_period)
    };
    let (best, tried) = match args.orders {
        Some([zeros, poles]) => {
            let request = Request {
                zeros,
                poles,
                hold,
                delay: args.delay,
            };
            (fit(&frf, &request)?, Vec::new())
        }
        None => {
            let tried = sweep(&frf, HIGHEST, hold, args.delay);
            let best = tried.first().cloned().ok_or_else(|| {
                Failure::new("no transfer function could be fitted: widen the band or ask for a finer resolution")
            })?;
            (best, tried)
        }
    };
    notices.extend(best.notices().iter().map(ToString::to_string));
    for notice in &notices {
        note!("note: {notice}");
    }
    let what = args.measure.what();
    let fitted = curve(&frf, hold, &best.transfer);
    let mut bode = Bode::new(&what).measured(&frf)?;
    if let Some(name) = &args.rig {
        let model = of_rig(&Rig::load(name)?, args.measure.angle()?)?;
        bode = bode.model(name, &curve(&frf, hold, &model), true);
    }
    let [zeros, poles] = best.transfer.orders();
    let bode = bode.model(&format!("fit {zeros}/{poles}"), &fitted, false);
    let text = text(&what, &frf, &best, &tried);
    if let Some(path) = &args.csv {
        let fitted: Vec<_> = fitted.iter().map(|c| c.1).collect();
        path.write(csv(&frf, &[("fit", &fitted)]));
    }
    if let Some(path) = &args.report {
        let title = format!("Transfer function {what}");
        path.write(report::frequency(&title, bode.clone(), &text, &notices));
    }
    if let Some(path) = &args.plot {
        path.write(bode.chart().svg());
    }
    let mut out = streams::output();
    if args.json {
        let mut line = fit_json(&best);
        line["what"] = json!(what);
        line["notices"] = json!(notices);
        line["tried"] = tried
            .iter()
            .map(|f| {
                json!({"orders": f.transfer.orders(), "aic": f.aic, "bic": f.bic, "chi2": f.chi2,
                    "stable": f.is_stable()})
            })
            .collect();
        return Ok(writeln!(out, "{line}")?);
    }
    out.write_all(text.as_bytes())?;
    Ok(())
}

/// A model's response as it would be measured.
pub(crate) fn curve(frf: &Frf, hold: Hold, model: &Transfer) -> Vec<(f64, Complex<f64>)> {
    frf.frequency
        .iter()
        .map(|f| (*f, hold.sampled(*f, |s| model.at(s))))
        .collect()
}

fn text(what: &str, frf: &Frf, best: &Fit, tried: &[Fit]) -> String {
    let mut text = String::new();
    if !tried.is_empty() {
        text += "orders       BIC       AIC    chi2\n";
        for f in tried.iter().take(6) {
            let [zeros, poles] = f.transfer.orders();
            text += &format!(
                "  {zeros}/{poles} {:>11.1} {:>9.1} {:>7.2}{}\n",
                f.bic,
                f.aic,
                f.chi2,
                if f.is_stable() { "" } else { "  unstable" }
            );
        }
    }
    let ends = [frf.frequency.first(), frf.frequency.last()];
    let [low, high] = ends.map(|f| significant(f.copied().unwrap_or(0.0), 3));
    text += &format!(
        "{what}, {} lines from {low} to {high} Hz, {}\n",
        frf.frequency.len(),
        frf.method
    );
    text += &fit_text(best);
    text
}

/// A fit for programs.
pub(crate) fn fit_json(fit: &Fit) -> Value {
    let roots = |roots: &[Uncertain<Complex<f64>>]| -> Value {
        roots
            .iter()
            .map(|r| json!({"re": r.value.re, "im": r.value.im, "re_std": r.std.re, "im_std": r.std.im}))
            .collect()
    };
    json!({
        "numerator": fit.transfer.numerator, "numerator_std": fit.numerator_std,
        "denominator": fit.transfer.denominator, "denominator_std": fit.denominator_std,
        "delay": fit.delay.value, "delay_std": fit.delay.std,
        "poles": roots(&fit.poles), "zeros": roots(&fit.zeros),
        "chi2": fit.chi2, "aic": fit.aic, "bic": fit.bic, "parameters": fit.parameters, "rank": fit.rank,
        "relative_error": fit.relative_error, "stable": fit.is_stable(),
    })
}
