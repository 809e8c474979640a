//! `furuta emulate` and `furuta run` as a user starts them: two processes and a port between them.

use crate::common;

use std::io::{BufRead, BufReader};
use std::process::{Child, Stdio};

use common::{Folder, failure, furuta, last_line};

/// A rig in its own process; killed when dropped, as a rig whose cable is pulled.
struct EmulatedProcess {
    child: Child,
    port: String,
}

impl EmulatedProcess {
    fn start(args: &[&str]) -> Self {
        let mut child = furuta(&["emulate"])
            .args(args)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("the binary runs");
        let mut port = String::new();
        let stdout = child.stdout.take().expect("piped");
        BufReader::new(stdout).read_line(&mut port).expect("a path");
        Self {
            child,
            port: port.trim().to_owned(),
        }
    }

    fn pull_the_cable(&mut self) {
        self.child.kill().expect("running");
        self.child.wait().expect("killed");
    }
}

impl Drop for EmulatedProcess {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn a_run_between_two_processes_is_logged() {
    let folder = Folder::new("ports-run");
    let log = folder.path("run.mcap");
    let rig = EmulatedProcess::start(&[
        "--rig",
        "shahzad2022-srv02",
        "--hide",
        "arm.coulomb:torque=0.01",
    ]);
    let output = furuta(&[
        "run",
        "--any-clock",
        "--port",
        &rig.port,
        "--rig",
        "shahzad2022-srv02",
        "--duration",
        "4",
        "--json",
    ])
    .arg("--log")
    .arg(&log)
    .output()
    .expect("the binary runs");
    assert!(output.status.success(), "{output:?}");
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(
        (summary["end"].as_str(), summary["error"].is_null()),
        (Some("finished"), true)
    );
    assert_eq!(summary["modes"][0]["mode"], "swing-up");
    let log = furuta_log::read(&log).expect("a log");
    assert_eq!(log.notice, None);
    assert_eq!(Some(log.records.len() as u64), summary["samples"].as_u64());
    let metadata = log.metadata.expect("metadata");
    assert_eq!(metadata.rig, "shahzad2022-srv02");
    assert!(furuta_model::Rig::from_toml(&metadata.rig_file).is_ok());
}

#[test]
fn a_cable_pulled_mid_run_is_one_line_and_the_log_is_kept() {
    let folder = Folder::new("ports-pulled");
    let log = folder.path("run.mcap");
    let mut rig = EmulatedProcess::start(&["--rig", "shahzad2022-srv02"]);
    let mut run = furuta(&[
        "run",
        "--any-clock",
        "--port",
        &rig.port,
        "--rig",
        "shahzad2022-srv02",
        "--duration",
        "600",
    ]);
    let run = run
        .arg("--log")
        .arg(&log)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("runs");
    // Once a second or so of the run has reached the disk.
    for _ in 0..600 {
        if std::fs::metadata(&log).is_ok_and(|m| m.len() > 50_000) {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
    rig.pull_the_cable();
    let line = last_line(&run.wait_with_output().expect("ends by itself"));
    assert!(
        line.contains(&rig.port) && line.contains("unplugged") && line.contains("run.mcap"),
        "{line}"
    );
    let log = furuta_log::read(&log).expect("a log");
    assert!(
        log.records.len() > 100 && log.notice.is_none(),
        "{} {:?}",
        log.records.len(),
        log.notice
    );
}

/// A rig file of another rig: nothing is commanded, unless the user knows better.
#[test]
fn a_wrong_rig_on_the_port_is_refused_unless_told_otherwise() {
    let folder = Folder::new("ports-wrong");
    let log = folder.path("run.mcap");
    let rig = EmulatedProcess::start(&["--rig", "shahzad2022-srv02"]);
    let run = |more: &[&str]| {
        let args = [
            "run",
            "--any-clock",
            "--port",
            &rig.port,
            "--rig",
            "fong2014-emecs",
        ];
        furuta(&args)
            .args(["--task", "zero", "--duration", "0.2"])
            .args(more)
            .arg("--log")
            .arg(&log)
            .output()
            .expect("runs")
    };
    let line = failure(&run(&[]));
    for part in [
        "not the one of the rig file",
        "name = shahzad2022-srv02, its rig file fong2014-emecs",
        "--any-rig",
    ] {
        assert!(line.contains(part), "{line}");
    }
    assert!(!log.exists());
    let output = run(&["--any-rig"]);
    assert!(output.status.success(), "{output:?}");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("warning: the rig says name"), "{said}");
}

/// A swing-up that the model says cannot be is tried, and the user told before and after.
#[test]
fn a_swing_up_that_cannot_succeed_is_explained() {
    let run = |rig: &str, duration: &str| {
        let output = furuta(&["run", "--emulated", rig, "--duration", duration, "--json"])
            .output()
            .expect("runs");
        assert!(output.status.success(), "{output:?}");
        let summary: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let said = summary["explanation"].as_str().map(str::to_owned);
        (String::from_utf8_lossy(&output.stderr).into_owned(), said)
    };
    let (before, after) = run("qube-servo-2", "0.5");
    assert!(
        before.contains("does not swing up") && before.contains("arm.viscous"),
        "{before}"
    );
    assert!(after.is_some_and(|text| text.contains("not caught")));
    let (before, after) = run("ramos-velasco", "0.5");
    assert_eq!(before, "");
    assert!(after.is_some_and(|text| text.contains("--duration")));
    let (before, after) = run("shahzad2022-srv02", "3");
    assert_eq!((before.as_str(), after), ("", None));
}

#[test]
fn what_cannot_be_is_one_line() {
    let rig = ["--rig", "qube-servo-2"];
    let fails = |args: &[&str], what: &[&str]| {
        let line = last_line(&furuta(args).args(rig).output().expect("runs"));
        assert!(what.iter().all(|w| line.contains(w)), "{line}");
    };
    fails(
        &["run", "--port", "/dev/no-such-port"],
        &["/dev/no-such-port", "does not exist", "plug the rig in"],
    );
    fails(
        &["run", "--port", "/dev/null"],
        &["/dev/null", "cannot be opened"],
    );
    fails(
        &["emulate", "--hide", "arm.sprong"],
        &["arm.sprong", "arm.spring"],
    );
    fails(
        &["emulate", "--hide", "arm.spring:stiffness=-1,rest=0"],
        &["stiffness", "-1"],
    );
    fails(&["emulate", "--rate", "1"], &["1000000 us", "100000"]);
    let unwritable = [
        "run",
        "--emulated",
        "qube-servo-2",
        "--log",
        "/no/such/folder/run.mcap",
    ];
    fails(
        &unwritable,
        &["/no/such/folder/run.mcap", "cannot be created"],
    );
    // A port that does not exist is all there is to say.
    let output = furuta(&[
        "run",
        "--port",
        "/dev/does-not-exist",
        "--rig",
        "qube-servo-2",
    ])
    .output()
    .expect("runs");
    assert!(failure(&output).contains("/dev/does-not-exist"));
    let output = furuta(&["run", "--emulated", "no-such-rig"])
        .output()
        .expect("runs");
    assert!(failure(&output).contains("no-such-rig"));
    // Not a valid command line: exit code 2.
    let output = furuta(&["run"]).output().expect("runs");
    assert_eq!(output.status.code(), Some(2));
}

/// A host that is killed says no goodbye: the rig's watchdog stops the motor, and what was logged up to the last 100 ms
/// is there.
#[cfg(unix)]
#[test]
fn a_killed_host_leaves_the_motor_off_and_a_log() {
    let folder = Folder::new("ports-killed");
    let log = folder.path("run.mcap");
    let rig = furuta_model::Rig::builtin("shahzad2022-srv02").expect("built in");
    let emulation = furuta_hw::Emulation::default();
    let deadline = u32::from(emulation.watchdog_periods);
    let emulated = furuta_hw::EmulatedRig::new(&rig, &emulation).expect("valid");
    let rig = furuta_hw::PtyRig::start(emulated, furuta_hw::Pace::Patient).expect("a port");
    let mut host = furuta(&[
        "run",
        "--any-clock",
        "--port",
        rig.path(),
        "--rig",
        "shahzad2022-srv02",
    ])
    .args(["--duration", "600", "--log"])
    .arg(&log)
    .stdout(Stdio::null())
    .stderr(Stdio::null())
    .spawn()
    .expect("runs");
    for _ in 0..600 {
        if std::fs::metadata(&log).is_ok_and(|m| m.len() > 50_000) {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
    host.kill().expect("running"); // SIGKILL
    host.wait().expect("killed");
    // The rig waits for its host before the first tick without an answer: time has nearly stood still since the kill.
    let mut rig = rig.unplug().expect("alive");
    let ticks: Vec<_> = (0..deadline + 5).map(|_| rig.tick()).collect();
    let off = ticks
        .iter()
        .position(|s| s.volts == 0.0 && s.status.contains(furuta_wire::Status::WATCHDOG));
    assert!(
        off.is_some_and(|ticks| ticks <= deadline as usize),
        "{off:?}"
    );
    let log = furuta_log::read(&log).expect("a log");
    assert!(
        matches!(log.notice, Some(furuta_log::Notice::Truncated { .. })),
        "{:?}",
        log.notice
    );
    let last = log.records.last().expect("records").seq;
    let missing = f64::from(ticks[0].seq - last) * 0.002;
    println!("the log ends {missing:.3} s before the kill");
    // 100 ms, and what the writer's thread waits for a processor on a busy machine.
    assert!(missing < 0.5, "{missing}");
}
