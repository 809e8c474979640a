//! What breaks a convention is named for what it is, on recordings of two real rigs and of two simulated ones; what is
//! sound is not accused.

use std::f64::consts::TAU;
use std::path::Path;

use super::conventions::{self, Case};
use furuta_model::{Rig, State};
use furuta_recording::{Recording, against_rig};

/// The real rigs of the folder examples, and three hanging runs of 10 s of two built-in ones.
fn cases() -> Vec<Case> {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples");
    let mut cases = conventions::folders(&examples);
    assert_eq!(cases.len(), 2);
    for name in ["fong2014-emecs", "shahzad2022-srv02"] {
        cases.push(simulated(Rig::builtin(name).expect("built in")));
    }
    cases
}

/// A chirp, steps and a decay of a rig of this data sheet, but with the hinge of a good bearing: where the pendulum
/// creeps, it shows neither its frequency nor its signs.
fn simulated(mut rig: Rig) -> Case {
    const PERIOD: f64 = 0.002;
    let c = rig.params.coefficients();
    rig.params.pendulum.viscous = 0.02 * (c.weight * c.pendulum).sqrt();
    let hertz = (c.weight / c.pendulum).sqrt() / TAU;
    let chirp = |t: f64| 0.15 * (TAU * hertz * (0.3 * t + 0.15 * t * t)).sin();
    let levels = [0.9, -0.4, 0.2, -1.0, 0.6, -0.7, 1.0, -0.1];
    let steps = |t: f64| 0.5 * levels[(t / 0.45) as usize % levels.len()];
    let run = |name: &str, from: State<f64>, share: &dyn Fn(f64) -> f64| {
        let plant = rig.plant::<f64>();
        let mut s = plant.rest(from);
        let samples = (0..5000).map(|k| {
            let t = f64::from(k) * PERIOD;
            let u = rig.params.motor.command_limit * share(t);
            let [theta, alpha] = rig.sensors.quantised(plant.measure(&s));
            plant.step(&mut s, u, PERIOD);
            [t, u, theta, alpha]
        });
        let (recording, notices) = Recording::from_samples(name, samples).expect("sound");
        assert!(
            !notices.iter().any(|n| n.kind.is_suspicion()),
            "{}: {notices:?}",
            rig.name
        );
        recording
    };
    let mut lifted = State::hanging();
    lifted.alpha += 0.8;
    let recordings = vec![
        run("chirp", State::hanging(), &chirp),
        run("steps", State::hanging(), &steps),
        run("decay", lifted, &|_| 0.0),
    ];
    Case { rig, recordings }
}

#[test]
fn every_mistake_is_named() {
    conventions::every_mistake_is_named(&cases());
}

#[test]
fn a_gear_left_out_is_named() {
    conventions::a_gear_left_out_is_named(&cases());
}

/// The QUBE's motor lags by a row.
#[test]
fn late_columns_are_named() {
    let cases = cases();
    let [command, theta, alpha] = conventions::late_columns_are_named(&cases);
    assert_eq!(command, ["fong2014-emecs", "shahzad2022-srv02"]);
    assert_eq!(
        theta,
        ["qube-servo-2", "fong2014-emecs", "shahzad2022-srv02"]
    );
    assert_eq!(alpha, theta);
}

/// One program writes all recordings: what one shows is said of those that do not show otherwise.
#[test]
fn a_late_column_in_one_recording_is_one_in_all() {
    let case = simulated(Rig::builtin("shahzad2022-srv02").expect("built in"));
    let late = |recording: &Recording| {
        let mut late = recording.clone();
        late.u.rotate_right(1);
        late
    };
    // The decay has no command, and shows nothing of one.
    let [chirp, steps, decay] = [0, 1, 2].map(|i| &case.recordings[i]);
    let said = |recordings: &[Recording]| -> Vec<String> {
        let notices = against_rig(recordings, &case.rig);
        notices.iter().map(ToString::to_string).collect()
    };
    let all = said(&[late(decay), late(chirp), late(steps)]);
    assert_eq!(all.len(), 3, "{all:?}");
    let what = "decay: the arm answers 1.0 rows before u is written";
    assert!(all[0].starts_with(what), "{all:?}");
    assert!(
        all[0].ends_with("(so chirp shows, and this recording does not show otherwise)"),
        "{all:?}"
    );
    // Where another is right, it is one odd recording.
    let one = said(&[decay.clone(), late(chirp), steps.clone()]);
    assert_eq!(one.len(), 1, "{one:?}");
    assert!(one[0].starts_with("chirp"), "{one:?}");
}

/// What is said of a command in another unit, and of a gear that the rig file lacks.
#[test]
fn a_gain_that_is_far_off_is_explained() {
    let case = simulated(Rig::builtin("shahzad2022-srv02").expect("built in"));
    let limit = case.rig.params.motor.command_limit;
    let said = |rig: &Rig, per_unit: f64| -> String {
        let mut chirp = case.recordings[0].clone();
        for u in &mut chirp.u {
            *u /= per_unit;
        }
        let notices = against_rig(&[chirp], rig);
        notices.iter().map(ToString::to_string).collect()
    };
    let shares = said(&case.rig, limit);
    assert!(shares.contains("10 times as hard"), "{shares}");
    assert!(
        shares.contains("in shares of the limit; V are required: multiply by 10"),
        "{shares}"
    );
    // Below the limit, so that its size says nothing.
    let per_cent = said(&case.rig, limit / 100.0 * 2.0);
    assert!(per_cent.contains("0.20 times as hard"), "{per_cent}");
    let mut direct = case.rig.clone();
    direct.params.motor.torque_constant /= 70.0;
    direct.params.motor.back_emf_constant /= 70.0;
    let gear = said(&direct, 1.0);
    assert!(
        gear.contains("70 times as hard") && gear.contains("a gear looks left out"),
        "{gear}"
    );
}

#[test]
fn sound_recordings_are_not_accused() {
    conventions::sound_recordings_are_not_accused(&cases());
}

/// Counts lost at a moment are an effect, and no sign of another rig.
#[test]
fn lost_counts_are_no_other_rig() {
    conventions::lost_counts_are_no_other_rig(&cases());
}

#[test]
fn recordings_of_two_rigs_are_told_apart() {
    assert!(conventions::rigs_are_told_apart(&cases()) > 0);
}

#[test]
fn a_clipped_encoder_is_named() {
    conventions::a_clipped_encoder_is_named(&cases());
}
