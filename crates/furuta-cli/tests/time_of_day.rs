//! The host's time of day steps by an hour while a rig is balanced: a library loaded before libc answers every look at
//! it so.
#![cfg(target_os = "linux")]

use crate::common;

use std::process::Command;

use common::{Folder, furuta};
use serde_json::Value;

#[test]
fn a_time_of_day_that_steps_is_not_noticed() {
    let folder = Folder::new("time-of-day");
    let (library, log) = (folder.path("stepping_clock.so"), folder.path("run.mcap"));
    let source = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/stepping_clock.c");
    let built = Command::new("cc")
        .args(["-shared", "-fPIC", "-O1", "-o"])
        .arg(&library)
        .args([source, "-ldl"])
        .output()
        .expect("the C compiler that links Rust programs");
    assert!(built.status.success(), "{built:?}");

    let output = furuta(&["run", "--emulated", "shahzad2022-srv02", "--json"])
        .args(["--duration", "4", "--log"])
        .arg(&log)
        .env("LD_PRELOAD", &library)
        .env("STEPPING_CLOCK_COUNTS", "1")
        .output()
        .expect("the binary runs");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let looks: u32 = said
        .lines()
        .find_map(|l| l.strip_prefix("looks at the time of day: "))
        .and_then(|n| n.parse().ok())
        .expect("the library was loaded");
    assert!(looks > 0, "the log's beginning is a time of day");

    let report: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(report["end"], "finished");
    assert_eq!(report["lost"], 0);
    let modes = report["modes"].as_array().expect("modes");
    assert_eq!(modes.last().expect("some")["mode"], "balance");
    // The log's times are those of the rig's clock: 2 ms apart, none twice, none missing.
    let log = furuta_log::read(&log).expect("a log");
    assert!(log.records.len() >= 1990, "{}", log.records.len());
    for pair in log.records.windows(2) {
        assert!((pair[1].t - pair[0].t - 0.002).abs() < 1e-9, "{pair:?}");
    }
}
