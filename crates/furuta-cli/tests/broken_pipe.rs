//! A reader that leaves early: no command fails of it, and what it does beside its text it does all the same.
#![cfg(unix)]

use crate::common;

use std::io::{BufRead, BufReader, PipeWriter};
use std::process::Stdio;

use common::{Folder, failure, furuta, swing};

/// The writing end of a pipe that has no reader.
fn unread() -> PipeWriter {
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    writer
}

/// As `| head -1` leaves: after the first line, the pipe full and the rest still to come.
#[test]
fn simulate_to_head_ends_quietly() {
    let mut child = furuta(&["simulate", "--rig", "qube-servo-2", "--duration", "60"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary runs");
    let mut line = String::new();
    let mut reader = BufReader::new(child.stdout.take().expect("piped"));
    reader.read_line(&mut line).expect("text");
    assert!(line.starts_with("# simulated: qube-servo-2"), "{line}");
    drop(reader);
    let output = child.wait_with_output().expect("ends");
    assert!(output.status.success(), "{output:?}");
    assert!(output.stderr.is_empty(), "{output:?}");
}

/// No reader from the first byte on.
#[test]
fn no_command_fails_for_want_of_a_reader() {
    let folder = Folder::new("broken-pipe");
    let csv = folder.file("run.csv", swing());
    let (csv, mcap) = (csv.to_str().expect("UTF-8"), folder.path("run.mcap"));
    let mcap = mcap.to_str().expect("UTF-8");
    let rig = ["--rig", "shahzad2022-srv02"];
    let commands: [&[&str]; 19] = [
        &["--help"],
        &["rigs"],
        &["rigs", "qube-servo-2"],
        &["rigs", "qube-servo-2", "--toml"],
        &["effects"],
        &["effects", "arm.coulomb", "--json"],
        &["controllers"],
        &["controllers", "mpc"],
        &["simulate", rig[0], rig[1], "--json"],
        &["design", "lqr", rig[0], rig[1]],
        &["design", "lqi", rig[0], rig[1]],
        &[
            "design",
            "place",
            rig[0],
            rig[1],
            "--poles",
            "-3,-4,-20,-30",
        ],
        &["design", "steady-motion", rig[0], rig[1]],
        &["convert", csv, mcap],
        &["identify", "frf", csv, "--estimator", "h1"],
        &["study", "shahzad2022"],
        &["emulate", rig[0], rig[1], "--duration", "0.1"],
        &["latency", "--seconds", "0.1"],
        &["run", "--emulated", rig[1], "--duration", "0.2"],
    ];
    for args in commands {
        let output = furuta(args)
            .stdout(unread())
            .output()
            .expect("the binary runs");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{args:?}: {said}");
        assert!(
            !said.contains("panicked") && !said.contains("pipe"),
            "{args:?}: {said}"
        );
    }
}

/// Neither text is read: the run goes to its end, and its log is whole.
#[test]
fn a_run_without_a_reader_is_logged() {
    let folder = Folder::new("broken-pipe-run");
    let log = folder.path("run.mcap");
    let status = furuta(&["run", "--emulated", "shahzad2022-srv02"])
        .args(["--duration", "1", "--log"])
        .arg(&log)
        .stdout(unread())
        .stderr(unread())
        .status()
        .expect("the binary runs");
    assert!(status.success(), "{status:?}");
    let log = furuta_log::read(&log).expect("a log");
    assert_eq!((log.records.len(), log.notice), (501, None));
}

/// Where the text cannot be written for another reason, that is said.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_a_failure() {
    let full = std::fs::File::options()
        .write(true)
        .open("/dev/full")
        .expect("Linux");
    let output = furuta(&["rigs"])
        .stdout(full)
        .output()
        .expect("the binary runs");
    let line = failure(&output);
    let said = line.matches("standard output: No space left").count();
    assert_eq!(said, 1, "{line}");
}
