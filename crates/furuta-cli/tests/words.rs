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
        &["--input", "lqr", "--centre", "2"],
        &["--input", "zero", "--fade", "0.01"],
        &["--seed", "1"],
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
        ("step", "--seed", "4"),
        ("chirp", "--seed", "4"),
    ] {
        let args = [&simulate[..], &["--input", kind, option, value]].concat();
        let line = failure(&furuta(&args).output().expect("runs"));
        let wanted = format!("a {kind} as asked for has no {option}: leave it out");
        assert!(line.contains(&wanted), "{line}");
    }
    let done = furuta(&[&simulate[..], &["--input", "step", "--amplitude", "2"]].concat());
    assert!({ done }.output().expect("runs").status.success());
}

/// What shapes a test signal has no use under a controller, and the other way round: in both commands, before anything
/// runs.
#[test]
fn signals_and_controllers_have_options_of_their_own() {
    let folder = Folder::new("options-of-their-own");
    let standard = folder.file("standard.toml", "");
    let standard = standard.to_str().expect("UTF-8");
    let simulate = [
        "simulate",
        "--rig",
        "shahzad2022-srv02",
        "--duration",
        "0.1",
    ];
    let run = [
        "run",
        "--emulated",
        "shahzad2022-srv02",
        "--duration",
        "0.1",
    ];
    let refused = |command: &[&str], more: &[&str], name: &str, why: &str| {
        let line = failure(&furuta(&[command, more].concat()).output().expect("runs"));
        let wanted = format!("{name} {why}, and none is asked for: give one (");
        assert!(line.contains(&wanted), "{line}");
        assert!(line.contains(&format!("or leave {name} out")), "{line}");
    };
    let controlled = [&simulate[..], &["--controller", standard]].concat();
    for (name, value) in [
        ("--amplitude", "2"),
        ("--band", "1,2"),
        ("--hold", "3"),
        ("--order", "5"),
        ("--seed", "4"),
        ("--fade", "1"),
        ("--centre", "2"),
    ] {
        refused(&run, &[name, value], name, "shapes a test signal");
        refused(&controlled, &[name, value], name, "shapes a test signal");
    }
    let controllers = "belongs to a run under a controller";
    for more in [
        &["--arm-steps", "0.1"][..],
        &["--arm-steps", "0"],
        &["--arm-noise", "0.1"],
    ] {
        refused(
            &run,
            &[&["--task", "chirp"], more].concat(),
            more[0],
            controllers,
        );
        refused(
            &simulate,
            &[&["--input", "step"], more].concat(),
            more[0],
            controllers,
        );
        refused(&simulate, more, more[0], controllers);
    }
    for more in [&["--controller", standard][..], &["--any-loop"]] {
        refused(
            &run,
            &[&["--task", "chirp"], more].concat(),
            more[0],
            controllers,
        );
    }
    refused(
        &simulate,
        &["--input", "step", "--ideal"],
        "--ideal",
        controllers,
    );
    for command in [&run[..], &controlled] {
        let both = [command, &["--arm-noise", "0.1", "--arm-steps", "0.5"]].concat();
        assert!(invalid(&both).contains("cannot be used with"));
    }
    for more in [
        &[][..],
        &["--arm-steps", "0.1", "--ideal"],
        &["--arm-noise", "0.1", "--band", "1,2", "--seed", "3"],
    ] {
        let done = furuta(&[&controlled, more].concat())
            .output()
            .expect("runs");
        assert!(done.status.success(), "{done:?}");
    }
    let pulled = [&simulate[..], &["--centre", "2"]].concat();
    assert!(furuta(&pulled).output().expect("runs").status.success());
}

/// A port that is not there is what comes next.
#[test]
fn what_is_emulated_is_not_asked_of_a_port() {
    let on_port = ["run", "--port", "/no/such/port", "--rig", "qube-servo-2"];
    for (more, wanted) in [
        (
            &["--hide", "arm.coulomb"][..],
            "--hide belongs to --emulated: a rig on a port has its own effects",
        ),
        (
            &["--rate", "250"],
            "--rate belongs to --emulated: a rig on a port has its own rate",
        ),
        (&[], "/no/such/port"),
    ] {
        let line = failure(&furuta(&[&on_port, more].concat()).output().expect("runs"));
        assert!(line.contains(wanted), "{line}");
    }
}

#[test]
fn what_a_port_has_is_not_asked_of_an_emulated_rig() {
    for command in ["run", "latency"] {
        let args = [command, "--emulated", "qube-servo-2", "--baud", "9600"];
        assert!(invalid(&args).contains("--baud"));
    }
    assert!(invalid(&["latency", "--baud", "9600"]).contains("--port"));
    assert!(invalid(&["run", "--emulated", "qube-servo-2", "--any-clock"]).contains("--any-clock"));
}

#[test]
fn an_effect_to_hide_says_each_thing_once() {
    for (hidden, wanted) in [
        (
            "arm.coulomb:torque=1, torque = 0",
            "arm.coulomb: torque is given twice, as 1 and as 0: leave one out",
        ),
        (
            "arm.coulomb:",
            "nothing stands behind the colon: give arm.coulomb:NAME=VALUE, or arm.coulomb alone",
        ),
        ("arm.coulomb: ", "nothing stands behind the colon"),
    ] {
        for command in [
            &["simulate", "--rig"][..],
            &["emulate", "--rig"],
            &["run", "--emulated"],
        ] {
            let args = [
                command,
                &["qube-servo-2", "--duration", "0.1", "--hide", hidden],
            ]
            .concat();
            let line = failure(&furuta(&args).output().expect("runs"));
            assert!(line.contains(wanted), "{line}");
        }
    }
}

/// A value outside its range is named by its option.
#[test]
fn signals_are_refused_by_their_options() {
    for (kind, option, value, wanted) in [
        (
            "multisine",
            "--lines",
            "0",
            "multisine: --lines = 0 is outside the allowed range [1, 128]",
        ),
        (
            "prbs",
            "--hold",
            "0",
            "prbs: --hold = 0 is outside the allowed range [0.000001, 1000000] s",
        ),
        (
            "steps",
            "--hold",
            "0",
            "steps: --hold = 0 is outside the allowed range [0.000001, 1000000] s",
        ),
        (
            "prbs",
            "--order",
            "1",
            "prbs: --order = 1 is outside the allowed range [2, 20]",
        ),
        (
            "chirp",
            "--band",
            "0,1e6",
            "chirp: --band high = 1000000 is outside the allowed range [0, 100000] Hz",
        ),
        (
            "noise",
            "--amplitude",
            "-1",
            "noise: --amplitude = -1 is outside the allowed range [0, 1000] V",
        ),
    ] {
        let simulate = [
            "simulate",
            "--rig",
            "qube-servo-2",
            "--input",
            kind,
            option,
            value,
        ];
        let line = failure(&furuta(&simulate).output().expect("runs"));
        assert!(line.contains(wanted), "{line}");
    }
}

#[test]
fn a_recording_is_not_written_under_another_kinds_name() {
    let folder = Folder::new("another-kind");
    for name in ["x.csv", "x.SVG", "x.toml"] {
        let path = folder.path(name);
        let log = path.to_str().expect("UTF-8");
        let args = [
            "run",
            "--emulated",
            "qube-servo-2",
            "--duration",
            "0.1",
            "--log",
            log,
        ];
        let line = failure(&furuta(&args).output().expect("runs"));
        assert!(
            line.contains(&format!("{log}: a log is written as MCAP: name it .mcap")),
            "{line}"
        );
        assert!(!path.exists());
    }
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
