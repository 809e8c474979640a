//! `furuta emulate`: a rig on a pseudo-terminal, for any program that speaks the wire protocol.

use std::io::Write;
use std::time::Duration;

use furuta_ctrl::Config;
use furuta_hw::emulate::hidden_effect;
use furuta_hw::{EmulatedRig, Emulation, Pace, PtyRig, Reference};
use furuta_model::{Effect, Params, Rig};
use serde_json::json;

use super::foresight::Foresight;
use crate::failure::Failure;
use crate::interrupt;
use crate::streams::{self, note};

/// Emulate a rig behind a pseudo-terminal, in real time, until Ctrl-C. Prints the port's path.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Built-in rig or rig file.
    #[arg(long, value_name = "RIG", default_value = "qube-servo-2")]
    rig: String,
    #[command(flatten)]
    emulation: EmulationArgs,
    /// Switch off after this many seconds.
    #[arg(long, value_name = "SECONDS", value_parser = positive)]
    duration: Option<f64>,
    /// Tick when the host has answered instead of by the clock: as fast as both can.
    #[arg(long)]
    host_led: bool,
    /// Print one line of JSON in place of text.
    #[arg(long)]
    json: bool,
}

/// How a rig is emulated.
#[derive(clap::Args, Debug)]
pub(crate) struct EmulationArgs {
    /// Hide an effect that the rig file does not tell of: ID or ID:NAME=VALUE,... in SI units; may be repeated.
    #[arg(long, value_name = "EFFECT")]
    hide: Vec<String>,
    /// Samples per second of an emulated rig; 500 if not given.
    #[arg(long, value_name = "HZ", value_parser = positive)]
    rate: Option<f64>,
}

/// Samples per second of an emulated rig, if none are given.
const RATE: f64 = 500.0;

impl EmulationArgs {
    /// Refuses what only an emulated rig has.
    pub(crate) fn not_on_a_port(&self) -> Result<(), Failure> {
        let refuse = |name: &str, own: &str| {
            Err(Failure::new(format!(
                "{name} belongs to --emulated: a rig on a port has its own {own}; leave {name} out"
            )))
        };
        match (self.hide.is_empty(), self.rate) {
            (false, _) => refuse("--hide", "effects"),
            (true, Some(_)) => refuse("--rate", "rate, which the run takes over"),
            (true, None) => Ok(()),
        }
    }

    fn hidden(&self, params: &Params<f64>) -> Result<Vec<Effect<f64>>, Failure> {
        let effects = self.hide.iter();
        effects
            .map(|text| Ok(hidden_effect(text, params)?))
            .collect()
    }

    /// The rig, switched off.
    pub(crate) fn rig(&self, rig: &Rig) -> Result<EmulatedRig, Failure> {
        Ok(EmulatedRig::new(rig, &self.emulation(rig)?)?)
    }

    /// How it is emulated.
    fn emulation(&self, rig: &Rig) -> Result<Emulation, Failure> {
        let hidden = self.hidden(&rig.params)?;
        // The cast saturates; the emulation checks the range.
        let period_us = (1e6 / self.rate.unwrap_or(RATE)).round() as u32;
        Ok(Emulation {
            period_us,
            hidden,
            ..Emulation::default()
        })
    }
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let rig = Rig::load(&args.rig)?;
    let emulated = args.emulation.rig(&rig)?;
    let pace = if args.host_led {
        Pace::HostLed
    } else {
        Pace::RealTime
    };
    let period_us = emulated.period_us();
    let foresight = foresee(&rig, &args.emulation.emulation(&rig)?);
    let rig_on = PtyRig::start(emulated, pace)?;
    let mut out = streams::output();
    if args.json {
        let line = json!({
            "port": rig_on.path(), "rig": rig.name, "period_us": period_us, "hidden": args.emulation.hide,
        });
        writeln!(out, "{line}")?;
    } else {
        // The path alone on standard output, so that a script can take it.
        writeln!(out, "{}", rig_on.path())?;
        note!(
            "{} at {} Hz; Ctrl-C switches it off",
            rig.name,
            1e6 / f64::from(period_us)
        );
    }
    out.flush()?;
    if let Some(warning) = foresight.as_ref().and_then(Foresight::warning) {
        note!("note: {warning}");
    }
    interrupt::wait(args.duration.map(Duration::from_secs_f64));
    Ok(())
}

/// How `furuta run` would do on this rig; `None` where no controller can be designed for it.
fn foresee(rig: &Rig, emulation: &Emulation) -> Option<Foresight> {
    let standard = Config::default();
    Foresight::of(rig, emulation, &standard, Reference::Constant(0.0))
}

/// A number above zero that is a sensible time or rate.
pub(crate) fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value <= 1e6 => Ok(value),
        _ => Err("must be a number above 0, at most 1000000".to_owned()),
    }
}
