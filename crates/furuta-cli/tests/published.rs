//! The papers' figures beside ours, as `furuta rigs NAME` shows them and as the documentation repeats them.

use crate::common;

use common::{Folder, furuta, rig_text};
use furuta_model::published::PAPERS;
use serde_json::Value;

fn stdout(args: &[&str]) -> String {
    let output = furuta(args).output().expect("the binary runs");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    String::from_utf8(output.stdout).expect("UTF-8")
}

fn json(rig: &str) -> Value {
    serde_json::from_str(&stdout(&["rigs", rig, "--json"])).expect("JSON")
}

#[test]
fn figures_in_json_agree_or_say_why_not() {
    for paper in PAPERS {
        let published = &json(paper.rig)["published"];
        let figures = published["figures"].as_array().expect("a list");
        assert_eq!(figures.len(), paper.figures.len());
        for (figure, source) in figures.iter().zip(paper.figures) {
            assert_eq!(figure["printed"].as_f64(), Some(source.printed));
            let difference = figure["relative_difference"].as_f64();
            match source.within {
                // The widest agreement claimed is that of the fit (29) with (28).
                Some(_) => assert!(difference.expect("computed").abs() < 0.01, "{figure}"),
                None => {
                    let remark = figure["remark"].as_str().expect("text");
                    assert!(!remark.is_empty(), "{figure}");
                    assert!(difference.is_none_or(|d| d.abs() > 0.01), "{figure}");
                }
            }
        }
        let errata = published["errata"].as_array().expect("a list");
        assert_eq!(errata.len(), paper.errata.len());
    }
    assert!(json("qube-servo-2")["published"].is_null());
}

#[test]
fn gain_c_is_recomputed() {
    let shown = json("shahzad2022-srv02");
    let figures = shown["published"]["figures"].as_array().expect("a list");
    let gain: Vec<f64> = figures
        .iter()
        .filter(|f| f["where"] == "(C)")
        .map(|f| f["ours"].as_f64().expect("computed"))
        .collect();
    // As printed, in two decimals; the paper's order.
    for (ours, printed) in gain.iter().zip([-1.0, -2.02, 27.68, 3.56]) {
        assert!((ours - printed).abs() < 0.005, "{gain:?}");
    }
    assert_eq!(gain.len(), 4);
}

#[test]
fn every_rig_is_controllable_up_and_down() {
    for rig in furuta_model::Rig::BUILTIN {
        let shown = json(rig);
        for at in ["upright", "hanging"] {
            let c = &shown["linearisation"][at]["controllability"];
            assert_eq!(c["rank"], 4, "{rig} {at}");
            assert!(
                c["condition"].as_f64().is_some_and(|c| c > 1.0),
                "{rig} {at}"
            );
        }
        assert!(stdout(&["rigs", rig]).contains("controllable  yes, rank 4 of 4"));
    }
}

#[test]
fn without_gravity_the_rank_is_not_full() {
    let folder = Folder::new("rigs-weightless");
    let path = folder.file(
        "weightless.toml",
        rig_text("ramos-velasco", "gravity = 9.81", "gravity = 0.0"),
    );
    let path = path.to_str().expect("UTF-8");
    // Without gravity and hinge friction alpha'' is a fixed multiple of theta'': what the two differ by, and its rate,
    // no torque changes.
    assert!(stdout(&["rigs", path]).contains("controllable  no, rank 2 of 4"));
    let shown = json(path);
    let c = &shown["linearisation"]["upright"]["controllability"];
    assert!(c["condition"].is_null() && c["rank"] == 2, "{c}");
}

#[test]
fn effects_of_a_rig_are_said_to_be_left_out() {
    let folder = Folder::new("rigs-effects");
    let path = folder.file(
        "stiff.toml",
        rig_text(
            "qube-servo-2",
            "[environment]",
            "[effects.\"arm.coulomb\"]\ntorque = 0.01\n\n[environment]",
        ),
    );
    assert!(stdout(&["rigs", path.to_str().expect("UTF-8")]).contains("1 effect(s) left out"));
}

/// `docs/papers.md` repeats the command's tables; where they change, so must it.
#[test]
fn the_documentation_shows_what_the_command_prints() {
    let docs = include_str!("../../../docs/papers.md");
    for paper in PAPERS {
        let text = stdout(&["rigs", paper.rig]);
        let start = text.find("where ").expect("a table");
        let table = text[start..].trim_end();
        assert!(
            docs.contains(table),
            "docs/papers.md does not hold what `furuta rigs {}` prints from its table on; put it there:\n\n{table}",
            paper.rig
        );
    }
}
