//! The catalogue through the built binary.

use crate::common;

use common::{failure, furuta};
use furuta_model::{CATALOGUE, Effect, RARE, Rig, effects};
use serde_json::Value;

fn text(args: &[&str]) -> String {
    let output = furuta(args).output().expect("the binary runs");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    String::from_utf8(output.stdout).expect("UTF-8")
}

fn json(args: &[&str]) -> Value {
    serde_json::from_str(&text(args)).expect("JSON")
}

#[test]
fn all_are_listed() {
    let lines = text(&["effects"]);
    let ids: Vec<_> = lines
        .lines()
        .filter_map(|l| l.split_whitespace().next())
        .collect();
    let known: Vec<_> = effects::all().map(|s| s.id).collect();
    assert_eq!(ids, known);
    assert!(lines.contains("stiffness [N m/rad], rest [rad]"), "{lines}");
    assert!(
        lines.contains("gap [rad], motor_share, encoder [arm or motor]"),
        "{lines}"
    );
    let all = json(&["effects", "--json"]);
    for (entry, spec) in all.as_array().expect("a list").iter().zip(effects::all()) {
        assert_eq!(entry["id"], spec.id);
        assert_eq!(entry["parameters"][0]["unit"], spec.parameters[0].unit);
        assert_eq!(entry["offered"], spec.offered.word());
    }
}

#[test]
fn each_is_explained() {
    for spec in effects::all() {
        let page = text(&["effects", spec.id]);
        for part in [
            spec.name,
            spec.law,
            spec.sentence,
            spec.shows,
            spec.experiment,
        ]
        .iter()
        .chain(spec.look_alikes)
        {
            assert!(page.contains(part), "{part} is missing in\n{page}");
        }
        for p in spec.parameters {
            let unit = if p.unit == "-" { "" } else { p.unit };
            assert!(page.contains(p.name) && page.contains(unit), "{page}");
        }
    }
}

#[test]
fn parameters_that_are_no_quantities() {
    let page = text(&["effects", "disturbance.kick"]);
    assert!(
        page.contains("whole number, 0 to 1000000; 0 if not given"),
        "{page}"
    );
    let page = json(&["effects", "drive.backlash", "--json"]);
    let [gap, share, encoder] = [0, 1, 2].map(|i| &page["parameters"][i]);
    assert_eq!(gap["whole"], false);
    assert_eq!(share["default"], Value::Null);
    assert_eq!(encoder["choices"], serde_json::json!(["arm", "motor"]));
    assert_eq!(encoder["default"], "arm");
    assert_eq!(encoder["whole"], false);
}

/// The typical sizes are values that can be had, and that do something, on the rig they are for.
#[test]
fn sizes_are_those_of_the_rig() {
    for name in Rig::VOLTAGE {
        for spec in CATALOGUE.iter().chain(RARE) {
            let page = json(&["effects", spec.id, "--rig", name, "--json"]);
            assert_eq!(page["rig"], *name);
            let values: Vec<f64> = spec
                .parameters
                .iter()
                .zip(page["parameters"].as_array().expect("a list"))
                .map(|(p, shown)| {
                    let typical = &shown["typical"];
                    typical
                        .as_str()
                        .and_then(|word| p.choice(word))
                        .or(typical.as_f64())
                        .expect("a value")
                })
                .collect();
            let effect = Effect::new(spec.id, &values).expect(spec.id);
            assert!(!effect.is_off(), "{name}: {}", spec.id);
        }
    }
    let limit = |rig| {
        json(&["effects", "motor.saturation", "--rig", rig, "--json"])["parameters"][0]["typical"]
            .clone()
    };
    assert_eq!(limit("qube-servo-2"), 5.0); // half of 10 V
}

/// The command line that a page ends with is one.
#[test]
fn what_a_page_proposes_runs() {
    for spec in effects::all() {
        let page = text(&["effects", spec.id]);
        let line = page.lines().last().expect("a last line");
        let mut words: Vec<_> = line.split_whitespace().collect();
        assert_eq!(words.remove(0), "furuta");
        words.extend(["--duration", "0.1"]);
        assert!(text(&words).contains("\nt,u,theta,alpha"), "{line}");
    }
}

#[test]
fn what_does_not_exist_is_named() {
    let refused = |args: &[&str]| failure(&furuta(args).output().expect("the binary runs"));
    let line = refused(&["effects", "arm.colomb"]);
    assert!(
        line.contains("arm.colomb") && line.contains("arm.coulomb"),
        "{line}"
    );
    let line = refused(&["effects", "arm.coulomb", "--rig", "no-such-rig"]);
    assert!(line.contains("no-such-rig"), "{line}");
    let line = refused(&[
        "simulate",
        "--rig",
        "qube-servo-2",
        "--hide",
        "drive.backlash:encoder=gear",
    ]);
    assert!(line.contains("gear") && line.contains("motor"), "{line}");
}
