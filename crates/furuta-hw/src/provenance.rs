//! What a log says about its run: everything that it takes to do it again, and to know what it was.
//!
//! | Key | What |
//! |---|---|
//! | `rig`, `rig_file` | name; the whole rig file (TOML) |
//! | `effects` | ids of the effects that the rig file has, separated by commas; empty where it has none |
//! | `controller` | the controller in words |
//! | `controller_file` | the whole controller file (TOML); absent where a test signal drives the motor |
//! | [`TASK`] | what the run was asked to do ([`Task`], JSON) |
//! | [`HELLO`] | what the rig said of itself ([`Hello`], JSON): protocol version, name, period, counts, limits, watchdog |
//! | [`COMMAND_UNIT`] | unit of the commands where they are no voltages |
//! | `period_us` | the rig's sampling period (us) |
//! | `software` | program and version that wrote the log |
//! | `protocol` | version of the protocol |
//! | [`STARTED`] | time of day (ns since 1970, UTC) |
//! | `host` | the host's name, operating system and processor |
//! | [`FORMAT`] | version of what these keys hold, 2; logs of furuta without it cannot be replayed |

use std::time::{SystemTime, UNIX_EPOCH};

use furuta_ctrl::ControllerFile;
use furuta_log::{COMMAND_UNIT, Metadata, STARTED};
use furuta_model::{Actuation, Rig};
use furuta_wire::{Hello, PROTOCOL_VERSION};

use crate::pilot::Task;

/// Key of the task.
pub const TASK: &str = "task";
/// Key of the rig's hello.
pub const HELLO: &str = "hello";
/// Key of the controller file.
pub const CONTROLLER_FILE: &str = "controller_file";
/// Key of the version of the keys.
pub const FORMAT: &str = "format";
/// Version of the keys.
pub const FORMAT_VERSION: &str = "2";
/// Program and version, as logs name them.
pub const SOFTWARE: &str = concat!("furuta ", env!("CARGO_PKG_VERSION"));

/// What the log of a run shall say; `words` is the pilot's own description. The controller file is that of a
/// [`Task::Balance`].
#[must_use]
pub fn metadata(
    rig: &Rig,
    controller: Option<&ControllerFile>,
    task: &Task,
    words: String,
    hello: &Hello,
) -> Metadata {
    let effects: Vec<_> = rig.effects.iter().map(|effect| effect.spec().id).collect();
    let mut extra: Vec<(&str, String)> = vec![
        (FORMAT, FORMAT_VERSION.to_owned()),
        (TASK, task.to_json()),
        // A flat record of numbers and a name: JSON holds it.
        (HELLO, serde_json::to_string(hello).unwrap_or_default()),
        ("period_us", hello.period_us.to_string()),
        ("protocol", PROTOCOL_VERSION.to_string()),
        ("effects", effects.join(",")),
        ("host", host()),
        (STARTED, now_ns().to_string()),
    ];
    let actuation = rig.params.motor.actuation;
    if actuation != Actuation::Voltage {
        extra.push((COMMAND_UNIT, actuation.unit().to_owned()));
    }
    extra.extend(controller.map(|file| (CONTROLLER_FILE, file.to_toml())));
    Metadata {
        rig: rig.name.clone(),
        rig_file: rig.to_toml(),
        controller: words,
        software: SOFTWARE.to_owned(),
        extra: extra
            .into_iter()
            .map(|(key, value)| (key.to_owned(), value))
            .collect(),
    }
}

fn now_ns() -> u128 {
    let now = SystemTime::now().duration_since(UNIX_EPOCH);
    now.unwrap_or_default().as_nanos()
}

/// `bench-3, linux, x86_64`; without the name where the system does not tell it as Linux does.
fn host() -> String {
    let (system, processor) = (std::env::consts::OS, std::env::consts::ARCH);
    match std::fs::read_to_string("/proc/sys/kernel/hostname") {
        Ok(name) => format!("{}, {system}, {processor}", name.trim()),
        Err(_) => format!("{system}, {processor}"),
    }
}
