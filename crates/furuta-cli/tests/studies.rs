//! The papers' experiments, steady motions and pictures from the command line.

use crate::common;

use common::{Folder, furuta, json};

/// The one line that a command which fails says.
fn failure(args: &[&str]) -> String {
    common::failure(&furuta(args).output().expect("the binary runs"))
}

#[test]
fn arm_steps_are_measured_and_drawn() {
    let folder = Folder::new("study-shahzad");
    let picture = folder.path("step.svg");
    let picture = picture.to_str().expect("UTF-8");
    let study = json(&[
        "study",
        "shahzad2022",
        "--task",
        "step",
        "--plot",
        picture,
        "--json",
    ]);
    let runs = study["runs"].as_array().expect("a list");
    assert_eq!(runs.len(), 3);
    assert!((runs[0]["settle"].as_f64().expect("settles") - 4.802).abs() < 2e-3);
    let svg = std::fs::read_to_string(picture).expect("drawn");
    assert!(svg.starts_with("<svg") && svg.contains("Fig. 3"));
    assert_eq!(
        json(&["study", "shahzad2022", "--json"])["runs"]
            .as_array()
            .map(Vec::len),
        Some(8)
    );
}

#[test]
fn a_sine_is_followed_on_wrong_parameters() {
    let folder = Folder::new("study-ramos");
    let picture = folder.path("planar.svg");
    let picture = picture.to_str().expect("UTF-8");
    let study = json(&[
        "study",
        "ramos-velasco",
        "--draws",
        "4",
        "--plot",
        picture,
        "--json",
    ]);
    let controllers = study["controllers"].as_array().expect("a list");
    assert_eq!(controllers.len(), 5);
    for c in controllers {
        assert_eq!(c["draws"]["up"], 1.0, "{c}");
        let bound = |run: &str| c[run]["bound"].as_f64().expect("stays up");
        assert!(bound("nominal") < bound("above"), "{c}");
    }
    assert!(
        std::fs::read_to_string(picture)
            .expect("drawn")
            .contains("4 draws")
    );
    // Beyond the largest sine everyone falls: JSON has null for a bound that is none.
    let fallen = json(&[
        "study",
        "ramos-velasco",
        "--on",
        "full",
        "--amplitude",
        "0.1",
        "--draws",
        "0",
        "--json",
    ]);
    assert!(
        fallen["largest_amplitude"]
            .as_f64()
            .is_some_and(|a| a < 0.08)
    );
    for c in fallen["controllers"].as_array().expect("a list") {
        assert!(
            c["nominal"]["up"] == false && c["nominal"]["bound"].is_null(),
            "{c}"
        );
    }
    // The printed gain is for the paper's rig alone: others have one controller less.
    let qube = json(&[
        "study",
        "ramos-velasco",
        "--rig",
        "qube-servo-2",
        "--on",
        "full",
        "--lambda",
        "4",
        "--amplitude",
        "0.01",
        "--start",
        "0.02",
        "--draws",
        "0",
        "--json",
    ]);
    assert_eq!(qube["controllers"].as_array().map(Vec::len), Some(4));
}

#[test]
fn the_steady_motion_is_the_papers() {
    let steady = json(&[
        "design",
        "steady-motion",
        "--rig",
        "ramos-velasco",
        "--planar",
        "--order",
        "3",
        "--json",
    ]);
    let theta = steady["theta"].as_array().expect("a list");
    assert_eq!(theta.len(), 3);
    assert!((theta[0][2].as_f64().expect("a number") - 81.230_77).abs() < 1e-5);
    assert!(steady["largest_amplitude"].is_null());
}

#[test]
fn a_simulation_is_drawn() {
    let folder = Folder::new("simulate-plot");
    let picture = folder.path("swing.svg");
    let output = furuta(&[
        "simulate",
        "--rig",
        "qube-servo-2",
        "--duration",
        "1",
        "--plot",
    ])
    .arg(&picture)
    .output()
    .expect("the binary runs");
    assert!(output.status.success() && output.stdout.is_empty());
    assert!(
        std::fs::read_to_string(picture)
            .expect("drawn")
            .contains("alpha [rad]")
    );
}

/// The whole way: friction is hidden in a rig, diagnosed from a recording, and what the repaired rig file names is made
/// up for.
#[test]
fn a_limit_cycle_goes_after_the_friction_is_diagnosed() {
    let folder = Folder::new("study-limit-cycle");
    let [data, repaired, picture] =
        ["steps.csv", "repaired.toml", "limit-cycle.svg"].map(|name| folder.path(name));
    let [data, repaired, picture] =
        [&data, &repaired, &picture].map(|path| path.to_str().expect("UTF-8"));
    let hidden = "arm.coulomb:torque=0.03";
    let steps = ["--input", "steps", "--amplitude", "3", "--duration", "8"];
    let simulated = furuta(&["simulate", "--rig", "shahzad2022-srv02", "--hide", hidden])
        .args(steps)
        .args(["--output", data])
        .status();
    assert!(simulated.expect("the binary runs").success());
    let diagnosed = json(&[
        "diagnose",
        data,
        "--rig",
        "shahzad2022-srv02",
        "--json",
        "--write-rig",
        repaired,
    ]);
    assert_eq!(diagnosed["effects"][0]["id"], "arm.coulomb");
    let study = json(&[
        "study",
        "limit-cycle",
        "--hide",
        hidden,
        "--known",
        repaired,
        "--plot",
        picture,
        "--json",
    ]);
    let arm: Vec<f64> = (0..3)
        .map(|i| study["runs"][i]["arm"].as_f64().expect("a number"))
        .collect();
    // 15 times and more; a fifth leaves room for where a run ends.
    assert!(arm[1] < 0.2 * arm[0] && arm[2] < 0.2 * arm[0], "{arm:?}");
    let drawn = std::fs::read_to_string(picture).expect("drawn");
    assert!(drawn.contains("arm [rad]") && drawn.contains("compensated"));
}

#[test]
fn estimators_are_compared() {
    let study = json(&["study", "estimators", "--duration", "4", "--json"]);
    let rows = study["estimators"].as_array().expect("a list");
    assert_eq!(rows.len(), 2 * furuta_ctrl::estimators::CATALOGUE.len());
    for row in rows {
        let error = row["arm_speed"].as_f64().expect("a number");
        assert!(error > 0.0 && error < 1.0, "{row}");
    }
}

#[test]
fn predictive_control_is_compared() {
    let folder = Folder::new("study-mpc");
    let picture = folder.path("mpc.svg");
    let picture = picture.to_str().expect("UTF-8");
    let study = json(&[
        "study",
        "mpc",
        "--duration",
        "2",
        "--pendulum-angle",
        "0.1",
        "--plot",
        picture,
        "--json",
    ]);
    let runs = study["runs"].as_array().expect("a list");
    assert_eq!(runs.len(), 4);
    let figure = |k: usize, name: &str| runs[k][name].as_f64().expect("a number");
    assert!(figure(0, "alpha_max") > 0.2 && figure(3, "alpha_max") < 0.102);
    assert!((figure(2, "cost") - figure(3, "cost")).abs() < 1e-4);
    assert!(
        std::fs::read_to_string(picture)
            .expect("drawn")
            .contains("MPC, active set")
    );
    let wrong = failure(&["study", "mpc", "--step", "0"]);
    assert!(wrong.contains("step = 0 rad"), "{wrong}");
}

#[test]
fn mistakes_say_what_to_do() {
    for wrong in [
        ["limit-cycle", "--duration", "1e-9"],
        ["limit-cycle", "--rate", "1e12"],
        ["estimators", "--duration", "1e300"],
        ["estimators", "--rate", "NaN"],
    ] {
        let output = furuta(&["study"]).args(wrong).output().expect("runs");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(
            output.status.code() == Some(2) && said.contains("must be a number from"),
            "{said}"
        );
    }
    for draws in ["0", "-1", "1000001"] {
        let output = furuta(&["study", "swing-up", "--draws", draws]).output();
        let output = output.expect("runs");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(
            output.status.code() == Some(2) && said.contains("must be a whole number from 1 to"),
            "{said}"
        );
    }
    let wrong = failure(&["study", "fong2014", "--duration", "5"]);
    let wanted = "--duration 5 s is too short for lines 0.05 Hz apart: give at least 130 s";
    assert!(wrong.contains(wanted), "{wrong}");
    let wrong = failure(&["study", "shahzad2022", "--rig", "stepper-kit"]);
    let wanted = "rig stepper-kit: the rig's motor.kind is \"acceleration\", its command in rad/s2: this study needs a \
                  rig that is commanded in volts (motor.kind = \"voltage\"), such as shahzad2022-srv02";
    assert!(wrong.contains(wanted), "{wrong}");
    let wrong = failure(&["study", "limit-cycle", "--hide", "arm.jelly"]);
    assert!(wrong.contains("arm.jelly"), "{wrong}");
    let wrong = failure(&[
        "study",
        "shahzad2022",
        "--task",
        "push",
        "--plot",
        "push.png",
    ]);
    assert!(wrong.contains("end in .svg"), "{wrong}");
    let wrong = failure(&["study", "ramos-velasco", "--order", "9", "--draws", "0"]);
    assert!(wrong.contains("1 to 7"), "{wrong}");
    let wrong = failure(&[
        "design",
        "steady-motion",
        "--rig",
        "qube-servo-2",
        "--order",
        "0",
    ]);
    assert!(wrong.contains("1 to 15"), "{wrong}");
}

#[test]
fn drawn_rigs_are_swung_up() {
    let folder = Folder::new("study-swing-up");
    let picture = folder.path("times.svg");
    let picture = picture.to_str().expect("UTF-8");
    let rig = ["study", "swing-up", "--rig", "shahzad2022-srv02"];
    let few = [&rig[..], &["--draws", "8", "--plot", picture]].concat();
    let study = json(&[&few[..], &["--json"]].concat());
    let count = |name: &str| study[name].as_u64();
    assert_eq!((count("draws"), count("up")), (Some(8), Some(8)));
    assert!(study["time"]["median"].as_f64().is_some_and(|t| t < 5.0));
    assert!(study["limit"].is_null(), "nothing to explain");
    let svg = std::fs::read_to_string(picture).expect("drawn");
    assert!(svg.contains("shahzad2022-srv02"));
    let text = furuta(&few).output().expect("the binary runs").stdout;
    assert!(String::from_utf8_lossy(&text).contains("8 of 8 up"));
    let wrong = failure(&[&rig[..], &["--set", "motor.volts=3"]].concat());
    assert!(wrong.contains("motor.command_limit"), "{wrong}");
}

#[test]
fn a_rig_that_cannot_come_up_is_told_apart() {
    // A tenth of a volt: nothing comes up, and the command says what the motor can do.
    let weak = ["--rig", "qube-servo-2", "--set", "motor.command_limit=0.1"];
    let study = [
        &["study", "swing-up", "--draws", "2", "--patience", "2"][..],
        &weak,
    ]
    .concat();
    let v = json(&[&study[..], &["--json"]].concat());
    assert_eq!(v["up"].as_u64(), Some(0));
    assert!(
        v["limit"]["nearest"].as_f64().is_some_and(|a| a > 2.5),
        "{v}"
    );
    let text = furuta(&study).output().expect("the binary runs").stdout;
    assert!(String::from_utf8_lossy(&text).contains("no voltage"));
    let reach = [
        &[
            "study",
            "reach",
            "--restarts",
            "1",
            "--seconds",
            "0.5",
            "--json",
        ][..],
        &weak,
    ];
    let v = json(&reach.concat());
    let number = |name: &str| v[name]["value"].as_f64().expect("a number");
    assert!(number("nearest") > 2.5 && number("work") < number("needed"));
}

#[test]
fn regions_of_attraction_are_measured_and_drawn() {
    let folder = Folder::new("study-region");
    let picture = folder.path("region.svg");
    let picture = picture.to_str().expect("UTF-8");
    let file = folder.path("weak.toml");
    std::fs::write(&file, "[limits]\ncommand = 2\n").expect("written");
    let file = file.to_str().expect("UTF-8");
    let rig = [
        "study",
        "region",
        "--rig",
        "shahzad2022-srv02",
        "--points",
        "15",
    ];
    let both = [
        "--controller",
        "all",
        "--controller",
        file,
        "--plot",
        picture,
        "--json",
    ];
    let v = json(&[&rig[..], &both].concat());
    let rows = v["controllers"].as_array().expect("a list");
    let share = |i: usize| rows[i]["share"].as_f64().expect("a number");
    let last = rows.len() - 1;
    assert!(last >= 4 && rows[last]["name"] == "weak", "{rows:?}");
    assert!(share(0) > 0.3 && share(last) < 0.5 * share(0), "{rows:?}");
    let svg = std::fs::read_to_string(picture).expect("drawn");
    assert!(svg.contains("lqr_sliding") && svg.contains("weak"));
    let text = furuta(&rig).output().expect("the binary runs").stdout;
    assert!(String::from_utf8_lossy(&text).contains("can be held by 10 V"));
}

#[test]
fn parts_of_a_study_make_the_whole() {
    let folder = Folder::new("study-parts");
    let asked = |more: &[&str]| {
        let args = [
            &[
                "study",
                "region",
                "--rig",
                "shahzad2022-srv02",
                "--points",
                "7",
            ],
            more,
        ];
        let output = furuta(&args.concat()).output().expect("the binary runs");
        assert!(output.status.success(), "{more:?}");
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let parts: Vec<String> = (1..=3)
        .map(|k| {
            folder.file(
                &format!("part-{k}.jsonl"),
                asked(&["--part", &format!("{k}/3")]),
            )
        })
        .map(|path| path.display().to_string())
        .collect();
    let with = |parts: &[&String]| -> Vec<String> {
        let flags = parts
            .iter()
            .map(|path| ["--parts".to_owned(), (*path).clone()]);
        flags.flatten().collect()
    };
    let [a, b, c] = &parts[..] else {
        panic!("three parts")
    };
    let together = with(&[c, a, b]);
    let together: Vec<&str> = together.iter().map(String::as_str).collect();
    assert_eq!(asked(&together), asked(&[]));
    assert_eq!(
        asked(&[&together[..], &["--json"]].concat()),
        asked(&["--json"])
    );
    let refused = |points: &str, parts: &[&String], more: &[&str]| {
        let parts = with(parts);
        let mut args = vec![
            "study",
            "region",
            "--rig",
            "shahzad2022-srv02",
            "--points",
            points,
        ];
        args.extend(parts.iter().map(String::as_str).chain(more.iter().copied()));
        failure(&args)
    };
    assert!(
        refused("7", &[a, c], &[]).contains("are in none of the parts: give every part K of N")
    );
    assert!(refused("7", &[a, b, b, c], &[]).contains("is in two parts: give each part once"));
    assert!(
        refused("9", &[a, b, c], &[])
            .contains("none of the parts is of this study with these options")
    );
    let picture = folder.path("map.svg");
    let picture = picture.to_str().expect("UTF-8");
    assert!(
        refused("7", &[], &["--part", "1/2", "--plot", picture])
            .contains("give --plot with --parts")
    );
    let odd = folder.file("odd.jsonl", "no part\n").display().to_string();
    assert!(refused("7", &[&odd], &[]).contains("give files that hold what --part printed"));
}
