//! `furuta export`: a rig for MuJoCo or as URDF, a control system as C.

use std::io::Write;
use std::path::PathBuf;

use furuta_export::c::{self, Precision};
use furuta_export::{Exported, mjcf, urdf};
use furuta_model::Rig;

use super::emulate::positive;
use super::run::{load_controller, of_controller, warn_of_another};
use crate::failure::Failure;
use crate::outputs::{self, Output};
use crate::streams::{self, note};

/// Write a rig as a model of MuJoCo or as a robot description, or a control system as one C file.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(clap::Subcommand, Debug)]
enum What {
    Mjcf(MjcfArgs),
    Urdf(UrdfArgs),
    C(CArgs),
}

/// The rig as a model of MuJoCo: motor in volts, friction, springs, tilt, lag and drive as its file names them. What
/// MJCF cannot say is listed on standard error and in the file.
#[derive(clap::Args, Debug)]
struct MjcfArgs {
    /// Built-in rig or rig file, with the effects it names.
    #[arg(long, value_name = "RIG")]
    rig: String,
    /// Step of MuJoCo's integrator.
    #[arg(long, value_name = "SECONDS", default_value_t = mjcf::STEP, value_parser = timestep)]
    timestep: f64,
    /// File to write; standard output if not given.
    #[arg(long, short, visible_alias = "out", value_name = "OUT.xml", value_parser = outputs::data())]
    output: Option<Output>,
}

/// The rig as URDF: bodies, joints, their friction, and a transmission for the motor. What URDF cannot say is listed on
/// standard error and in the file.
#[derive(clap::Args, Debug)]
struct UrdfArgs {
    /// Built-in rig or rig file, with the effects it names.
    #[arg(long, value_name = "RIG")]
    rig: String,
    /// File to write; standard output if not given.
    #[arg(long, short, visible_alias = "out", value_name = "OUT.urdf", value_parser = outputs::data())]
    output: Option<Output>,
}

/// A controller file's whole control system, estimator, swing-up and limits included, as one C99 file without
/// allocation. Its commands are those of `furuta run`, bit for bit.
#[derive(clap::Args, Debug)]
struct CArgs {
    /// Controller file; the standard one if not given.
    #[arg(long, value_name = "FILE.toml")]
    controller: Option<PathBuf>,
    /// Rig that the controller is for: built-in rig or rig file. The one that the controller file was made for if not
    /// given.
    #[arg(long, value_name = "RIG")]
    rig: Option<String>,
    /// Samples per second. The rate that the controller file was made for if not given, or 500.
    #[arg(long, value_name = "HZ", value_parser = positive)]
    rate: Option<f64>,
    /// Compute in `float`, for microcontrollers with single-precision hardware, in place of `double`.
    #[arg(long)]
    single: bool,
    /// File to write; standard output if not given.
    #[arg(long, short, visible_alias = "out", value_name = "OUT.c", value_parser = outputs::data())]
    output: Option<Output>,
}

fn timestep(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (1e-6..=0.01).contains(&value) => Ok(value),
        _ => Err("must be a number from 0.000001 to 0.01 s".to_owned()),
    }
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    match &args.what {
        What::Mjcf(args) => {
            let rig = Rig::load(&args.rig)?;
            model(&mjcf(&rig, args.timestep)?, args.output.as_ref())
        }
        What::Urdf(args) => {
            let rig = Rig::load(&args.rig)?;
            model(&urdf(&rig)?, args.output.as_ref())
        }
        What::C(args) => controller(args),
    }
}

fn model(exported: &Exported, output: Option<&Output>) -> Result<(), Failure> {
    for remark in &exported.left_out {
        note!("{remark}");
    }
    write(&exported.text, output)
}

fn controller(args: &CArgs) -> Result<(), Failure> {
    let file = load_controller(args.controller.as_deref())?;
    let rig = args.rig.as_ref().or(file.made_for.rig.as_ref());
    let rig = rig.ok_or_else(|| {
        Failure::new("which rig the controller is for is not known: give it with --rig")
    })?;
    let rig = Rig::load(rig)?;
    let rate = args.rate.or(file.made_for.rate).unwrap_or(500.0);
    warn_of_another(&file, &rig, rate);
    let precision = if args.single {
        Precision::Single
    } else {
        Precision::Double
    };
    let text = c::controller(&file.config, &rig, 1.0 / rate, precision)
        .map_err(|e| of_controller(args.controller.as_deref(), &e))?;
    write(&text, args.output.as_ref())
}

fn write(text: &str, output: Option<&Output>) -> Result<(), Failure> {
    match output {
        Some(output) => output.write_by(|file| file.write_all(text.as_bytes())),
        None => Ok(streams::output().write_all(text.as_bytes())?),
    }
}
