//! Rig files through the built binary: what is wrong gives one clear line and exit code 1; what is right gives numbers.

use crate::common;

use std::path::Path;
use std::process::Output;

use common::{Folder, furuta, json, rig_text};

fn outcome(args: &[&str]) -> Output {
    furuta(args).output().expect("the binary runs")
}

/// The one line on standard error of a command that fails as it should; nothing on standard output.
fn failure(args: &[&str]) -> String {
    let output = outcome(args);
    assert!(output.stdout.is_empty());
    common::failure(&output)
}

#[test]
fn rig_files_that_are_refused() {
    let folder = Folder::new("rigs-refused");
    let cases = [
        ("key", "mass = 0.024", "mass = 0.024\nmas = 1", "mas"),
        ("negative", "mass = 0.024", "mass = -0.024", "pendulum.mass"),
        ("missing", "mass = 0.024", "", "mass"),
        ("unit", "com = 0.0645", "com = 64.5", "pendulum.com"),
        ("kind", "com = 0.0645", "com = \"64 mm\"", "line 14"),
        ("nan", "com = 0.0645", "com = nan", "pendulum.com"),
    ];
    for (test, from, to, named) in cases {
        let path = folder.file(&format!("{test}.toml"), rig_text("qube-servo-2", from, to));
        let path = path.to_str().expect("UTF-8");
        for command in [
            &["rigs", path][..],
            &["design", "lqr", "--rig", path],
            &["simulate", "--rig", path],
        ] {
            let line = failure(command);
            assert!(line.contains(named) && line.contains(path), "{line}");
        }
    }
}

#[test]
fn a_rig_that_does_not_exist() {
    let line = failure(&["rigs", "no-such-rig"]);
    assert!(
        line.contains("no-such-rig") && line.contains("qube-servo-2"),
        "{line}"
    );
}

#[test]
fn requests_that_cannot_be_met() {
    let cases: [(&[&str], &str); 4] = [
        (
            &["simulate", "--rig", "qube-servo-2", "--rate", "2"],
            "--rate",
        ),
        (
            &[
                "simulate",
                "--rig",
                "qube-servo-2",
                "--input",
                "step",
                "--amplitude",
                "50",
            ],
            "10 V",
        ),
        (
            &["simulate", "--rig", "qube-servo-2", "--hide", "arm.sprng"],
            "arm.sprng",
        ),
        (
            &[
                "simulate",
                "--rig",
                "qube-servo-2",
                "--duration",
                "100000",
                "--rate",
                "1000",
            ],
            "--duration",
        ),
    ];
    for (command, named) in cases {
        let line = failure(command);
        assert!(line.contains(named), "{line}");
    }
    let free = failure(&[
        "design",
        "lqr",
        "--rig",
        "qube-servo-2",
        "--q",
        "0,0,0,0",
        "--r",
        "1",
    ]);
    assert!(free.contains("no stabilising solution"), "{free}");
    // A command line that is none: usage, exit code 2.
    let usage = outcome(&[
        "design",
        "lqr",
        "--rig",
        "qube-servo-2",
        "--q",
        "1,2,3",
        "--r",
        "1",
    ]);
    assert_eq!(usage.status.code(), Some(2));
}

#[test]
fn the_published_gain() {
    let k = json(&[
        "design",
        "lqr",
        "--rig",
        "shahzad2022-srv02",
        "--q",
        "1,1,1,1",
        "--r",
        "1",
        "--json",
    ]);
    let k = k["k"].as_array().expect("a row");
    // As printed, in the paper's two digits.
    for (found, printed) in k.iter().zip([-1.0, 27.68, -2.02, 3.56]) {
        let found = found.as_f64().expect("a number");
        assert!((found - printed).abs() < 0.005, "{found} {printed}");
    }
}

#[test]
fn rigs_are_listed_and_written_back() {
    let list = json(&["rigs", "--json"]);
    assert_eq!(
        list.as_array().map(Vec::len),
        Some(furuta_model::Rig::BUILTIN.len())
    );
    for name in furuta_model::Rig::BUILTIN {
        let toml = outcome(&["rigs", name, "--toml"]);
        let text = String::from_utf8(toml.stdout).expect("UTF-8");
        assert_eq!(
            furuta_model::Rig::from_toml(&text).ok(),
            furuta_model::Rig::builtin(name)
        );
        let shown = json(&["rigs", name, "--json"]);
        assert_eq!(
            shown["linearisation"]["upright"]["poles"]
                .as_array()
                .map(Vec::len),
            Some(4)
        );
    }
}

#[test]
fn a_simulation_is_a_recording() {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("simulated.csv");
    let text = path.to_str().expect("UTF-8");
    let run = outcome(&[
        "simulate",
        "--rig",
        "qube-servo-2",
        "--input",
        "chirp",
        "--hide",
        "arm.spring",
        "--force",
        "-o",
        text,
    ]);
    assert!(
        run.status.success(),
        "{}",
        String::from_utf8_lossy(&run.stderr)
    );
    let recording = furuta_ident::recording::Recording::load(&path);
    assert!(recording.is_ok(), "{:?}", recording.err());
    // Balanced by feedback: upright at the end, from a tenth of a radian.
    let balanced = json(&[
        "simulate",
        "--rig",
        "qube-servo-2",
        "--input",
        "lqr",
        "--duration",
        "5",
        "--json",
    ]);
    let alpha = balanced["columns"]["alpha"].as_array().expect("a column");
    let last = alpha
        .last()
        .and_then(serde_json::Value::as_f64)
        .expect("a number");
    assert!(last.abs() < 1e-3, "{last}");
}

#[test]
fn every_test_signal_drives_a_simulation() {
    for (input, described) in [
        ("zero", "free decay"),
        ("step", "step of 1 V"),
        ("steps", "steps of up to 1 V"),
        ("ramp", "ramp from 0 to 1 V"),
        ("chirp", "chirp of 1 V from 8 to 0 Hz"),
        ("multisine", "12 sines from 0.2 to 6 Hz, 1 V RMS"),
        ("prbs", "127 bits of 0.05 s"),
        ("noise", "noise from 0.2 to 6 Hz, 1 V RMS"),
    ] {
        let run = json(&[
            "simulate",
            "--rig",
            "qube-servo-2",
            "--input",
            input,
            "--json",
        ]);
        let said = run["input"].as_str().expect("a sentence");
        assert!(said.contains(described), "{said}");
        let u = run["columns"]["u"].as_array().expect("a column");
        let moves = u.iter().any(|u| u.as_f64() != Some(0.0));
        assert_eq!(moves, input != "zero", "{input}");
    }
    // In the unit of the rig's command.
    let run = json(&[
        "simulate",
        "--rig",
        "stepper-kit",
        "--input",
        "step",
        "--json",
    ]);
    let said = run["input"].as_str().expect("a sentence");
    assert!(said.contains("step of 15 rad/s2"), "{said}");
    assert!(said.contains("clipped at 150 rad/s2"), "{said}");
    // The same seed is the same signal; another one is not.
    let noise = |seed| {
        let args = [
            "--input",
            "noise",
            "--duration",
            "1",
            "--seed",
            seed,
            "--json",
        ];
        json(&[&["simulate", "--rig", "qube-servo-2"][..], &args].concat())
    };
    assert_eq!(noise("1"), noise("1"));
    assert_ne!(noise("1")["columns"]["u"], noise("2")["columns"]["u"]);
}

#[test]
fn test_signals_that_cannot_be() {
    let cases: [(&[&str], &str); 6] = [
        (
            &["--input", "chirp", "--band", "0,300"],
            "half the sample rate, 250 Hz",
        ),
        (&["--input", "prbs", "--order", "21"], "[2, 20]"),
        (&["--input", "prbs", "--hold", "0.001"], "sample period"),
        (
            &["--input", "noise", "--band", "0.01,8"],
            "--band low = 0.01",
        ),
        (
            &["--input", "multisine", "--band", "0.01,0.02"],
            "no multiple",
        ),
        (&["--input", "step", "--fade", "9"], "--fade = 9"),
    ];
    for (args, named) in cases {
        let line = failure(&[&["simulate", "--rig", "qube-servo-2"][..], args].concat());
        assert!(line.contains(named), "{line}");
    }
}
