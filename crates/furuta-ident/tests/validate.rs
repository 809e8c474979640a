//! Validation: a right model passes, a wrong one does not, and bad input is named.

use crate::common;

use common::{RunSetup, qube, record, sweep};
use furuta_ident::Insufficient;
use furuta_ident::validate::{Validated, Validation, validate};
use furuta_model::State;

#[test]
fn the_right_model_passes_and_a_wrong_one_does_not() {
    let real = qube();
    // Noise above the count, so that rounding is white.
    let run = RunSetup {
        noise: 3e-3,
        ..RunSetup::default()
    };
    let recording = record("a.csv", &real, run, sweep(2.0, 0.0));
    let right = validate(std::slice::from_ref(&recording), &real).expect("a good recording");
    for c in &right.channels {
        assert!(c.simulated && c.fit_percent > 98.0, "{c:?}");
        assert!(
            (c.rms / c.noise_floor - 1.0).abs() < 0.1,
            "{} {}",
            c.rms,
            c.noise_floor
        );
        // A lag in a hundred may be outside: of 25, at most two in 998 of 1000 cases.
        assert!(
            c.whiteness.outside <= 2 && c.whiteness.p_value > 1e-3,
            "{:?}",
            c.whiteness
        );
        assert!(c.cross.outside <= 2, "{:?}", c.cross);
    }
    let mut wrong = real.clone();
    wrong.params.arm.inertia *= 1.3;
    let judged = validate(&[recording], &wrong).expect("a good recording");
    for (good, bad) in right.channels.iter().zip(&judged.channels) {
        assert!(
            bad.fit_percent < good.fit_percent - 1.0,
            "{}",
            bad.fit_percent
        );
        assert!(bad.whiteness.outside == 25 && bad.whiteness.p_value < 1e-6);
        // A few samples do not tell; after half a second the wrong inertia shows.
        let after = |v: &Validated, i: usize| v.steps[i].rms;
        assert!(after(bad, 3) > 2.0 * after(good, 3));
    }
    let again = Validation::from_json(&judged.to_json()).expect("its own JSON");
    assert_eq!(again.to_json(), judged.to_json());
    assert!(judged.summary().contains("25 of 25 outside, p < 0.01"));
}

#[test]
fn upright_is_predicted_in_pieces() {
    let real = qube();
    let gain = [-2.5, 41.4, -1.636, 2.421];
    let run = RunSetup {
        seconds: 5.0,
        start: State::new(0.0, 0.02, 0.0, 0.0),
        ..RunSetup::default()
    };
    let recording = record("up.csv", &real, run, |t, x| {
        let x = x.to_array();
        (0..4).map(|i| -gain[i] * x[i]).sum::<f64>() + 0.5 * (5.0 * t).sin()
    });
    let v = validate(&[recording], &real).expect("a good recording");
    assert!(v.channels.iter().all(|c| !c.simulated));
    assert!(v.notices[0].contains("comes near upright"));
    assert!(v.channels[0].steps.iter().all(|s| s.seconds <= 0.5));
}

#[test]
fn what_cannot_be_judged_is_named() {
    let real = qube();
    let still = record("still.csv", &real, RunSetup::default(), |_, _| 0.0);
    assert!(matches!(
        validate(&[], &real),
        Err(Insufficient::NoRecordings)
    ));
    assert!(matches!(
        validate(&[still], &real),
        Err(Insufficient::NothingMoves { .. })
    ));
}
