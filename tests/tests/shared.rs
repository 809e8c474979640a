//! Diagnosis of recordings that lie beside the project: a real QUBE-Servo 2, and cases in which MuJoCo hid an effect.
//!
//! They are not part of the project; where they are absent, the tests say so and pass.

use std::path::{Path, PathBuf};

use furuta_ident::diagnose::{Diagnosis, Request, Verdict, diagnose};
use furuta_ident::recording::Recording;
use furuta_model::Rig;

fn shared(what: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../shared")
        .join(what);
    if path.is_dir() {
        return Some(path);
    }
    eprintln!("skipped: {} is not there", path.display());
    None
}

fn load(folder: &Path, names: &[&str]) -> Vec<Recording> {
    names
        .iter()
        .map(|name| {
            Recording::load(folder.join(format!("{name}.csv"))).expect("a readable recording")
        })
        .collect()
}

fn answer(folder: &Path, seen: &[&str], unseen: &[&str]) -> Diagnosis {
    let rig = Rig::load(&folder.join("rig.toml").to_string_lossy()).expect("a valid rig file");
    let (recordings, verify) = (load(folder, seen), load(folder, unseen));
    let request = Request {
        recordings: &recordings,
        rig: &rig,
        verify: &verify,
    };
    diagnose(&request, &|_| ())
        .expect("good recordings")
        .diagnosis
}

/// What pulls the arm of the real rig back is named, and the repaired model predicts chirps it has not seen over their whole ten seconds, open
/// loop: about 0.36 rad with refitted parameters, 0.06 rad or less with what was named (the rig's own repeats agree to 0.006).
#[test]
fn the_real_qubes_cable_is_found() {
    let Some(folder) = shared("real/qube-servo-2") else {
        return;
    };
    let d = answer(
        &folder,
        &["chirp-plus-1", "chirp-minus-1"],
        &["chirp-plus-5", "chirp-minus-5"],
    );
    assert!(
        d.effects
            .iter()
            .any(|e| e.id == "arm.spring" || e.id == "arm.cable"),
        "{}",
        d.to_json()
    );
    let arm: Vec<_> = d
        .verification
        .iter()
        .filter(|row| row.channel.part() == "arm")
        .collect();
    assert_eq!(arm.len(), 2);
    for row in arm {
        assert!(row.repaired <= 0.06 && row.recalibrated > 0.25, "{row:?}");
    }
}

#[test]
fn clean_and_foreign_cases_are_not_accused() {
    let Some(cases) = shared("blind/dev") else {
        return;
    };
    let runs = ["run-0-multisine", "run-1-steps", "run-2-balance"];
    for clean in ["dev-013", "dev-025"] {
        let d = answer(&cases.join(clean), &runs, &[]);
        assert_eq!(d.verdict, Verdict::ParametersOnly, "{clean}");
        assert!(d.effects.is_empty(), "{clean}");
    }
    // An effect outside the catalogue is said to be one.
    let d = answer(&cases.join("dev-006"), &runs, &[]);
    assert_eq!(d.verdict, Verdict::Unexplained);
}
