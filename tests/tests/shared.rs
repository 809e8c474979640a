//! What lies beside the project on some machines: cases in which MuJoCo hid an effect, recordings of further real rigs,
//! and the list of effects that was asked for.
//!
//! None of it is part of the project; where it is absent, the tests say so and pass.

#[path = "../../crates/furuta-recording/tests/recordings/conventions.rs"]
mod conventions;

use std::path::{Path, PathBuf};

use furuta_ident::diagnose::{Diagnosis, Request, Verdict, diagnose};
use furuta_ident::recording::Recording;
use furuta_model::{CATALOGUE, Rig, effects};

fn shared(what: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../shared")
        .join(what);
    if path.exists() {
        return Some(path);
    }
    eprintln!("skipped: {} is not there", path.display());
    None
}

fn answer(folder: &Path, names: &[&str]) -> Diagnosis {
    let rig = Rig::load(&folder.join("rig.toml").to_string_lossy()).expect("a valid rig file");
    let load = |name: &&str| {
        Recording::load(folder.join(format!("{name}.csv"))).expect("a readable recording")
    };
    let recordings: Vec<_> = names.iter().map(load).collect();
    let request = Request {
        recordings: &recordings,
        rig: &rig,
        verify: &[],
    };
    diagnose(&request, &|_| ())
        .expect("good recordings")
        .diagnosis
}

#[test]
fn clean_and_foreign_cases_are_not_accused() {
    let Some(cases) = shared("blind/dev") else {
        return;
    };
    let runs = ["run-0-multisine", "run-1-steps", "run-2-balance"];
    for clean in ["dev-013", "dev-025"] {
        let d = answer(&cases.join(clean), &runs);
        assert_eq!(d.verdict, Verdict::ParametersOnly, "{clean}");
        assert!(d.effects.is_empty(), "{clean}");
    }
    // An effect outside the catalogue is said to be one.
    let d = answer(&cases.join("dev-006"), &runs);
    assert_eq!(d.verdict, Verdict::Unexplained);
}

/// The list that the project was asked for names nothing that is not here, and no parameter.
#[test]
fn the_catalogue_beside_the_project_is_covered() {
    let Some(path) = shared("design/effects.md") else {
        return;
    };
    let text = std::fs::read_to_string(path).expect("readable");
    let mut found = 0;
    for row in text.lines().filter(|l| l.starts_with("| `")) {
        let cells: Vec<_> = row.split('|').map(str::trim).collect();
        let id = cells[1].trim_matches('`');
        let spec = effects::spec(id).unwrap_or_else(|| panic!("{id} is not in the catalogue"));
        for name in cells[2].split(',') {
            // `rest = pi` states a default.
            let name = name.split('=').next().unwrap_or_default().trim();
            assert!(
                spec.parameters.iter().any(|p| p.name == name),
                "{} has no {name}",
                spec.id
            );
        }
        found += 1;
    }
    // The ripple of the motor was added for a real rig.
    assert!(
        found >= CATALOGUE.len() - 1,
        "only {found} rows are effects"
    );
}

/// The checks of `crates/furuta-ident/tests/bad_input.rs`, on real rigs and on those of another simulator.
#[test]
fn conventions_are_checked_on_every_rig() {
    let mut cases = Vec::new();
    for part in ["real", "blind/dev"] {
        let Some(folder) = shared(part) else {
            return;
        };
        cases.extend(conventions::folders(&folder));
    }
    conventions::every_mistake_is_named(&cases);
    conventions::a_gear_left_out_is_named(&cases);
    conventions::sound_recordings_are_not_accused(&cases);
    conventions::late_columns_are_named(&cases);
    conventions::rigs_are_told_apart(&cases);
    conventions::a_clipped_encoder_is_named(&cases);
}

/// The clock of a rig with a stepper motor jitters by half a period: its time stamps are used as they are.
#[test]
fn a_jittering_clock_is_used_as_it_is() {
    let Some(folder) = shared("real/stepper-kit") else {
        return;
    };
    for run in ["run-0-swingup.csv", "run-1-swingup.csv"] {
        assert!(
            Recording::load(folder.join(run)).unwrap().is_uneven(),
            "{run}"
        );
    }
}
