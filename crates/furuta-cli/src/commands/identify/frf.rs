//! `furuta identify frf`: a frequency response from recordings.

use std::io::Write;
use std::path::PathBuf;

use furuta_ident::frequency::bode::Bode;
use furuta_ident::frequency::first_principles::Output;
use furuta_ident::frequency::record::{Columns, Taken};
use furuta_ident::frequency::words::{csv, response_text};
use furuta_ident::frequency::{Estimator, Frf, Measurement, Method, Window};
use furuta_ident::recording::Recording;
use furuta_ident::report;
use serde_json::json;

use crate::commands::emulate::positive;
use crate::failure::Failure;
use crate::outputs;
use crate::streams::{self, note};

/// Frequency response from recordings, with coherence and confidence: together with its transient, by averaging
/// windowed segments (Welch; the same numbers as SciPy's csd), or from whole periods of a periodic signal.
///
/// It is the response of the sampled plant: the hold of the command, half a sample of delay, is in it.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Recordings of one rig at one rate, CSV or MCAP; averaged together.
    #[arg(value_name = "DATA", required = true)]
    data: Vec<PathBuf>,
    #[command(flatten)]
    measure: Measure,
    /// Write frequency, real and imaginary part, magnitude, phase, coherence and deviation (CSV).
    #[arg(long, value_name = "OUT.csv", value_parser = outputs::data())]
    csv: Option<outputs::Output>,
    /// Draw magnitude, phase and coherence (SVG).
    #[arg(long, value_name = "OUT.svg", value_parser = outputs::picture())]
    plot: Option<outputs::Output>,
    /// Write a report, one HTML page that needs no network: the plot, what should be known, the numbers.
    #[arg(long, value_name = "OUT.html", value_parser = outputs::page())]
    report: Option<outputs::Output>,
    /// Print one line of JSON in place of text.
    #[arg(long)]
    json: bool,
}

/// How a response is taken from recordings.
#[derive(clap::Args, Debug)]
pub(crate) struct Measure {
    /// The plant's output: alpha, theta, or another column.
    #[arg(
        long = "column",
        alias = "output",
        value_name = "COLUMN",
        default_value = "alpha"
    )]
    output: String,
    /// Its input.
    #[arg(long, value_name = "COLUMN", default_value = "u")]
    input: String,
    /// The signal that no controller chose (`excitation`, `reference`, ...): joint input-output estimate, for
    /// recordings in closed loop.
    #[arg(long, value_name = "COLUMN")]
    reference: Option<String>,
    /// How the response is formed; with --reference, h1 and h2 both mean the joint quotient of averaged spectra.
    #[arg(long, value_enum, default_value_t = By::Local, conflicts_with = "period")]
    estimator: By,
    /// Distance of lines; a tenth of the longest stretch gives it if not given.
    #[arg(long, value_name = "HZ", value_parser = positive, conflicts_with = "period")]
    resolution: Option<f64>,
    /// Window of averaged segments: rectangular, hann (if not given), hamming, blackman, blackmanharris, flattop.
    #[arg(long, value_name = "NAME", conflicts_with = "period")]
    window: Option<Window>,
    /// Part of an averaged segment that it shares with the next; half if not given.
    #[arg(long, value_name = "PART", value_parser = part, conflicts_with = "period")]
    overlap: Option<f64>,
    /// The signal repeats after so long (`furuta run` prints a multisine's period): lines without leakage, deviation
    /// from the periods' spread; with a multisine of --harmonics detecting, nonlinear distortion is told from noise.
    #[arg(long, value_name = "SECONDS", value_parser = positive)]
    period: Option<f64>,
    /// Periods left out at the start, in which the start still rings.
    #[arg(long, value_name = "N", default_value_t = 1, requires = "period")]
    discard: usize,
    /// Frequencies to give; all if not given.
    #[arg(long, value_name = "LOW,HIGH", value_parser = crate::commands::signal::band, allow_hyphen_values = true)]
    band: Option<[f64; 2]>,
}

#[derive(clap::ValueEnum, Copy, Clone, Debug, PartialEq, Eq)]
enum By {
    /// Response and transient together, by the local rational method: no leakage.
    Local,
    /// Cross spectrum over the input's: right with noise on the output.
    H1,
    /// The output's spectrum over the cross spectrum: right with noise on the input.
    H2,
}

fn part(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(x) if (0.0..=0.95).contains(&x) => Ok(x),
        _ => Err("must be a number from 0 to 0.95".to_owned()),
    }
}

impl Measure {
    /// Whether a band was asked for.
    pub(crate) fn has_band(&self) -> bool {
        self.band.is_some()
    }

    /// The response, and what should be known about it.
    pub(crate) fn response(&self, data: &[PathBuf]) -> Result<(Frf, Vec<String>), Failure> {
        let mut said = Vec::new();
        let mut recordings = Vec::new();
        for path in data {
            let (recording, notices) = Recording::load_with_notices(path)?;
            said.extend(notices.iter().map(ToString::to_string));
            recordings.push(recording);
        }
        let columns = Columns {
            input: &self.input,
            output: &self.output,
            external: self.reference.as_deref(),
        };
        let taken = Taken::from_recordings(&recordings, columns)?;
        let measurement = Measurement {
            method: self.method()?,
            resolution: self.resolution,
            band: self.band,
        };
        let (frf, notices) = measurement.response(&taken)?;
        said.extend(notices.iter().map(ToString::to_string));
        Ok((frf, said))
    }

    fn method(&self) -> Result<Method, Failure> {
        if let Some(period) = self.period {
            return Ok(Method::Periodic {
                period,
                discard: self.discard,
            });
        }
        let estimator = match (&self.reference, self.estimator) {
            (_, By::Local) if self.window.is_some() || self.overlap.is_some() => {
                return Err(Failure::new(
                    "--window and --overlap belong to averaged segments: give --estimator h1 or h2 with them, or \
                     leave them out",
                ));
            }
            (_, By::Local) => return Ok(Method::Local),
            (Some(_), _) => Estimator::Joint,
            (None, By::H1) => Estimator::H1,
            (None, By::H2) => Estimator::H2,
        };
        Ok(Method::Averaged {
            estimator,
            window: self.window.unwrap_or_default(),
            overlap: self.overlap.unwrap_or(0.5),
        })
    }

    /// The angle that is the output, for a rig's model of it.
    pub(crate) fn angle(&self) -> Result<Output, Failure> {
        match (self.output.as_str(), self.input.as_str()) {
            ("theta", "u") => Ok(Output::Theta),
            ("alpha", "u") => Ok(Output::Alpha),
            _ => Err(Failure::new(format!(
                "a rig's model is of theta / u and alpha / u, not of {}",
                self.what()
            ))),
        }
    }

    /// The band asked for, or another.
    pub(crate) fn band_or(&self, other: [f64; 2]) -> [f64; 2] {
        self.band.unwrap_or(other)
    }

    /// What the response is of: `alpha / u`.
    pub(crate) fn what(&self) -> String {
        format!("{} / {}", self.output, self.input)
    }
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let (frf, notices) = args.measure.response(&args.data)?;
    for notice in &notices {
        note!("note: {notice}");
    }
    let what = args.measure.what();
    let bode = Bode::new(&what).measured(&frf)?;
    let text = response_text(&what, &frf)?;
    if let Some(path) = &args.csv {
        path.write(csv(&frf, &[]));
    }
    if let Some(path) = &args.report {
        let title = format!("Frequency response {what}");
        path.write(report::frequency(&title, bode.clone(), &text, &notices));
    }
    if let Some(path) = &args.plot {
        path.write(bode.chart().svg());
    }
    let mut out = streams::output();
    if args.json {
        let line = json!({
            "what": what, "method": frf.method, "averages": frf.averages, "resolution": frf.resolution(),
            "sample_period": frf.sample_period, "notices": notices, "frequency": frf.frequency,
            "real": frf.response.iter().map(|h| h.re).collect::<Vec<_>>(),
            "imaginary": frf.response.iter().map(|h| h.im).collect::<Vec<_>>(),
            "coherence": frf.coherence, "std": frf.std, "distortion": frf.distortion,
        });
        return Ok(writeln!(out, "{line}")?);
    }
    out.write_all(text.as_bytes())?;
    Ok(())
}
