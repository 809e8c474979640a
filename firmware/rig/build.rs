//! Writes a rig file and a controller file as constants: `FURUTA_RIG`, a built-in rig or a path, `shahzad2022-srv02` if
//! not set, and `FURUTA_CONTROLLER`, a path, the standard control system if not set.

use furuta_ctrl::supervisor::Supervisor;
use furuta_ctrl::{Config, ControllerFile, Site};
use furuta_model::{Effect, Rig};
use std::fmt::Write as _;
use std::path::PathBuf;
use std::{env, error, fs};

/// Samples per second where the controller file does not say it, Hz.
const RATE: f64 = 500.0;
/// Slowest and fastest, Hz: the watchdog of the wire takes two samples at least and lasts 20 ms; the longest control
/// step takes 0.4 ms (docs/firmware.md).
const RATES: [f64; 2] = [100.0, 2000.0];

type Failure = Box<dyn error::Error>;

fn main() -> Result<(), Failure> {
    println!("cargo::rerun-if-changed=build.rs");
    let mut name = given("FURUTA_RIG").unwrap_or_else(|| "shahzad2022-srv02".to_owned());
    if Rig::builtin(&name).is_none() {
        name = watched(&name);
    }
    let rig = Rig::load(&name).map_err(|error| format!("FURUTA_RIG={name}: {error}"))?;
    let rig = of_catalogue(rig);
    let mut source = String::new();
    write_rig(&mut source, &rig)?;
    let path = given("FURUTA_CONTROLLER").map(|path| watched(&path));
    let file = path
        .as_ref()
        .map_or_else(|| Ok(ControllerFile::default()), ControllerFile::load);
    let file = file.map_err(|error| format!("FURUTA_CONTROLLER: {error}"))?;
    let path = path.as_deref().unwrap_or("(none)");
    write_controller(&mut source, &rig, &file)
        .map_err(|error| format!("FURUTA_CONTROLLER={path}: {error}"))?;
    let out = PathBuf::from(env::var("OUT_DIR")?);
    fs::write(out.join("rig.rs"), source)?;
    Ok(())
}

/// An environment variable on which the constants depend.
fn given(name: &str) -> Option<String> {
    println!("cargo::rerun-if-env-changed={name}");
    env::var(name).ok()
}

/// A file on which the constants depend: a relative path counts from where cargo was called, not from this folder.
fn watched(path: &str) -> String {
    let called_in = env::var_os("PWD").map(PathBuf::from).unwrap_or_default();
    let path = called_in.join(path).display().to_string();
    println!("cargo::rerun-if-changed={path}");
    path
}

/// A number, bit for bit.
fn bits(x: f64) -> String {
    format!("f64::from_bits({:#018x})", x.to_bits())
}

fn list<T>(all: impl IntoIterator<Item = T>, one: impl Fn(T) -> String) -> String {
    all.into_iter().map(one).collect::<Vec<_>>().join(", ")
}

/// The rig with those of its effects that the chip knows.
fn of_catalogue(mut rig: Rig) -> Rig {
    rig.effects.retain(|e| {
        let is_own = matches!(e, Effect::Own(_));
        if is_own {
            println!(
                "cargo::warning={}: a law of one's own is not carried into the firmware; it works without {}",
                rig.name,
                e.spec().id
            );
        }
        !is_own
    });
    rig
}

fn write_rig(source: &mut String, rig: &Rig) -> Result<(), Failure> {
    let option = |x: Option<f64>| x.map_or("None".to_owned(), |x| format!("Some({})", bits(x)));
    let params = rig.params.to_array();
    let counts = [
        rig.sensors.arm_counts_per_rev,
        rig.sensors.pendulum_counts_per_rev,
    ];
    writeln!(
        source,
        "/// Name of the rig.\npub const NAME: &str = {:?};\n\
         /// Its parameters, in the order of `furuta_model::params::RANGES`.\n\
         pub const PARAMS: [f64; {}] = [{}];\n\
         /// What its command is.\n\
         pub const ACTUATION: furuta_model::Actuation = furuta_model::Actuation::{:?};\n\
         /// Counts per turn of arm and pendulum.\npub const COUNTS: [f64; 2] = [{}];\n\
         /// Where its file stops a run.\n\
         pub const LIMITS: furuta_ctrl::Limits = furuta_ctrl::Limits {{ \
         arm_angle: {}, arm_speed: {}, pendulum_speed: {} }};",
        rig.name,
        params.len(),
        list(params, bits),
        rig.params.motor.actuation,
        list(counts, bits),
        option(rig.limits.arm_angle),
        option(rig.limits.arm_speed),
        option(rig.limits.pendulum_speed)
    )?;
    let values = |e: &Effect<f64>| list(e.values(), bits);
    writeln!(
        source,
        "/// The effects that its file names, with their values.\n\
         pub const EFFECTS: [(&str, &[f64]); {}] = [{}];",
        rig.effects.len(),
        list(&rig.effects, |e| format!(
            "({:?}, &[{}])",
            e.spec().id,
            values(e)
        ))
    )?;
    Ok(())
}

fn write_controller(source: &mut String, rig: &Rig, file: &ControllerFile) -> Result<(), Failure> {
    let rate = file.made_for.rate.unwrap_or(RATE);
    let period_us = (1e6 / rate).round();
    if !(RATES[0]..=RATES[1]).contains(&rate) || (1e6 / rate - period_us).abs() > 1e-6 * period_us {
        return Err(format!(
            "made_for.rate = {rate} Hz: the firmware samples at {} to {} Hz, in whole microseconds; design for such a \
             rate (furuta design --rate)",
            RATES[0], RATES[1]
        )
        .into());
    }
    if let Some(other) = file.made_for.rig.as_ref().filter(|made| **made != rig.name) {
        println!(
            "cargo::warning=the controller file was made for the rig {other}, FURUTA_RIG is {}",
            rig.name
        );
    }
    // What is refused here would leave the chip without a control system.
    Supervisor::<f32>::design(&file.config, &Site::of(rig, 1e-6 * period_us))?;
    let bytes = postcard::to_allocvec::<Config>(&file.config)?;
    writeln!(
        source,
        "/// Sampling period, us.\npub const PERIOD_US: u32 = {period_us};\n\
         /// The controller file's settings, as postcard writes a [`furuta_ctrl::Config`].\n\
         const CONTROLLER: [u8; {}] = [{}];",
        bytes.len(),
        list(bytes.iter(), u8::to_string)
    )?;
    Ok(())
}
