//! Writes a rig file as constants: FURUTA_RIG, a built-in rig or a path, `shahzad2022-srv02` if not set.

use furuta_model::Rig;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::{env, error, fs};

fn main() -> Result<(), Box<dyn error::Error>> {
    let name = env::var("FURUTA_RIG").unwrap_or_else(|_| "shahzad2022-srv02".to_owned());
    let rig = Rig::load(&name).map_err(|error| format!("FURUTA_RIG={name}: {error}"))?;
    let mut source = String::new();
    let bits = |x: f64| format!("f64::from_bits({:#018x})", x.to_bits());
    let option = |x: Option<f64>| x.map_or("None".to_owned(), |x| format!("Some({})", bits(x)));
    let params: Vec<_> = rig.params.to_array().map(bits).into();
    writeln!(
        source,
        "/// Name of the rig.\npub const NAME: &str = {:?};",
        rig.name
    )?;
    writeln!(
        source,
        "/// Its parameters, in the order of `furuta_model::params::RANGES`."
    )?;
    writeln!(
        source,
        "pub const PARAMS: [f64; {}] = [{}];",
        params.len(),
        params.join(", ")
    )?;
    writeln!(
        source,
        "/// What its command is.\npub const ACTUATION: furuta_model::Actuation = furuta_model::Actuation::{:?};",
        rig.params.motor.actuation
    )?;
    let counts = [
        rig.sensors.arm_counts_per_rev,
        rig.sensors.pendulum_counts_per_rev,
    ]
    .map(bits);
    writeln!(
        source,
        "/// Counts per turn of arm and pendulum.\npub const COUNTS: [f64; 2] = [{}];",
        counts.join(", ")
    )?;
    writeln!(
        source,
        "/// Where its file stops a run.\npub const LIMITS: furuta_ctrl::Limits = furuta_ctrl::Limits {{ \
         arm_angle: {}, arm_speed: {}, pendulum_speed: {} }};",
        option(rig.limits.arm_angle),
        option(rig.limits.arm_speed),
        option(rig.limits.pendulum_speed)
    )?;
    let out = PathBuf::from(env::var("OUT_DIR")?);
    fs::write(out.join("rig.rs"), source)?;
    println!("cargo::rerun-if-env-changed=FURUTA_RIG");
    println!("cargo::rerun-if-changed=build.rs");
    if Rig::builtin(&name).is_none() {
        println!("cargo::rerun-if-changed={name}");
    }
    Ok(())
}
