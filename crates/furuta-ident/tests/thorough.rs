//! What saves time decides nothing: a search that follows every candidate to the end says the same.

use crate::common;

use common::{RunSetup, names, qube, record, sweep};
use furuta_ident::diagnose::{Diagnosis, Options, Request, diagnose_with};
use furuta_ident::recording::Recording;
use furuta_model::{Effect, Rig};

/// Effects that are hidden together.
const CASES: [&[(&str, &[f64])]; 4] = [
    &[],
    &[("arm.spring", &[2e-3, 0.2])],
    &[("motor.deadzone", &[0.3])],
    &[("arm.cogging", &[1e-3, 8.0, 0.3])],
];

fn said(recordings: &[Recording], thorough: bool) -> Diagnosis {
    let request = Request {
        recordings,
        rig: &qube(),
        verify: &[],
    };
    let options = Options {
        thorough,
        ..Options::default()
    };
    let outcome = diagnose_with(&request, options, &|_| ());
    outcome.expect("good recordings").diagnosis
}

/// Two at a time, which takes a thorough search minutes.
const PAIRS: [&[(&str, &[f64])]; 2] = [
    &[("arm.coulomb", &[2.5e-3]), ("motor.bias", &[0.15])],
    &[
        ("arm.spring", &[2e-3, 0.2]),
        ("pendulum.quadratic", &[4e-6]),
    ],
];

#[test]
fn a_thorough_search_says_the_same() {
    compare(&CASES);
}

/// Every candidate of a pair is followed to the end from every start, which takes minutes.
#[test]
#[ignore = "minutes: make test-long"]
fn a_thorough_search_says_the_same_of_pairs() {
    compare(&PAIRS);
}

fn compare(cases: &[&[(&str, &[f64])]]) {
    for hidden in cases {
        let effects = hidden
            .iter()
            .map(|(id, values)| Effect::new(id, values).expect("valid"))
            .collect();
        let rig = Rig { effects, ..qube() };
        let run = RunSetup {
            seconds: 6.0,
            ..RunSetup::default()
        };
        let recordings = [(1.5, 0.0), (2.5, 1.0)]
            .map(|(volts, phase)| record("run.csv", &rig, run, sweep(volts, phase)));
        let (usual, thorough) = (said(&recordings, false), said(&recordings, true));
        assert_eq!(names(&usual), names(&thorough), "{hidden:?}");
        assert_eq!(usual.verdict, thorough.verdict, "{hidden:?}");
    }
}
