//! `furuta diagnose` on what cannot be diagnosed: one clear line that says what, where and what to do, and exit code 1.

use crate::common;

use std::path::Path;

use common::{Folder, failure, furuta, rig_text, swing};

/// The one line with which `diagnose` fails; nothing is written to standard output, nor any report.
fn refusal(folder: &Folder, data: &Path, rig: &str) -> String {
    let report = folder.path("report.html");
    let output = furuta(&["diagnose", "--rig", rig, "--json", "--report"])
        .args([&report, data])
        .output()
        .expect("the binary runs");
    let line = failure(&output);
    assert!(output.stdout.is_empty() && !report.exists(), "{line}");
    line
}

#[test]
fn rig_files_that_are_refused() {
    let folder = Folder::new("diagnose-rigs");
    let data = folder.file("run.csv", swing());
    for (name, from, to, says) in [
        (
            "key.toml",
            "mass = 0.024",
            "mass = 0.024\nmas = 1",
            ["mas", "mass"],
        ),
        (
            "negative.toml",
            "mass = 0.024",
            "mass = -0.024",
            ["pendulum.mass", "-0.024"],
        ),
        (
            "text.toml",
            "com = 0.0645",
            "com = \"64 mm\"",
            ["line 14", "64 mm"],
        ),
    ] {
        let rig = folder.file(name, rig_text("qube-servo-2", from, to));
        let line = refusal(&folder, &data, rig.to_str().expect("UTF-8"));
        for piece in [name].iter().chain(&says) {
            assert!(line.contains(piece), "{name}: {line}");
        }
    }
    let line = refusal(&folder, &data, "no-such-rig");
    assert!(
        line.contains("no-such-rig") && line.contains("qube-servo-2"),
        "{line}"
    );
}

#[test]
fn recordings_that_are_refused() {
    let folder = Folder::new("diagnose-recordings");
    let rows = |bad: &str| format!("t,u,theta,alpha\n0,0,0,3.1\n0.1,0,0,3.1\n{bad}\n0.3,0,0,3.1\n");
    for (name, content, says) in [
        (
            "no-alpha.csv",
            "t,u,theta\n0,0,0\n".to_owned(),
            ["no column `alpha`", "required are t (s), u (V)"],
        ),
        (
            "nan.csv",
            rows("0.2,0,0,NaN"),
            ["row 4, column alpha", "NaN"],
        ),
        (
            "backwards.csv",
            rows("0.05,0,0,3.1"),
            ["row 4, column t", "from 0.1 s to 0.05 s"],
        ),
        (
            "empty.csv",
            String::new(),
            ["the file is empty", "t,u,theta,alpha"],
        ),
        ("empty.mcap", String::new(), ["the file is empty", ""]),
        (
            "letter.mcap",
            "Dear Sir or Madam".to_owned(),
            ["not an MCAP file", "furuta run"],
        ),
    ] {
        let line = refusal(&folder, &folder.file(name, content), "qube-servo-2");
        for piece in [name].iter().chain(&says) {
            assert!(line.contains(piece), "{name}: {line}");
        }
    }
    // Sound, but no diagnosis can be made of so little: that is said of all recordings together.
    let short = folder.file("short.csv", rows("0.2,0,0,3.1"));
    let line = refusal(&folder, &short, "qube-servo-2");
    assert!(line.contains("record longer"), "{line}");
    let line = refusal(&folder, &folder.path("absent.csv"), "qube-servo-2");
    assert!(line.contains("absent.csv"), "{line}");
}

/// A spring that is there with the pendulum on and not without: said in text and JSON; an arm alone has no plan.
#[test]
fn two_states_of_a_rig_are_compared() {
    let folder = Folder::new("diagnose-compare");
    let input = "multisine --amplitude 1 --duration 6";
    let with = recorded(&folder, "with.csv", "arm.spring", input);
    let without = recorded(&folder, "without.csv", "arm.coulomb:torque=0", input);
    let diagnose = |more: &[&str]| {
        furuta(&["diagnose", "--rig", "qube-servo-2"])
            .args([with.as_path(), Path::new("--compare"), without.as_path()])
            .args(more)
            .output()
            .expect("the binary runs")
    };
    let output = diagnose(&["--json"]);
    assert!(output.status.success(), "{output:?}");
    let answer: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let said = &answer["comparison"]["differences"][0];
    let known = (&said["id"], &said["parameter"], &said["differs"]);
    assert_eq!(
        known,
        (&"arm.spring".into(), &"stiffness".into(), &true.into()),
        "{answer}"
    );
    assert_eq!(answer["comparison"]["named"], serde_json::json!([]));

    let text = String::from_utf8(diagnose(&[]).stdout).expect("text");
    assert!(text.contains("Against "), "{text}");
    assert!(text.contains("arm.spring stiffness: "), "{text}");
    for (more, says) in [
        (&["--pendulum", "locked", "--plan"][..], "--plan"),
        (
            &["--pendulum", "off"],
            "give swings, removed, locked, alone or driven, not off",
        ),
    ] {
        let refused = diagnose(more);
        let stderr = String::from_utf8_lossy(&refused.stderr);
        assert_eq!(refused.status.code(), Some(2), "{stderr}");
        assert!(stderr.contains(says), "{stderr}");
    }
}

/// One that `--verify` names is checked as well: a bad one is named and left out, one that cannot be opened or that the
/// search sees ends the command at once.
#[test]
fn what_is_verified_is_checked_first() {
    let folder = Folder::new("diagnose-verify");
    let input = "multisine --amplitude 1 --duration 6";
    let sound = recorded(&folder, "sound.csv", "arm.spring", input);
    let unseen = recorded(&folder, "unseen.csv", "arm.spring", "chirp --duration 4");
    let text = std::fs::read_to_string(&sound).expect("written");
    let empty = folder.file("empty.csv", "");
    let copy = folder.file("copy.csv", &text);
    let diagnose = |verify: &[&Path]| {
        furuta(&["diagnose", "--rig", "qube-servo-2", "--json"])
            .args([sound.as_path(), Path::new("--verify")])
            .args(verify)
            .output()
            .expect("the binary runs")
    };
    let output = diagnose(&[&empty, &unseen]);
    assert!(output.status.success(), "{output:?}");
    let answer: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let notices = answer["notices"].to_string();
    assert!(
        notices.contains("empty.csv: left out: the file is empty"),
        "{notices}"
    );
    assert_eq!(
        answer["verification"].as_array().map(Vec::len),
        Some(2),
        "{answer}"
    );

    for seen in [&sound, &copy] {
        let line = failure(&diagnose(&[&unseen, seen]));
        assert!(line.contains("the search sees"), "{line}");
    }
    #[cfg(unix)]
    {
        let link = folder.path("link.csv");
        std::os::unix::fs::symlink(&sound, &link).expect("a link");
        let line = failure(&diagnose(&[&link]));
        assert!(
            line.contains("link.csv") && line.contains("sound.csv"),
            "{line}"
        );
    }
    let line = failure(&diagnose(&[&folder.path("absent.csv")]));
    assert!(line.contains("absent.csv"), "{line}");
}

/// A suspicious recording among several is left out by name; where too little is left, the command ends.
#[test]
fn a_suspicious_recording_among_several_is_left_out() {
    let folder = Folder::new("diagnose-left-out");
    let input = "multisine --amplitude 1 --duration 6";
    let sound = recorded(&folder, "sound.csv", "arm.spring", input);
    let text = std::fs::read_to_string(&sound).expect("written");
    let mut wrong = String::from("t,u,theta,alpha\n");
    for line in text.lines().skip(1) {
        let (t, rest) = line.split_once(',').expect("columns");
        let (u, angles) = rest.split_once(',').expect("columns");
        let u: f64 = u.parse().expect("a number");
        wrong += &format!("{t},{},{angles}\n", -u);
    }
    let wrong = folder.file("wrong.csv", wrong);
    for command in [&["diagnose"][..], &["identify", "calibrate"]] {
        let output = furuta(command)
            .args(["--rig", "qube-servo-2", "--json"])
            .args([&wrong, &sound])
            .output()
            .expect("the binary runs");
        assert!(output.status.success(), "{output:?}");
        let answer: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let notices = answer["notices"].to_string();
        assert!(
            notices.contains("wrong.csv: left out: the arm answers the command"),
            "{notices}"
        );
    }
    let line = refusal(&folder, &wrong, "qube-servo-2");
    assert!(
        line.contains("wrong sign") && line.contains("--accept-suspicious"),
        "{line}"
    );
}

/// A log that was cut off is not diagnosed as if it were whole; the line says how to go on with what is left.
#[test]
fn a_truncated_log_is_refused() {
    let folder = Folder::new("diagnose-truncated");
    let whole = folder.path("whole.mcap");
    let converted = furuta(&["convert"])
        .args([&folder.file("run.csv", swing()), &whole])
        .output()
        .expect("the binary runs");
    assert!(converted.status.success(), "{converted:?}");
    let bytes = std::fs::read(&whole).expect("written");
    let cut = folder.file("cut.mcap", &bytes[..bytes.len() / 2]);
    let line = refusal(&folder, &cut, "qube-servo-2");
    assert!(
        line.contains("cut.mcap") && line.contains("cut off") && line.contains("furuta convert"),
        "{line}"
    );
}

/// Ctrl-C in the middle of a search: what is known so far, marked as such, every file written, exit code 130.
#[cfg(target_os = "linux")]
#[test]
fn ctrl_c_gives_what_is_known_so_far() {
    use std::process::{Command, Stdio};
    use std::time::Duration;

    let folder = Folder::new("diagnose-ctrl-c");
    // Two effects that have to be found one after the other, in a minute of data: a search of many seconds.
    let data = folder.path("run.csv");
    let simulated = furuta(&["simulate", "--rig", "qube-servo-2", "--duration", "60"])
        .args([
            "--input",
            "multisine",
            "--hide",
            "arm.coulomb",
            "--hide",
            "arm.spring",
        ])
        .arg("--output")
        .arg(&data)
        .output()
        .expect("the binary runs");
    assert!(simulated.status.success(), "{simulated:?}");
    let [json, report, rig] = ["out.json", "out.html", "out.toml"].map(|name| folder.path(name));
    let child = furuta(&["diagnose", "--rig", "qube-servo-2"])
        .arg(&data)
        .arg("--json-file")
        .arg(&json)
        .arg("--report")
        .arg(&report)
        .arg("--write-rig")
        .arg(&rig)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary runs");
    // Before the search begins there is nothing to tell, and Ctrl-C ends the program as it ends any other. When the
    // recording is read depends on the machine: the process itself says when it listens.
    let listens = || {
        let status =
            std::fs::read_to_string(format!("/proc/{}/status", child.id())).expect("a process");
        let caught = status
            .lines()
            .find_map(|line| line.strip_prefix("SigCgt:"))
            .expect("a mask");
        u64::from_str_radix(caught.trim(), 16).expect("a mask") & 0b10 != 0
    };
    while !listens() {
        std::thread::sleep(Duration::from_millis(10));
    }
    std::thread::sleep(Duration::from_millis(300));
    let pressed = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .expect("kill");
    assert!(pressed.success());
    let output = child.wait_with_output().expect("it ends");
    let text = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(130), "{output:?}");
    assert!(
        text.starts_with("Interrupted") && text.contains("may be missing all the same"),
        "{text}"
    );
    let answer = std::fs::read_to_string(&json).expect("written");
    assert!(
        answer.contains("\"interrupted\": true") && answer.contains("\"search\""),
        "{answer}"
    );
    let page = std::fs::read_to_string(&report).expect("written");
    assert!(page.contains("The diagnosis was interrupted"));
    furuta_model::Rig::load(rig.to_str().expect("UTF-8")).expect("a rig file");
}

/// A search that its time limit ends is a success that says what it left undone; a limit that is none is refused.
#[test]
fn the_time_limit_gives_what_is_known_so_far() {
    let folder = Folder::new("diagnose-time-limit");
    let data = folder.file("run.csv", swing());
    let output = furuta(&[
        "diagnose",
        "--rig",
        "qube-servo-2",
        "--json",
        "--time-limit",
        "0.001",
    ])
    .arg(&data)
    .output()
    .expect("the binary runs");
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let answer = String::from_utf8_lossy(&output.stdout);
    assert!(
        answer.contains("\"interrupted\": false") && answer.contains("\"search\""),
        "{answer}"
    );
    for none in ["0", "-1", "nan", "inf", "soon"] {
        let output = furuta(&["diagnose", "--rig", "qube-servo-2"])
            .arg(format!("--time-limit={none}"))
            .arg(&data)
            .output()
            .expect("the binary runs");
        assert_eq!(output.status.code(), Some(2), "{none}: {output:?}");
    }
}

/// A recording of a rig with something hidden, by its encoders: what `furuta simulate` writes, in whole counts.
fn recorded(folder: &Folder, name: &str, hide: &str, input: &str) -> std::path::PathBuf {
    let output = furuta(&[
        "simulate",
        "--rig",
        "qube-servo-2",
        "--hide",
        hide,
        "--input",
    ])
    .args(input.split(' '))
    .output()
    .expect("the binary runs");
    assert!(output.status.success(), "{output:?}");
    let rig = furuta_model::Rig::builtin("qube-servo-2").expect("built in");
    let mut text = String::from("t,u,theta,alpha\n");
    let written = String::from_utf8(output.stdout).expect("UTF-8");
    for line in written
        .lines()
        .filter(|l| l.starts_with(|c: char| c.is_ascii_digit()))
    {
        let values: Vec<f64> = line
            .split(',')
            .map(|v| v.parse().expect("a number"))
            .collect();
        let [theta, alpha] = rig.sensors.quantised([values[2], values[3]]);
        text += &format!("{},{},{theta},{alpha}\n", values[0], values[1]);
    }
    folder.file(name, text)
}

/// What the sheet shows to be wrong is refused by name, and taken where the person insists.
#[test]
fn mistakes_that_only_the_rig_shows_are_refused() {
    let folder = Folder::new("diagnose-mistakes");
    let sound = recorded(
        &folder,
        "sound.csv",
        "arm.spring",
        "multisine --amplitude 1 --duration 8",
    );
    let text = std::fs::read_to_string(&sound).expect("written");
    let changed = |name: &str, change: fn(&mut [f64])| {
        let mut out = String::from("t,u,theta,alpha\n");
        for line in text.lines().skip(1) {
            let mut row: Vec<f64> = line
                .split(',')
                .map(|v| v.parse().expect("a number"))
                .collect();
            change(&mut row);
            let row: Vec<String> = row.iter().map(f64::to_string).collect();
            out += &(row.join(",") + "\n");
        }
        folder.file(name, out)
    };
    for (name, change, says) in [
        (
            "hanging.csv",
            (|r| r[3] -= std::f64::consts::PI) as fn(&mut [f64]),
            "measured from hanging",
        ),
        (
            "swapped.csv",
            |r| r.swap(2, 3),
            "columns theta and alpha are swapped",
        ),
        (
            "degrees.csv",
            |r| r[2..].iter_mut().for_each(|y| *y = y.to_degrees()),
            "in degrees",
        ),
        (
            "u.csv",
            |r| r[1] = -r[1],
            "answers the command with the wrong sign",
        ),
        ("alpha.csv", |r| r[3] = -r[3], "counted the other way"),
        ("theta.csv", |r| r[2] = -r[2], "counted the other way"),
        (
            "slow.csv",
            |r| r[0] *= 2.0,
            "time stamps are off by a factor of 2.0",
        ),
        (
            "fast.csv",
            |r| r[0] *= 0.5,
            "time stamps are off by a factor of 0.5",
        ),
        ("ms.csv", |r| r[0] *= 1000.0, "milliseconds"),
        (
            "clipped.csv",
            |r| r[2] = r[2].clamp(-0.2, 0.2),
            "stops dead at",
        ),
    ] {
        let line = refusal(&folder, &changed(name, change), "qube-servo-2");
        assert!(
            line.contains(name) && line.contains(says) && line.contains("--accept-suspicious"),
            "{name}: {line}"
        );
    }
    // Two rigs: the same signal on another one.
    let other = furuta(&[
        "simulate",
        "--rig",
        "shahzad2022-srv02",
        "--input",
        "multisine",
    ])
    .args(["--amplitude", "1", "--output"])
    .arg(folder.path("other.csv"))
    .output()
    .expect("the binary runs");
    assert!(other.status.success());
    let output = furuta(&["diagnose", "--rig", "qube-servo-2"])
        .args([&sound, &folder.path("other.csv")])
        .output()
        .expect("the binary runs");
    // One alone that does not fit the rig is left out; two that contradict each other end the command.
    let said = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    assert!(
        said.contains("other.csv") && said.contains("another rig"),
        "{said}"
    );
}

/// What is looked for on request is an entry of the catalogue.
#[test]
fn candidates_that_are_refused() {
    let folder = Folder::new("diagnose-candidates");
    let data = folder.file("run.csv", swing());
    let output = furuta(&[
        "diagnose",
        "--rig",
        "qube-servo-2",
        "--candidate",
        "arm.sprong",
    ])
    .arg(&data)
    .output()
    .expect("the binary runs");
    let line = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success(), "{line}");
    assert!(
        line.contains("arm.sprong") && line.contains("arm.stop"),
        "{line}"
    );
}

const BRAKE: &str = r#"[hypothesis."user.eddy-brake"]
name = "Eddy-current brake at the arm"
arm = "-k*theta_dot/(1 + (theta_dot/v)^2)"
parameters.k = { unit = "N m s/rad", min = 0.0, max = 0.1, typical = 1e-3, strength = true }
parameters.v = { unit = "rad/s", min = 0.3, max = 100.0, typical = 3.0 }
"#;

/// A law of a file is hidden, looked for, found, written into the rig file, simulated and calibrated from there.
#[test]
fn a_law_of_a_file_goes_all_the_way() {
    let folder = Folder::new("diagnose-own");
    let law = folder.file("brake.toml", BRAKE);
    let (data, rig) = (folder.path("run.csv"), folder.path("repaired.toml"));
    let run = |output: std::process::Output| {
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{said}");
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let hidden = format!("{}:k=2e-3,v=2", law.display());
    let input = ["simulate", "--rig", "qube-servo-2", "--input", "chirp"];
    let output = furuta(&input)
        .args([
            "--amplitude",
            "4",
            "--duration",
            "6",
            "--hide",
            &hidden,
            "--output",
        ])
        .arg(&data)
        .output();
    run(output.expect("the binary runs"));
    let output = furuta(&["diagnose", "--rig", "qube-servo-2", "--json", "--candidate"])
        .args([&law, &data])
        .arg("--write-rig")
        .arg(&rig)
        .output();
    let json = run(output.expect("the binary runs"));
    let answer: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(answer["verdict"], "missing_effects", "{json}");
    assert_eq!(answer["effects"][0]["id"], "user.eddy-brake");
    let k = answer["effects"][0]["parameters"]["k"]["value"].as_f64();
    assert!((k.expect("a number") - 2e-3).abs() < 1e-4, "{json}");
    let text = std::fs::read_to_string(&rig).expect("written");
    assert!(
        text.contains("[hypothesis.\"user.eddy-brake\"]\nname = \"Eddy"),
        "{text}"
    );
    // The rig file needs nothing beside it.
    let again = furuta(&["simulate", "--input", "step", "--amplitude", "1", "--rig"])
        .arg(&rig)
        .arg("--output")
        .arg(folder.path("step.csv"))
        .output();
    run(again.expect("the binary runs"));
    let design = furuta(&["design", "lqr", "--rig"]).arg(&rig).output();
    run(design.expect("the binary runs"));
    let calibrated = furuta(&[
        "identify",
        "calibrate",
        "--free",
        "user.eddy-brake.k",
        "--json",
        "--rig",
    ])
    .arg(&rig)
    .arg(&data)
    .output();
    let json = run(calibrated.expect("the binary runs"));
    assert!(json.contains("user.eddy-brake.k"), "{json}");
    let explained = furuta(&["effects"]).arg(&law).output();
    let said = run(explained.expect("the binary runs"));
    assert!(
        said.contains("arm: -k*theta_dot/(1 + (theta_dot/v)^2)"),
        "{said}"
    );
}

/// A mistake in a file of laws is shown where it is.
#[test]
fn a_law_with_a_mistake_is_marked() {
    let folder = Folder::new("diagnose-own-wrong");
    let data = folder.file("run.csv", swing());
    let law = folder.file("brake.toml", BRAKE.replace("theta_dot/v", "thetta_dot/v"));
    let other = folder.file("other.toml", BRAKE);
    let same_id = folder.file("same-id.toml", BRAKE.replace("1 + (", "2 + ("));
    let said = |candidates: &[&std::path::PathBuf]| {
        let mut command = furuta(&["diagnose", "--rig", "qube-servo-2"]);
        for file in candidates {
            command.arg("--candidate").arg(file);
        }
        let output = command.arg(&data).output().expect("the binary runs");
        assert!(!output.status.success());
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let marked = said(&[&law]);
    assert!(
        marked.contains(
            "hypothesis user.eddy-brake, arm (line 3), character 20: `thetta_dot` is no variable"
        ) && marked.contains("                     ^^^^^^^^^^"),
        "{marked}"
    );
    assert!(said(&[&other, &same_id]).contains("two different laws are called user.eddy-brake"));
    assert!(said(&[&folder.path("none.toml")]).contains("none.toml"));
}
