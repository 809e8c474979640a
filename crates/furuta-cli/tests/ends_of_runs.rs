//! Signals, files that may not grow, logs that are removed: what `furuta run` makes of them.
#![cfg(unix)]

use crate::common;

use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use common::{Folder, furuta, last_line};
use furuta_hw::{EmulatedRig, Emulation, Pace, PtyRig};

const RIG: &str = "shahzad2022-srv02";

fn signal(child: &Child, name: &str) {
    let pid = child.id().to_string();
    let sent = Command::new("kill").args([name, &pid]).status();
    assert!(sent.expect("kill is there").success());
}

/// Whether programs that are started here ignore SIGHUP, as below `nohup make test`: they keep to that and do not end.
fn hangups_are_ignored() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = (status.lines()).find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = ignored.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask & 1 != 0)
}

/// Waits until a second or so of the run is in the log.
fn under_way(log: &Path) {
    for _ in 0..1200 {
        if std::fs::metadata(log).is_ok_and(|m| m.len() > 50_000) {
            return;
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    panic!("the run does not begin");
}

#[test]
fn a_run_ends_at_a_signal_as_at_ctrl_c() {
    let names = ["-INT", "-TERM", "-HUP"].into_iter();
    for name in names.filter(|name| *name != "-HUP" || !hangups_are_ignored()) {
        let folder = Folder::new(&format!("ends{name}"));
        let log = folder.path("run.mcap");
        let rig = furuta_model::Rig::builtin(RIG).expect("built in");
        let emulation = Emulation {
            watchdog_periods: u16::MAX,
            ..Emulation::default()
        };
        let emulated = EmulatedRig::new(&rig, &emulation).expect("valid");
        let rig = PtyRig::start(emulated, Pace::Patient).expect("a port");
        let run = furuta(&["run", "--port", rig.path(), "--rig", RIG, "--any-clock"])
            .args(["--duration", "600", "--json", "--log"])
            .arg(&log)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("runs");
        under_way(&log);
        signal(&run, name);
        let output = run.wait_with_output().expect("ends by itself");
        assert_eq!(output.status.code(), Some(0), "{name}: {output:?}");
        let summary: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        assert_eq!(summary["end"], "stopped", "{name}");
        // The motor is off by the host's word: this rig's watchdog does nothing.
        let mut rig = rig.unplug().expect("alive");
        assert_eq!(rig.tick().volts, 0.0, "{name}");
        let log = furuta_log::read(&log).expect("a log");
        assert_eq!(log.notice, None, "{name}");
        assert_eq!(Some(log.records.len() as u64), summary["samples"].as_u64());
    }
}

/// What was told to outlive its terminal does.
#[test]
fn nohup_is_honoured() {
    let mut run = Command::new("nohup")
        .arg(env!("CARGO_BIN_EXE_furuta"))
        .args(["emulate", "--rig", RIG, "--duration", "3"])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("nohup is there");
    let mut out = BufReader::new(run.stdout.take().expect("piped"));
    out.read_line(&mut String::new()).expect("a path");
    std::thread::sleep(Duration::from_millis(200));
    let begun = std::time::Instant::now();
    signal(&run, "-HUP");
    assert!(run.wait().expect("ends").success());
    assert!(begun.elapsed() > Duration::from_secs(2), "ended by SIGHUP");
}

#[test]
fn an_emulated_rig_is_switched_off_by_a_signal() {
    let names = ["-TERM", "-HUP"].into_iter();
    for name in names.filter(|name| *name != "-HUP" || !hangups_are_ignored()) {
        let mut rig = furuta(&["emulate", "--rig", RIG])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("runs");
        // The signals are caught once the last line is said.
        let mut said = BufReader::new(rig.stderr.take().expect("piped"));
        said.read_line(&mut String::new()).expect("a line");
        std::thread::sleep(Duration::from_millis(500));
        signal(&rig, name);
        assert_eq!(rig.wait().expect("ends").code(), Some(0), "{name}");
        let _ = said.read_to_string(&mut String::new());
    }
}

/// `ulimit -f` is a full disk: the run goes on, the log's end is told.
#[test]
fn a_file_that_may_not_grow_costs_the_log_and_not_the_run() {
    let folder = Folder::new("ends-ulimit");
    let log = folder.path("run.mcap");
    let output = Command::new("sh")
        .args([
            "-c",
            "ulimit -f 16; exec \"$@\"",
            "sh",
            env!("CARGO_BIN_EXE_furuta"),
        ])
        .args([
            "run",
            "--emulated",
            RIG,
            "--duration",
            "3",
            "--json",
            "--log",
        ])
        .arg(&log)
        .output()
        .expect("a shell");
    let line = last_line(&output);
    assert!(
        line.contains("log cannot be written further") && line.contains("too large"),
        "{line}"
    );
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(summary["end"], "finished");
    assert_eq!(summary["samples"], 1501);
    let kept = furuta_log::read(&log).expect("readable as far as it goes");
    assert!(kept.notice.is_some() && kept.records.len() < 1501);
}

#[test]
fn a_log_that_is_removed_while_it_is_written_is_told() {
    let folder = Folder::new("ends-removed");
    let log = folder.path("run.mcap");
    let run = furuta(&[
        "run",
        "--emulated",
        RIG,
        "--duration",
        "5",
        "--json",
        "--log",
    ])
    .arg(&log)
    .stdout(Stdio::piped())
    .stderr(Stdio::piped())
    .spawn()
    .expect("runs");
    under_way(&log);
    std::fs::remove_file(&log).expect("there");
    let output = run.wait_with_output().expect("ends by itself");
    let line = last_line(&output);
    assert!(
        line.contains("was removed") && line.contains("is lost"),
        "{line}"
    );
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(
        (summary["end"].as_str(), summary["logged"].as_u64()),
        (Some("finished"), Some(0))
    );
}

/// A controller that cannot hold the pendulum is refused before anything moves, or runs where that is asked for; it is
/// said to be what is wrong, and friction is not blamed for it.
#[test]
fn a_gain_that_holds_nothing_is_named() {
    let folder = Folder::new("ends-gain");
    let said = |gain: &str, any: bool, success: bool| {
        let text = format!("[controller]\nkind = \"lqr\"\ngain = {gain}\n");
        let file = folder.file("gain.toml", text);
        let output = furuta(&[
            "run",
            "--emulated",
            RIG,
            "--duration",
            "0.2",
            "--controller",
        ])
        .arg(file)
        .args(any.then_some("--any-loop"))
        .output()
        .expect("runs");
        assert_eq!(output.status.success(), success, "{output:?}");
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    for (gain, advice) in [
        ("[0.0, 0.0, 0.0, 0.0]", "correct the controller file"),
        ("[2.0, -30.0, 1.5, -3.0]", "turn its sign"),
    ] {
        for any in [false, true] {
            let said = said(gain, any, any);
            assert!(
                said.contains("does not hold")
                    && said.contains("a pole at +")
                    && said.contains(advice),
                "{said}"
            );
            assert_eq!(said.contains("nothing was moved"), !any, "{said}");
            assert!(!said.contains("friction"), "{said}");
        }
    }
    assert!(!said("[-2.0, 30.0, -1.5, 3.0]", false, true).contains("note"));
}

#[test]
fn a_file_for_a_port_is_one_line() {
    let folder = Folder::new("ends-port");
    let file = folder.file("notes.txt", "not a rig");
    let output = furuta(&["run", "--rig", RIG, "--port"])
        .arg(file)
        .output()
        .expect("runs");
    let line = common::failure(&output);
    assert!(
        line.contains("notes.txt is a file, not a serial port"),
        "{line}"
    );
}
