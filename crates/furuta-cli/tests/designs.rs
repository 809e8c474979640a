//! `furuta design` on rigs with effects: gains, poles, margins, rehearsal; and what `furuta run` refuses.

use crate::common;

use common::{Folder, failure, furuta, json};
use furuta_model::{Effect, Rig};
use serde_json::Value;

/// A rig file of a built-in rig with these effects.
fn file(folder: &Folder, name: &str, effects: &[(&str, &[f64])]) -> String {
    let mut rig = Rig::builtin(name).expect("built in");
    for (id, values) in effects {
        rig.effects.push(Effect::new(id, values).expect("sound"));
    }
    let path = folder.file("rig.toml", rig.to_toml());
    path.to_str().expect("a path").to_owned()
}

/// The one line that a command which fails says.
fn refusal(args: &[&str]) -> String {
    common::failure(&furuta(args).output().expect("the binary runs"))
}

fn number(v: &Value) -> f64 {
    v.as_f64().expect("a number")
}

/// What each design says of a rig with a spring on its arm is true of that rig.
#[test]
fn a_spring_is_designed_with() {
    let folder = Folder::new("designs-spring");
    let rig = file(&folder, "qube-servo-2", &[("arm.spring", &[0.005, 0.0])]);
    let poles = ["--poles", "-3,-20,-6+2i,-6-2i"];
    let placed = json(&[&["design", "place", "--rig", &rig, "--json"], &poles[..]].concat());
    assert!((number(&placed["loop"]["growth"]) + 3.0).abs() < 1e-6);
    for design in ["lqr", "lqi", "robust"] {
        let found = json(&["design", design, "--rig", &rig, "--json"]);
        assert!(number(&found["loop"]["growth"]) < -0.1, "{design}: {found}");
        assert_eq!(found["margins"]["stable"], true);
        assert_eq!(found["rehearsal"]["fell"], Value::Null, "{design}");
        let disk = number(&found["margins"]["disk"]);
        assert!(disk > 0.05 && disk <= 2.0, "{design}: {disk}");
    }
    // The gain of the same poles by a model without the spring does not have them.
    let on = ["design", "place", "--rig", "qube-servo-2", "--json"];
    let blind = json(&[&on[..], &poles].concat());
    assert!((number(&blind["k"][0]) - number(&placed["k"][0])).abs() > 1e-2);
}

/// Delay, lag and coupling are states of the loop; what is left out is listed, or described where asked for.
#[test]
fn the_loop_has_what_the_file_says() {
    let folder = Folder::new("designs-states");
    let effects: [(&str, &[f64]); 4] = [
        ("motor.delay", &[0.003]),
        ("motor.lag", &[0.004]),
        ("arm.coulomb", &[0.001]),
        ("motor.deadzone", &[0.1]),
    ];
    let rig = file(&folder, "qube-servo-2", &effects);
    let (bode, nyquist) = (folder.path("bode.svg"), folder.path("nyquist.svg"));
    let report = folder.path("loop.html");
    let pictures = [
        "--bode",
        bode.to_str().expect("a path"),
        "--nyquist",
        nyquist.to_str().expect("a path"),
        "--report",
        report.to_str().expect("a path"),
    ];
    let on = ["design", "lqr", "--rig", &rig, "--rate", "500"];
    let found = json(&[&on[..], &["--json"], &pictures].concat());
    let states: Vec<_> = found["loop"]["states"]
        .as_array()
        .expect("names")
        .iter()
        .collect();
    assert_eq!(states[4..], ["volts", "command 1", "command 2"]);
    assert_eq!(found["poles"].as_array().map(Vec::len), Some(7));
    let left_out: Vec<_> = found["loop"]["remarks"]
        .as_array()
        .expect("two")
        .iter()
        .collect();
    assert_eq!(left_out.len(), 2);
    assert!(
        left_out
            .iter()
            .all(|r| r["text"].as_str().is_some_and(|t| t.contains("left out")))
    );
    for picture in [bode, nyquist] {
        let svg = std::fs::read_to_string(picture).expect("written");
        assert!(svg.starts_with("<svg") && svg.contains("polyline") && !svg.contains("NaN"));
    }
    let page = std::fs::read_to_string(report).expect("written");
    assert_eq!(page.matches("<svg").count(), 2);
    for part in [
        "<h2>Bode plot of the loop</h2>",
        "<h2>Nyquist plot of the loop</h2>",
        "gain margin",
        "phase margin",
        "disk margin",
        "arm.coulomb: left out",
    ] {
        assert!(page.contains(part), "{part}");
    }
    let described = json(&[&on[..], &["--json", "--amplitudes", "0.5,0.5,1"]].concat());
    let remark = described["loop"]["remarks"].to_string();
    assert!(
        remark.contains("by its describing function") && !remark.contains("left out"),
        "{remark}"
    );
    let text = furuta(&on).output().expect("runs");
    let text = String::from_utf8_lossy(&text.stdout).into_owned();
    for word in [
        "states beside",
        "command 1",
        "arm.coulomb: left out",
        "margins",
        "rehearsed",
    ] {
        assert!(text.contains(word), "{word}: {text}");
    }
}

#[test]
fn a_pole_that_falls_is_refused() {
    for poles in ["-3,-20,2,-6", "-3,-20,0.5+2i,0.5-2i", "-3,-20,-6,0"] {
        let place = ["design", "place", "--rig", "qube-servo-2", "--poles", poles];
        let line = failure(&furuta(&place).output().expect("runs"));
        assert!(line.contains("is not stable"), "{line}");
    }
}

/// Sampled, a pole that turns by more than half a turn between samples is another one.
#[test]
fn a_pole_that_samples_cannot_tell_is_refused() {
    let place = |poles, rate: &[&'static str]| {
        let on = ["design", "place", "--rig", "qube-servo-2", "--poles", poles];
        furuta(&[&on, rate].concat()).output().expect("runs")
    };
    let line = failure(&place("-3+1000i,-3-1000i,-5,-6", &["--rate", "100"]));
    let wanted = "--poles: -3 ± 1000i rad/s turns by more than half a turn between samples at 100 Hz, where it is the \
                  same as -3 ± 256.637i rad/s: give an imaginary part of at most pi/h = 314.159 rad/s, or a --rate \
                  above 318.31 Hz";
    assert!(line.contains(wanted), "{line}");
    for (poles, rate) in [
        ("-3+1000i,-3-1000i,-5,-6", &[][..]),
        ("-3+1000i,-3-1000i,-5,-6", &["--rate", "500"]),
        ("-3+300i,-3-300i,-5,-6", &["--rate", "100"]),
    ] {
        assert!(place(poles, rate).status.success(), "{poles} {rate:?}");
    }
}

/// A motor whose command is no voltage has no speed that it settles at: the design has a limit all the same, and says
/// its command in the rig's unit.
#[test]
fn a_stepper_is_swung_up() {
    let folder = Folder::new("designs-stepper");
    let out = folder.path("up.toml");
    let design = ["design", "swing-up", "--rig", "stepper-kit", "--out"];
    let output = furuta(&design).arg(&out).output().expect("runs");
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{output:?}");
    assert!(
        said.contains("command to 142.50 rad/s2") && !said.contains("voltage"),
        "{said}"
    );
    let kit = furuta_ctrl::ControllerFile::load(&out).expect("a controller file");
    assert!(kit.config.trajectory.is_some());
}

/// A gain that was designed without the rig's cable is refused before anything moves, with the reason.
#[test]
fn a_loop_that_falls_on_the_model_is_not_run() {
    let folder = Folder::new("designs-refused");
    let bare = json(&[
        "design",
        "lqr",
        "--rig",
        "shahzad2022-srv02",
        "--rate",
        "500",
        "--json",
    ]);
    let rig = file(&folder, "shahzad2022-srv02", &[("arm.spring", &[0.5, 0.0])]);
    let controller = folder.file("k.toml", format!("[controller]\ngain = {}\n", bare["k"]));
    let controller = controller.to_str().expect("a path");
    let run = [
        "run",
        "--emulated",
        &rig,
        "--duration",
        "0.2",
        "--controller",
        controller,
    ];
    let output = furuta(&run).output().expect("runs");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success(), "{said}");
    assert!(
        said.contains("does not hold") && said.contains("nothing was moved"),
        "{said}"
    );
    let all_the_same = furuta(&[&run[..], &["--any-loop"]].concat())
        .output()
        .expect("runs");
    assert!(all_the_same.status.success());
}

/// A spring on the arm is the motor's business: another command for the same steady motion. What is not held is named.
#[test]
fn the_steady_motion_has_the_effects_of_the_rig_file() {
    let folder = Folder::new("designs-steady");
    let solve = |rig: &str| json(&["design", "steady-motion", "--rig", rig, "--json"]);
    let free = solve("qube-servo-2");
    let effects: [(&str, &[f64]); 2] = [("arm.spring", &[0.02, 0.1]), ("motor.lag", &[0.01])];
    let held = solve(&file(&folder, "qube-servo-2", &effects));
    assert_eq!(held["theta"], free["theta"]);
    assert_ne!(held["u"], free["u"]);
    assert!(number(&held["rest"]["command"]) < 0.0);
    let remarks = held["remarks"].as_array().expect("a list");
    assert_eq!(remarks.len(), 1);
    let said = remarks[0]["text"].as_str().expect("text");
    assert!(said.starts_with("motor.lag: left out"), "{said}");
    let tilted = file(&folder, "qube-servo-2", &[("arm.tilt", &[0.05, 0.3, 0.0])]);
    let said = refusal(&["design", "steady-motion", "--rig", &tilted]);
    assert!(
        said.contains("per rad of the arm's angle") && said.contains("arm.tilt"),
        "{said}"
    );
}

/// No vertex has a delay: the guarantee is said to be that of rigs without it.
#[test]
fn a_guarantee_says_for_which_rigs_it_holds() {
    let folder = Folder::new("designs-robust");
    let robust = |rig: &str| {
        let output = furuta(&["design", "robust", "--rig", rig])
            .output()
            .expect("runs");
        assert!(output.status.success());
        String::from_utf8(output.stdout).expect("UTF-8")
    };
    assert!(robust("qube-servo-2").contains("for every rig within the range; trace X"));
    let effects: [(&str, &[f64]); 2] = [("motor.delay", &[0.025]), ("arm.spring", &[0.005, 0.0])];
    let late = file(&folder, "qube-servo-2", &effects);
    let text = robust(&late);
    let told = "for every rig within the range that has no motor.delay: no guarantee is made for the file's own rig;";
    assert!(text.contains(told), "{text}");
    let found = json(&["design", "robust", "--rig", &late, "--json"]);
    assert_eq!(
        found["guarantee_without"],
        serde_json::json!(["motor.delay"])
    );
}

/// The pair that a relay tunes holds the spring that the file names; what it does not hold is refused.
#[test]
fn a_relay_tunes_for_the_spring_or_says_that_it_cannot() {
    let folder = Folder::new("designs-relay");
    let spring = file(&folder, "qube-servo-2", &[("arm.spring", &[0.02, 0.0])]);
    let found = json(&["design", "pid", "--relay", "--rig", &spring, "--json"]);
    assert!(number(&found["loop"]["growth"]) < 0.0, "{found}");
    assert_eq!(found["rehearsal"]["fell"], Value::Null, "{found}");
    let late = file(&folder, "qube-servo-2", &[("motor.delay", &[0.01])]);
    let said = refusal(&["design", "pid", "--relay", "--rig", &late]);
    assert!(
        said.contains("the linear loop grows by") && said.contains("motor.delay"),
        "{said}"
    );
}

/// A controller file is judged as a design judges its own gain; one that is not linear is refused.
#[test]
fn a_controller_file_is_judged() {
    let folder = Folder::new("designs-judge");
    let judge = |name: &str, text: &str| {
        let path = folder.file(name, text);
        let path = path.to_str().expect("a path").to_owned();
        json(&[
            "design",
            "judge",
            "--rig",
            "qube-servo-2",
            "--controller",
            &path,
            "--json",
        ])
    };
    let lqr = json(&[
        "design",
        "lqr",
        "--rig",
        "qube-servo-2",
        "--rate",
        "500",
        "--json",
    ]);
    for (name, text) in [
        ("empty.toml", ""),
        (
            "mpc.toml",
            "[controller]\nkind = \"mpc\"\npendulum_angle = 0.1\n",
        ),
        ("scheduled.toml", "[controller]\nkind = \"scheduled_lqr\"\n"),
    ] {
        let judged = judge(name, text);
        assert_eq!(judged["margins"], lqr["margins"], "{name}");
        assert_eq!(judged["k"], lqr["k"], "{name}");
    }
    let pid = judge("pid.toml", "[controller]\nkind = \"pid\"\n");
    let lqi = judge("lqi.toml", "[controller]\nkind = \"lqi\"\n");
    let disk = |found: &Value| number(&found["margins"]["disk"]);
    assert!((disk(&pid) - disk(&lqi)).abs() < 1e-9);
    let path = folder.file("sliding.toml", "[controller]\nkind = \"lqr_sliding\"\n");
    let path = path.to_str().expect("a path");
    let said = refusal(&[
        "design",
        "judge",
        "--rig",
        "qube-servo-2",
        "--controller",
        path,
    ]);
    assert!(
        said.contains("kind = \"lqr_sliding\" has no linear law"),
        "{said}"
    );
}
