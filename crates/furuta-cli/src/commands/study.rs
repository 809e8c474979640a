//! `furuta study`: experiments on controllers, the source papers' among them.

mod calibration;
mod estimators;
mod fong2014;
mod frequency_coverage;
mod limit_cycle;
mod mpc;
mod parts;
mod ramos_velasco;
mod reach;
mod region;
mod shahzad2022;
mod swing_up;

use furuta_model::params::RANGES;
use furuta_model::{Params, Rig};

use crate::failure::Failure;

/// Experiments on controllers: those of the source papers, repeated and drawn; swing-up of many rigs that are not quite
/// as their file says; a step with and without limits in mind; regions of attraction.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    #[command(subcommand)]
    study: Study,
}

#[derive(clap::Subcommand, Debug)]
enum Study {
    #[command(name = "fong2014")]
    Fong2014(fong2014::Args),
    FrequencyCoverage(frequency_coverage::Args),
    #[command(name = "shahzad2022")]
    Shahzad2022(shahzad2022::Args),
    RamosVelasco(ramos_velasco::Args),
    SwingUp(swing_up::Args),
    Reach(reach::Args),
    Mpc(mpc::Args),
    Estimators(estimators::Args),
    LimitCycle(limit_cycle::Args),
    Region(region::Args),
    Calibration(calibration::Args),
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    match &args.study {
        Study::Fong2014(args) => fong2014::run(args),
        Study::FrequencyCoverage(args) => frequency_coverage::run(args),
        Study::Shahzad2022(args) => shahzad2022::run(args),
        Study::RamosVelasco(args) => ramos_velasco::run(args),
        Study::SwingUp(args) => swing_up::run(args),
        Study::Reach(args) => reach::run(args),
        Study::Mpc(args) => mpc::run(args),
        Study::Estimators(args) => estimators::run(args),
        Study::LimitCycle(args) => limit_cycle::run(args),
        Study::Region(args) => region::run(args),
        Study::Calibration(args) => calibration::run(args),
    }
}

/// Length of a run that can be judged and waited for, s.
fn seconds(text: &str) -> Result<f64, String> {
    within(text, 1.0, 3600.0, "s")
}

/// A sampling rate that a real loop could have, Hz.
fn hertz(text: &str) -> Result<f64, String> {
    within(text, 10.0, 20_000.0, "Hz")
}

fn within(text: &str, least: f64, most: f64, unit: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(x) if (least..=most).contains(&x) => Ok(x),
        _ => Err(format!("must be a number from {least} to {most} {unit}")),
    }
}

/// A rig with some of its file's values replaced, each given as KEY=VALUE.
fn rig_with(name: &str, changes: &[String]) -> Result<Rig, Failure> {
    let mut rig = Rig::load(name)?;
    let mut values = rig.params.to_array();
    for change in changes {
        let wrong = || {
            Failure::new(format!(
                "{change:?} is not KEY=NUMBER, as in motor.command_limit=15"
            ))
        };
        let (key, value) = change.split_once('=').ok_or_else(wrong)?;
        let place = RANGES
            .iter()
            .position(|range| range.key == key.trim())
            .ok_or_else(|| {
                let keys: Vec<_> = RANGES.iter().map(|range| range.key).collect();
                Failure::new(format!(
                    "a rig has no {key:?}: give one of {}",
                    keys.join(", ")
                ))
            })?;
        let actuation = rig.params.motor.actuation;
        if !actuation.uses(RANGES[place].key) {
            return Err(Failure::new(format!(
                "{} does not enter the equations of rig {name}, whose motor.kind is \"{actuation}\"",
                RANGES[place].key
            )));
        }
        values[place] = value.trim().parse().map_err(|_| wrong())?;
    }
    rig.params = Params::from_array(rig.params.motor.actuation, values);
    rig.params.validate()?;
    Ok(rig)
}
