//! Something that happened in a stretch of one recording: a motor that was cut off, a hand.

use furuta_ident::diagnose::{Diagnosis, Verdict};
use furuta_ident::recording::Recording;
use furuta_model::Rig;

use crate::common::{RunSetup, diagnosis, names, qube, record, sweep};

/// When the motor is cut off in the second of two recordings, s.
const CUT: f64 = 6.5;

/// Two sweeps of the rig; in the second the motor gets nothing from `CUT` on, and the command goes on in the log.
fn cut_off(rig: &Rig) -> Vec<Recording> {
    let whole = record("whole", rig, RunSetup::default(), sweep(1.5, 0.0));
    let command = sweep(1.5, 1.0);
    let off = |t: f64, x: &_| if t < CUT { command(t, x) } else { 0.0 };
    let mut cut = record("cut", rig, RunSetup::default(), off);
    for (t, u) in cut.t.iter().zip(&mut cut.u) {
        *u = command(*t, &furuta_model::State::hanging());
    }
    vec![whole, cut]
}

fn assert_left_out(found: &Diagnosis, rest: Verdict) {
    assert_eq!(found.verdict, Verdict::Unexplained);
    let stretch = found.left_out.as_ref().expect("left out");
    assert_eq!((stretch.run.as_str(), stretch.rest), ("cut", rest));
    // It begins within a window of a quarter of a second, another is left out before it, and it lasts to the end.
    assert!((CUT - 0.5..CUT).contains(&stretch.from), "{stretch:?}");
    assert!(stretch.to > 9.7, "{stretch:?}");
    let sentence = found.sentence();
    assert!(
        sentence.contains("s of cut something happened"),
        "{sentence}"
    );
    // What is said of the rest is said of a model that is right there.
    let [left, noise] = [found.gap.augmented.theta, found.gap.noise_floor.theta];
    assert!(left < 1.2 * noise, "{left} beside {noise}");
}

/// A sound rig: nothing is named, and the sheet is not drawn to where it was cut off.
#[test]
fn a_motor_that_is_cut_off_is_told() {
    let found = diagnosis(&cut_off(&qube()), &qube());
    assert_left_out(&found, Verdict::NoGap);
    assert!(names(&found).is_empty());
}

/// What is missing is named from the rest.
#[test]
#[ignore = "a minute: make test-long"]
fn what_is_missing_is_named_beside_a_motor_that_is_cut_off() {
    let mut rig = qube();
    rig.effects = vec![furuta_model::Effect::new("arm.coulomb", &[1.5e-3]).expect("valid")];
    let found = diagnosis(&cut_off(&rig), &qube());
    assert_left_out(&found, Verdict::MissingEffects);
    assert_eq!(names(&found), ["arm.coulomb"]);
}
