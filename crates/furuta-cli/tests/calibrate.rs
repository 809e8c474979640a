//! `furuta identify calibrate`, `validate` and `plan`, run as a person would.

use crate::common;

use common::{Folder, failure, furuta, rig_text};

/// Standard output of a command that succeeds.
fn printed(args: &[&str]) -> String {
    let output = furuta(args).output().expect("the binary runs");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    String::from_utf8(output.stdout).expect("text")
}

#[test]
fn a_rig_is_planned_recorded_calibrated_and_validated() {
    let folder = Folder::new("calibrate");
    let path = |name: &str| folder.path(name).display().to_string();
    // What the rig really is, and its sheet.
    let real = rig_text("qube-servo-2", "inertia = 6.18e-5", "inertia = 9.1e-5");
    let real = folder.file("real.toml", real).display().to_string();

    // The commands that a plan prints are commands that run.
    let plan = printed(&["identify", "plan", "--rig", "qube-servo-2", "--rate", "200"]);
    assert!(plan.contains("D-eff."), "{plan}");
    let commands: Vec<&str> = plan
        .lines()
        .filter_map(|l| l.trim().strip_prefix("furuta simulate --rig qube-servo-2 "))
        .collect();
    assert_eq!(commands.len(), 2, "{plan}");
    for (i, command) in commands.iter().enumerate() {
        let out = path(&format!("experiment-{}.csv", i + 1));
        let mut args = vec!["simulate", "--rig", &real];
        args.extend(command.split(' ').take_while(|w| *w != "--output"));
        args.extend(["--output", &out]);
        printed(&args);
    }

    let (first, second) = (path("experiment-1.csv"), path("experiment-2.csv"));
    let (rig, report, json) = (path("rig.toml"), path("report.html"), path("out.json"));
    let text = printed(&[
        "identify",
        "calibrate",
        &first,
        "--rig",
        "qube-servo-2",
        "--fix",
        "arm.length",
        "--profile",
        "arm.inertia",
        "--same-zero",
        "--verify",
        &second,
        "--write-rig",
        &rig,
        "--report",
        &report,
        "--json-file",
        &json,
    ]);
    assert!(
        text.starts_with("What these recordings can tell:"),
        "{text}"
    );
    assert!(
        text.contains("motor.resistance and motor.torque_constant: only their ratio shows"),
        "{text}"
    );
    assert!(
        text.contains("Unseen recordings, rig file calibrated"),
        "{text}"
    );
    assert!(
        text.contains("profile of arm.inertia: 95 % interval ["),
        "{text}"
    );
    let written = std::fs::read_to_string(&rig).expect("a rig file");
    let inertia: f64 = written
        .split("[arm]")
        .nth(1)
        .and_then(|t| {
            t.split("inertia = ")
                .nth(1)?
                .split_whitespace()
                .next()?
                .parse()
                .ok()
        })
        .expect("arm.inertia");
    assert!((inertia / 9.1e-5 - 1.0).abs() < 0.02, "{inertia}");
    let page = std::fs::read_to_string(&report).expect("a page");
    assert!(page.starts_with("<!doctype html>") && page.contains("Profile of arm.inertia"));
    let answer: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&json).expect("a file")).expect("JSON");
    assert_eq!(answer["schema"], 1);
    assert_eq!(answer["parameters"]["arm.length"]["identifiable"], false);
    let rms = |which: &str| {
        let channels = answer["verification"][which]["channels"].as_array();
        let of = |c: &serde_json::Value| c["rms"].as_f64().expect("a number");
        channels.expect("channels").iter().map(of).sum::<f64>()
    };
    assert!(rms("calibrated") < 0.2 * rms("as_given"));
    assert!(page.contains("Unseen recordings, rig file calibrated"));

    let judged = printed(&["identify", "validate", &second, "--rig", &rig, "--json"]);
    let judged: serde_json::Value = serde_json::from_str(&judged).expect("JSON");
    for channel in judged["channels"].as_array().expect("channels") {
        assert!(
            channel["fit_percent"].as_f64().expect("a number") > 90.0,
            "{channel}"
        );
    }
}

#[test]
fn what_cannot_be_done_is_said_in_a_line() {
    let folder = Folder::new("calibrate-refused");
    let mut still = String::from("t,u,theta,alpha\n");
    for k in 0..2000 {
        still += &format!("{},0,0,3.14159\n", 0.002 * f64::from(k));
    }
    let still = folder.file("still.csv", still).display().to_string();
    let output = furuta(&["identify", "calibrate", &still, "--rig", "qube-servo-2"])
        .output()
        .expect("the binary runs");
    assert!(failure(&output).contains("nothing moves"));
    let output = furuta(&[
        "identify",
        "plan",
        "--rig",
        "qube-servo-2",
        "--free",
        "arm.mass",
    ])
    .output()
    .expect("the binary runs");
    assert!(failure(&output).contains("`arm.mass` cannot be calibrated; of this rig these can:"));
}
