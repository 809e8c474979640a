//! Writes the parameters of the built-in rigs that take a voltage as constants (rig files need std, the target has
//! none), and tells the linker the board's memory.

use furuta_model::Rig;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::{env, error, fs};

fn main() -> Result<(), Box<dyn error::Error>> {
    let mut source = String::from("&[\n");
    for name in Rig::VOLTAGE {
        let rig = Rig::builtin(name).ok_or_else(|| format!("{name} is not a built-in rig"))?;
        writeln!(
            source,
            "    ({name:?}, Params::from_array(furuta_model::Actuation::{:?}, [",
            rig.params.motor.actuation
        )?;
        for value in rig.params.to_array() {
            let bits = value.to_bits();
            writeln!(source, "        f64::from_bits({bits:#018x}), // {value:?}")?;
        }
        source.push_str("    ])),\n");
    }
    source.push_str("]\n");
    let out = PathBuf::from(env::var("OUT_DIR")?);
    fs::write(out.join("rigs.rs"), source)?;

    if env::var("CARGO_CFG_TARGET_OS")? == "none" {
        println!(
            "cargo::rustc-link-search={}",
            env::var("CARGO_MANIFEST_DIR")?
        );
        println!("cargo::rustc-link-arg-bins=-Tlink.x");
    }
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=memory.x");
    Ok(())
}
