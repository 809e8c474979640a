//! Recordings that are longer than they need to be: a word beforehand, and a part of them.

use crate::common;

use std::fmt::Write as _;
use std::io::{BufRead, BufReader};
use std::process::Stdio;

use common::{Folder, furuta};

/// A recording of a hanging pendulum, as the rig simulates it.
fn simulated(folder: &Folder) -> String {
    let path = folder.path("run.csv").display().to_string();
    let output = furuta(&["simulate", "--rig", "qube-servo-2", "--input", "chirp"])
        .args(["--duration", "4", "--rate", "500", "--output", &path])
        .output()
        .expect("the binary runs");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    path
}

#[test]
fn what_takes_minutes_is_said_beforehand() {
    let folder = Folder::new("long");
    let mut text = "t,u,theta,alpha\n".to_owned();
    for k in 0..300_000 {
        let t = 0.002 * f64::from(k);
        let (u, theta) = ((5.0 * t).sin(), 0.1 * (5.0 * t).cos());
        let alpha = 3.1 + 0.1 * (7.0 * t).cos();
        let _ = writeln!(text, "{t},{u},{theta},{alpha}");
    }
    let path = folder.file("long.csv", text);
    let mut child = furuta(&["diagnose", "--accept-suspicious", "--rig", "qube-servo-2"])
        .args(["--time-limit", "1000"])
        .arg(&path)
        .stderr(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .expect("the binary runs");
    let stderr = BufReader::new(child.stderr.take().expect("piped"));
    let line = stderr.lines().next().expect("a line").expect("text");
    child.kill().expect("ours");
    child.wait().expect("ended");
    assert!(
        line.starts_with("300000 samples: this takes some "),
        "{line}"
    );
    assert!(
        line.contains("--every N") && line.contains("--span A..B"),
        "{line}"
    );
}

#[test]
fn a_part_of_a_recording_is_used() {
    let folder = Folder::new("part");
    let path = simulated(&folder);
    let validate = |more: &[&str]| {
        let output = furuta(&["identify", "validate", &path, "--rig", "qube-servo-2"])
            .args(more)
            .output()
            .expect("the binary runs");
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.code(), stderr)
    };
    assert_eq!(validate(&["--every", "2", "--span", "0.5..3.5"]).0, Some(0));
    let (code, line) = validate(&["--span", "50..60"]);
    assert!(
        code == Some(1) && line.contains("between 50 and 60 s; the recording lasts 3.998 s"),
        "{line}"
    );
    let (code, line) = validate(&["--every", "500"]);
    assert!(
        code == Some(1) && line.contains("every 500th sample leaves no 20"),
        "{line}"
    );
    for wrong in [["--span", "3..1"], ["--span", "abc"], ["--every", "0"]] {
        assert_eq!(validate(&wrong).0, Some(2), "{wrong:?}");
    }
}
