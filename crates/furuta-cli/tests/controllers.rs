//! Controller files through the built program: designed, checked, simulated with, run with.

use crate::common;

use common::{Folder, failure, furuta, json, last_line};
use serde_json::Value;

/// A column of `furuta simulate --json`.
fn column(v: &Value, name: &str) -> Vec<f64> {
    let column = v["columns"][name].as_array().expect("a column");
    column.iter().filter_map(Value::as_f64).collect()
}

#[test]
fn a_designed_controller_is_written_checked_and_simulated() {
    let folder = Folder::new("designed-controller");
    let path = folder.path("lqr.toml");
    let path = path.to_str().expect("a path");
    let rig = ["--rig", "shahzad2022-srv02"];
    let design = ["design", "lqr", rig[0], rig[1], "--rate", "500", "--json"];
    let designed = json(&[&design[..], &["--write-controller", path]].concat());
    let checked = json(&["controllers", "--check", path, "--json"]);
    assert_eq!(checked["made_for"]["rate"], 500.0);
    assert_eq!(
        checked["sections"]["controller"]["given"]["gain"],
        designed["k"]
    );
    let run = json(&[
        "simulate",
        rig[0],
        rig[1],
        "--controller",
        path,
        "--duration",
        "5",
        "--json",
    ]);
    let modes = run["columns"]["mode"].as_array().expect("modes");
    assert_eq!(modes[0], "swing-up");
    assert_eq!(modes[modes.len() - 1], "balance");
    let (alpha, u) = (column(&run, "alpha"), column(&run, "u"));
    let end = alpha[alpha.len() - 1];
    assert!((end - std::f64::consts::TAU * (end / std::f64::consts::TAU).round()).abs() < 0.02);
    assert!(u.iter().all(|u| u.abs() <= 10.0));
    // Nothing acts before the second sample, by when the first has been answered.
    assert!(u[0] == 0.0 && u[1] != 0.0);
}

#[test]
fn other_designs_are_written_too() {
    let folder = Folder::new("other-designs");
    let path = folder.path("k.toml");
    let path = path.to_str().expect("a path");
    let on = ["--rig", "qube-servo-2", "--rate", "500", "--json"];
    let write = ["--write-controller", path, "--force"];
    let given =
        || json(&["controllers", "--check", path, "--json"])["sections"]["controller"].clone();
    let lqi = json(&[&["design", "lqi"], &on[..], &write].concat());
    let controller = given();
    assert_eq!(controller["kind"], "lqi");
    let k = lqi["k"].as_array().expect("five gains");
    assert_eq!(
        controller["given"]["gain"].as_array().map(Vec::as_slice),
        Some(&k[..4])
    );
    // Sampled and held, the poles asked for are the poles found.
    let poles = ["--poles", "-3,-20,-6+2i,-6-2i"];
    let placed = json(&[&["design", "place"], &poles[..], &on, &write].concat());
    assert_eq!(given()["given"]["gain"], placed["k"]);
    for wanted in placed["wanted"].as_array().expect("four") {
        let at = |p: &Value, i: usize| p[i].as_f64().expect("a number");
        let found = placed["poles"].as_array().expect("four");
        assert!(
            found
                .iter()
                .any(|p| { (at(p, 0) - at(wanted, 0)).hypot(at(p, 1) - at(wanted, 1)) < 1e-9 })
        );
    }
    // The LQR of this rig lets one within the range fall.
    let robust = json(
        &[
            &["design", "robust", "--rig", "ramos-velasco", "--json"],
            &write[..],
        ]
        .concat(),
    );
    assert_eq!(given()["given"]["gain"], robust["k"]);
    let slowest = |k: &str| robust["slowest_pole"][k].as_f64().expect("a number");
    assert!(slowest("nominal") > 0.0 && slowest("robust") < 0.0);
    for (poles, problem) in [
        ("-1,-2,-3", "four poles"),
        ("-1,-2,-3,x", "no pole"),
        ("-1,-2,-3+i,-3", "conjugate"),
    ] {
        let output = furuta(&["design", "place", "--rig", "qube-servo-2", "--poles", poles])
            .output()
            .expect("runs");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success() && said.contains(problem), "{said}");
    }
}

/// The controller alone on true states is u = -K x at every sample.
#[test]
fn an_ideal_run_is_the_controller_itself() {
    let folder = Folder::new("ideal-controller");
    let gain = [-2.4, 32.6, -2.2, 3.2];
    let path = folder.file("k.toml", format!("[controller]\ngain = {gain:?}\n"));
    let path = path.to_str().expect("a path");
    let rig = ["--rig", "shahzad2022-srv02", "--start", "0.1,0.05,0,0"];
    let base = ["simulate", "--controller", path, "--ideal", "--json"];
    let run = json(&[&base[..], &rig[..]].concat());
    let names = ["theta", "alpha", "theta_dot", "alpha_dot"];
    let x = names.map(|name| column(&run, name));
    for (k, u) in column(&run, "u").into_iter().enumerate() {
        let expected: f64 = -(0..4).map(|i| gain[i] * x[i][k]).sum::<f64>();
        assert!((u - expected).abs() < 1e-12, "sample {k}: {u}, {expected}");
    }
}

#[test]
fn mistakes_are_named_before_anything_moves() {
    let folder = Folder::new("controller-mistakes");
    for (name, text, expected) in [
        ("kind", "[controller]\nkind = \"lqq\"\n", "it has lqr"),
        ("range", "[limits]\ncommand = 1e9\n", "command = 1e9"),
        (
            "pair",
            "[controller]\nq = [1, 1, 1, 1]\n",
            "give both q and r",
        ),
    ] {
        let path = folder.file(name, text);
        let path = path.to_str().expect("a path");
        let simulate = ["simulate", "--rig", "qube-servo-2", "--controller", path];
        let line = failure(&furuta(&simulate).output().expect("runs"));
        assert!(line.contains(expected) && line.contains(path), "{line}");
        let run = ["run", "--emulated", "qube-servo-2", "--controller", path];
        let line = last_line(&furuta(&run).output().expect("runs"));
        assert!(line.contains(expected) && line.contains(path), "{line}");
    }
    let pair = folder.path("pair");
    let pair = pair.to_str().expect("a path");
    for command in [
        &["export", "c"][..],
        &["study", "region", "--points", "3"],
        &["study", "swing-up", "--draws", "1"],
    ] {
        let args = [command, &["--rig", "qube-servo-2", "--controller", pair]].concat();
        let line = failure(&furuta(&args).output().expect("runs"));
        assert!(
            line.contains(pair) && line.contains("give both q and r"),
            "{line}"
        );
    }
    let absent = folder.path("absent.toml");
    let line = failure(
        &furuta(&["controllers", "--check", absent.to_str().expect("a path")])
            .output()
            .expect("runs"),
    );
    assert!(line.contains("absent.toml"), "{line}");
}

#[test]
fn a_run_obeys_the_files_limits_and_logs_the_file() {
    let folder = Folder::new("run-controller");
    let path = folder.file(
        "tame.toml",
        "[made_for]\nrig = \"another\"\nrate = 100\n[limits]\ncommand = 2.5\narm_angle = 1.5\n",
    );
    let log = folder.path("run.mcap");
    let text = |p: &std::path::Path| p.to_str().expect("a path").to_owned();
    let (path, log) = (text(&path), text(&log));
    let output = furuta(&[
        "run",
        "--emulated",
        "shahzad2022-srv02",
        "--controller",
        &path,
        "--duration",
        "1",
        "--log",
        &log,
    ])
    .output()
    .expect("runs");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(stderr.contains("made for the rig another"), "{stderr}");
    assert!(
        stderr.contains("made for 100 Hz, not for 500 Hz"),
        "{stderr}"
    );
    let log = furuta_log::read(std::path::Path::new(&log)).expect("a log");
    assert!(log.records.iter().all(|r| r.command.abs() <= 2.5));
    let metadata = log.metadata.expect("metadata");
    let file = furuta_ctrl::ControllerFile::from_toml(&metadata.extra["controller_file"]);
    let limits = file.expect("readable").config.limits;
    assert_eq!(limits.numbers("command"), Some(&[2.5][..]));
}

#[test]
fn everything_a_file_may_say_is_listed_and_explained() {
    let all = json(&["controllers", "--json"]);
    for spec in furuta_ctrl::config::specs() {
        let output = furuta(&["controllers", spec.id]).output().expect("runs");
        let text = String::from_utf8_lossy(&output.stdout);
        for p in spec.parameters {
            assert!(text.contains(p.name) && text.contains(p.sentence), "{text}");
        }
        assert!(all.to_string().contains(spec.sentence));
    }
    let output = furuta(&["controllers", "bang_bang"])
        .output()
        .expect("runs");
    assert!(failure(&output).contains("give one of lqr"));
}
