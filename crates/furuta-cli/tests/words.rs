//! What options say: negative numbers reach the range checks, one flag has one meaning, and a wish that cannot be meant
//! is refused.

use crate::common;

use common::{Folder, failure, furuta, last_line};

/// Standard error of a command that is no valid command line.
fn invalid(args: &[&str]) -> String {
    let output = furuta(args).output().expect("the binary runs");
    assert_eq!(output.status.code(), Some(2), "{args:?}");
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn negative_numbers_reach_the_range_checks() {
    for args in [
        &["simulate", "--rig", "qube-servo-2", "--duration", "-1"][..],
        &["simulate", "--rig", "qube-servo-2", "--rate", "-5.5"],
        &["study", "fong2014", "--duration", "-1"],
        &["simulate", "--rig", "qube-servo-2", "--band", "-1,5"],
        &[
            "design",
            "lqr",
            "--rig",
            "qube-servo-2",
            "--q",
            "-1,1,1,1",
            "--r",
            "1",
        ],
        &[
            "diagnose",
            "x.csv",
            "--rig",
            "qube-servo-2",
            "--span",
            "-1..2",
        ],
    ] {
        let stderr = invalid(args);
        assert!(!stderr.contains("unexpected argument"), "{stderr}");
        assert!(stderr.contains("invalid value '-"), "{stderr}");
    }
    let output = furuta(&[
        "design",
        "lqr",
        "--rig",
        "qube-servo-2",
        "--q",
        "1,1,1,1",
        "--r",
        "-1",
    ])
    .output()
    .expect("the binary runs");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(!stderr.contains("unexpected argument"), "{stderr}");
    assert!(!output.status.success() && stderr.contains('R'), "{stderr}");
}

#[test]
fn what_shapes_a_signal_needs_one() {
    let simulate = ["simulate", "--rig", "qube-servo-2", "--duration", "0.1"];
    for more in [
        &["--amplitude", "2"][..],
        &["--hold", "0.1"],
        &["--input", "zero", "--amplitude", "2"],
        &["--input", "lqr", "--amplitude", "2"],
    ] {
        let line = failure(&furuta(&[&simulate, more].concat()).output().expect("runs"));
        assert!(
            line.contains("shapes a test signal, and none is asked for"),
            "{line}"
        );
    }
    for (kind, option, value) in [
        ("chirp", "--hold", "0.1"),
        ("chirp", "--harmonics", "detecting"),
        ("step", "--band", "1,2"),
        ("steps", "--lines", "3"),
        ("noise", "--order", "5"),
        ("prbs", "--sweep", "linear"),
    ] {
        let args = [&simulate[..], &["--input", kind, option, value]].concat();
        let line = failure(&furuta(&args).output().expect("runs"));
        let wanted = format!("a {kind} as asked for has no {option}: leave it out");
        assert!(line.contains(&wanted), "{line}");
    }
    let done = furuta(&[&simulate[..], &["--input", "step", "--amplitude", "2"]].concat());
    assert!({ done }.output().expect("runs").status.success());
}

#[test]
fn a_recording_is_not_written_under_another_kinds_name() {
    let folder = Folder::new("another-kind");
    for name in ["x.svg", "x.JSON", "x.mcap"] {
        let path = folder.path(name);
        let out = path.to_str().expect("UTF-8");
        let args = ["simulate", "--rig", "qube-servo-2", "-o", out];
        let line = failure(&furuta(&args).output().expect("runs"));
        assert!(line.contains("a recording is written as CSV"), "{line}");
        assert!(!path.exists());
    }
}

#[test]
fn a_fall_is_a_failure_and_its_recording_is_written() {
    let folder = Folder::new("fall");
    let controller = folder.file("standard.toml", "");
    let out = folder.path("fall.csv");
    let args = |start: &'static str| {
        let mut command = furuta(&["simulate", "--rig", "qube-servo-2", "--ideal", "--force"]);
        command.args(["--start", start, "--duration", "2", "--controller"]);
        command.arg(&controller).arg("--output").arg(&out);
        command.output().expect("the binary runs")
    };
    let line = last_line(&args("0,1.5,0,0"));
    assert!(line.contains("the pendulum fell 0."), "{line}");
    let rows = std::fs::read_to_string(&out)
        .expect("written")
        .lines()
        .count();
    assert!(rows > 10 && rows < 1002, "{rows}");
    assert!(args("0,0.05,0,0").status.success());
}

#[test]
fn one_flag_has_one_meaning() {
    let help = |args: &[&str]| {
        let output = furuta(args).output().expect("the binary runs");
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    for args in [
        &["identify", "calibrate", "--help"][..],
        &["identify", "plan", "--help"],
    ] {
        let text = help(args);
        assert!(
            text.contains("--fix <KEY,KEY,...>") && !text.contains("--hold"),
            "{text}"
        );
    }
    for args in [
        &["identify", "frf", "--help"][..],
        &["identify", "tf", "--help"],
    ] {
        let text = help(args);
        assert!(
            text.contains("--column <COLUMN>") && !text.contains("--output"),
            "{text}"
        );
    }
    for args in [&["simulate", "--help"][..], &["run", "--help"]] {
        assert!(help(args).contains("--hold <SECONDS>"));
    }
}
