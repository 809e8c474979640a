//! What every laboratory's recordings have and no effect is: a ruler's arm length, another zero of theta in each file.

use crate::common;

use common::{RunSetup, diagnosis, names, qube, record, sweep};
use furuta_ident::diagnose::Verdict;
use furuta_ident::diagnose::result::Against;
use furuta_ident::recording::Recording;
use furuta_ident::selection::select;
use furuta_ident::validate::{self, validate_with};
use furuta_ident::{Pendulum, calibrate};
use furuta_model::{Effect, Rig, State};

/// A sweep by an encoder that was zeroed `offset` (rad) elsewhere.
fn sweep_from(rig: &Rig, name: &str, (amplitude, phase): (f64, f64), offset: f64) -> Recording {
    let sweep = sweep(amplitude, phase);
    let mut recording = record(name, rig, RunSetup::default(), |t, x| {
        sweep(t, x) - 0.2 * x.theta
    });
    let [offset, _] = rig.sensors.quantised([offset, 0.0]);
    for theta in &mut recording.theta {
        *theta += offset;
    }
    recording
}

/// Two sweeps, the second by an encoder that was zeroed `offset` (rad) elsewhere.
fn sweeps(rig: &Rig, offset: f64) -> [Recording; 2] {
    let first = sweep_from(rig, "a.csv", (2.0, 0.0), 0.0);
    [first, sweep_from(rig, "b.csv", (3.0, 2.0), offset)]
}

/// Of three recordings one may be of another rig (or its encoder lost counts): the two that agree are used. Of two,
/// which is the odd one cannot be known.
#[test]
fn the_odd_one_of_three_recordings_is_left_out() {
    let mut other = qube();
    // Its pendulum swings at 1.3 times the frequency.
    other.params.gravity *= 1.7;
    let ([a, b], [odd, _]) = (sweeps(&qube(), 0.7), sweeps(&other, 0.0));
    let odd = Recording {
        name: "odd.csv".into(),
        ..odd
    };
    let chosen = |recordings: &[&Recording]| {
        let read = recordings.iter().map(|r| ((*r).clone(), Vec::new()));
        select(read.collect(), Vec::new(), &qube(), false, Pendulum::Swings)
    };
    for order in [[&odd, &a, &b], [&a, &odd, &b], [&a, &b, &odd]] {
        let selection = chosen(&order).expect("two agree");
        let used: Vec<&str> = (selection.recordings.iter())
            .map(|r| r.name.as_str())
            .collect();
        assert_eq!(used, ["a.csv", "b.csv"]);
        let [left] = selection.notices.as_slice() else {
            panic!("{:?}", selection.notices);
        };
        assert_eq!(left.file, "odd.csv");
        let said = left.to_string();
        assert!(said.contains("another rig than"), "{said}");
    }
    let refused = chosen(&[&a, &odd]).expect_err("none has most on its side");
    let said = refused.to_string();
    assert!(said.contains("odd.csv") && said.contains("a.csv"), "{said}");
}

/// An arm that is 2 % too long in the sheet was taken for a spring on the pendulum, or for the scale of the arm's
/// encoder.
#[test]
fn a_ruler_accuses_no_rig() {
    let rig = qube();
    let mut sheet = qube();
    sheet.params.arm.length *= 1.02;
    let found = diagnosis(&sweeps(&rig, 0.7), &sheet);
    assert_eq!(names(&found), [""; 0]);
    assert_eq!(found.verdict, Verdict::ParametersOnly);
    let length = &found.parameters["arm.length"];
    assert!(
        (length.fitted / rig.params.arm.length - 1.0).abs() < 2e-3,
        "{length:?}"
    );
}

/// A spring that pulls to one angle, of which each recording counts from elsewhere, was taken for presliding friction
/// and an offset of the voltage.
#[test]
fn a_spring_is_named_though_each_recording_has_a_zero_of_its_own() {
    let mut rig = qube();
    rig.effects = vec![Effect::new("arm.spring", &[2.5e-3, 0.1]).expect("valid")];
    let found = diagnosis(&sweeps(&rig, 1.0), &qube());
    assert_eq!(names(&found), ["arm.spring"]);
    assert_eq!(found.verdict, Verdict::MissingEffects);
    let spring = &found.effects[0].parameters;
    assert!(
        (spring["stiffness"].value / 2.5e-3 - 1.0).abs() < 0.02,
        "{spring:?}"
    );
    assert!((spring["rest"].value - 0.1).abs() < 0.02, "{spring:?}");
    assert!(
        (found.zeros[1].theta + 1.0).abs() < 0.02,
        "{:?}",
        found.zeros
    );
}

/// What repeats with the arm's angle is alike at several zeros of an encoder, of which one is right: each place in the
/// turn is tried, in a recording that is only predicted as in those that are fitted.
#[test]
fn the_right_one_of_several_zeros_is_found() {
    let mut rig = qube();
    rig.effects = vec![Effect::new("arm.cogging", &[2e-3, 3.0, 0.4]).expect("valid")];
    for offset in [-2.6, -1.0, 0.5, 1.0, 1.6] {
        let judged = validate::validate(&sweeps(&rig, offset), &rig).expect("sound");
        let fits = judged.channels.iter().map(|c| c.fit_percent);
        let worst = fits.fold(f64::INFINITY, f64::min);
        assert!(worst > 99.0, "{offset}: {worst}");
    }

    let mut rig = qube();
    rig.effects = vec![Effect::new("sensor.theta.eccentricity", &[0.17, 0.8]).expect("valid")];
    let [first, second] = sweeps(&rig, -2.4);
    let third = sweep_from(&rig, "c.csv", (1.0, 1.0), 1.9);
    let found = diagnosis(&[first, second, third], &qube());
    assert_eq!(names(&found), ["sensor.theta.eccentricity"]);
    assert_eq!(found.verdict, Verdict::MissingEffects);
    for (zero, offset) in found.zeros.iter().zip([0.0, -2.4, 1.9]) {
        assert!((zero.theta + offset).abs() < 0.02, "{:?}", found.zeros);
    }
}

/// A rig file that says at which angle of the arm its effects act, as a repaired one does, is right wherever the
/// encoders were zeroed that day, the first recording's too.
#[test]
fn a_rig_file_that_knows_the_angle_is_sound_wherever_encoders_were_zeroed() {
    for (id, values) in [
        ("arm.spring", &[2.5e-3, 0.1][..]),
        ("arm.cogging", &[2e-3, 3.0, 0.4]),
    ] {
        let mut rig = qube();
        rig.effects = vec![Effect::new(id, values).expect("valid")];
        let first = sweep_from(&rig, "a.csv", (2.0, 0.0), -0.45);
        let second = sweep_from(&rig, "b.csv", (3.0, 2.0), 1.0);
        let found = diagnosis(&[first, second], &rig);
        assert_eq!((names(&found), found.verdict), (vec![], Verdict::NoGap));
        for zero in &found.zeros {
            assert_eq!(zero.against, Against::RigFile);
        }
        if id == "arm.spring" {
            let [a, b] = [0, 1].map(|i| found.zeros[i].theta);
            assert!((a - 0.45).abs() < 0.01 && (b + 1.0).abs() < 0.01, "{a} {b}");
        }
    }
}

/// An angle of rest is counted from the rig's zero where another effect, which stays as it is, says where that is.
#[test]
fn an_angle_of_rest_is_counted_from_where_the_rig_file_says() {
    let mut rig = qube();
    let spring = |rest| Effect::new("arm.spring", &[2.5e-3, rest]).expect("valid");
    let cogging = Effect::new("arm.cogging", &[2e-3, 3.0, 0.4]).expect("valid");
    rig.effects = vec![spring(0.1), cogging];
    let first = sweep_from(&rig, "a.csv", (2.0, 0.0), -0.45);
    let second = sweep_from(&rig, "b.csv", (3.0, 2.0), 1.0);
    let mut sheet = rig.clone();
    sheet.effects = vec![spring(0.0), cogging];
    let options = calibrate::Options {
        free: vec!["arm.spring.rest".into()],
        ..calibrate::Options::default()
    };
    let outcome = calibrate::calibrate(&[first, second], &sheet, &options).expect("sound");
    let rest = &outcome.calibration.parameters["arm.spring.rest"];
    assert!((rest.fitted - 0.1).abs() < 4.0 * rest.std, "{rest:?}");
}

/// Where a spring depends on the arm's angle, a recording is predicted from the zero found in it. Said to be the rig's,
/// the zero is not looked for: an encoder that was zeroed elsewhere shows, and the angle of rest is known from all
/// recordings alike.
#[test]
fn recordings_said_to_count_from_the_rigs_zeros_do() {
    let mut rig = qube();
    rig.effects = vec![Effect::new("arm.spring", &[2.5e-3, 0.1]).expect("valid")];
    let told = |same_zero| validate::Options {
        same_zero,
        ..validate::Options::default()
    };
    let worst = |recordings: &[Recording], same_zero| {
        let judged = validate_with(recordings, &rig, told(same_zero)).expect("sound");
        let fits = judged.channels.iter().map(|c| c.fit_percent);
        fits.fold(f64::INFINITY, f64::min)
    };
    let shifted = sweeps(&rig, 1.0);
    assert!(worst(&shifted, false) > 99.0);
    assert!(worst(&shifted, true) < 50.0);
    let sound = sweeps(&rig, 0.0);
    assert!(worst(&sound, true) > 99.0);

    let mut sheet = rig.clone();
    sheet.effects = vec![Effect::new("arm.spring", &[3e-3, 0.0]).expect("valid")];
    let rest = |recordings: &[Recording], same_zero| {
        let options = calibrate::Options {
            free: vec!["arm.spring.stiffness".into(), "arm.spring.rest".into()],
            same_zero,
            ..calibrate::Options::default()
        };
        let outcome = calibrate::calibrate(recordings, &sheet, &options).expect("sound");
        let rest = &outcome.calibration.parameters["arm.spring.rest"];
        (rest.fitted, rest.std)
    };
    let (own, own_std) = rest(&sound, false);
    let (same, same_std) = rest(&sound, true);
    assert!((own - 0.1).abs() < 4.0 * own_std, "{own} {own_std}");
    assert!((same - 0.1).abs() < 4.0 * same_std, "{same} {same_std}");
    // Two recordings tell of it in place of one.
    assert!(same_std < 0.9 * own_std, "{same_std} {own_std}");
    // Half of it is what a wrong word makes of the second recording's zero.
    let (wrong, _) = rest(&shifted, true);
    assert!((wrong - 0.1).abs() > 0.1, "{wrong}");
}

/// A rig that is balanced by hand-made state feedback while its arm goes to and fro once in 2 s: all that many
/// laboratories record. Every sample is read in counts, `noise` counts beside.
fn balanced(rig: &Rig, noise: f64, seed: u64) -> Recording {
    let [count, _] = rig.sensors.resolution();
    let setup = RunSetup {
        start: State::new(0.0, 0.02, 0.0, 0.0),
        noise: noise * count,
        seed,
        ..RunSetup::default()
    };
    record("balanced.csv", rig, setup, |t, x| {
        let asked = if t % 2.0 < 1.0 { 0.3 } else { -0.3 };
        let error = x.theta - asked;
        (2.0 * error - 35.0 * x.alpha + 1.5 * x.theta_dot - 3.0 * x.alpha_dot).clamp(-10.0, 10.0)
    })
}

/// In slow motion a reading is farthest from the true angle when it steps, and its noise cannot be taken from how it
/// leaves a smooth curve from sample to sample; and near upright an error at a window's start grows a hundredfold.
#[test]
fn a_sound_rig_that_is_only_balanced_lacks_nothing() {
    let rig = qube();
    for (noise, seed) in [(0.0, 0), (0.3, 1), (0.3, 2)] {
        let found = diagnosis(&[balanced(&rig, noise, seed)], &rig);
        assert!(
            matches!(found.verdict, Verdict::NoGap | Verdict::ParametersOnly),
            "{noise} {seed}: {:?} {:?}",
            found.verdict,
            names(&found)
        );
        // Rounding and noise together, in counts.
        let [count, _] = rig.sensors.resolution();
        let true_noise = count * (1.0_f64 / 12.0 + noise * noise).sqrt();
        let floor = found.gap.noise_floor;
        for (what, error) in [
            ("theta's noise", floor.theta),
            ("alpha's noise", floor.alpha),
            ("theta as given", found.gap.nominal.theta),
            ("alpha as given", found.gap.nominal.alpha),
        ] {
            let share = error / true_noise;
            assert!(
                (0.85..1.15).contains(&share),
                "{noise} {seed}: {what} {share}"
            );
        }
    }
}

/// A log whose angles went through a moving average is not what the rig did, and no blow on the rig did it.
#[test]
fn smoothed_angles_name_no_kick() {
    let rig = qube();
    let [count, _] = rig.sensors.resolution();
    let smoothed = |seed: u64| {
        let setup = RunSetup {
            seconds: 8.0,
            noise: 0.2 * count,
            seed,
            ..RunSetup::default()
        };
        let sweep = sweep(2.0, seed as f64);
        let mut recording = record(&format!("{seed}.csv"), &rig, setup, |t, x| sweep(t, x));
        for angles in [&mut recording.theta, &mut recording.alpha] {
            let raw = angles.clone();
            for (k, angle) in angles.iter_mut().enumerate() {
                let half = 5.min(k).min(raw.len() - 1 - k);
                let around = &raw[k - half..=k + half];
                *angle = around.iter().sum::<f64>() / around.len() as f64;
            }
        }
        recording
    };
    for seed in 0..6 {
        let found = diagnosis(&[smoothed(2 * seed), smoothed(2 * seed + 1)], &rig);
        let kicks = names(&found).into_iter().filter(|id| id.contains("kick"));
        assert_eq!(kicks.count(), 0, "{seed}: {:?}", found.effects);
    }
}

/// Angles averaged over the last five samples are late: a delay explains them and was named, at 500 Hz a flexible
/// drive.
/// From counts a delay is named.
#[test]
fn averaged_angles_accuse_no_drive() {
    let mean = |angle: &[f64]| -> Vec<f64> {
        let of = |k: usize| {
            let last = &angle[k.saturating_sub(4)..=k];
            last.iter().sum::<f64>() / last.len() as f64
        };
        (0..angle.len()).map(of).collect()
    };
    let averaged = sweeps(&qube(), 0.7).map(|r| Recording {
        theta: mean(&r.theta),
        alpha: mean(&r.alpha),
        ..r
    });
    let found = diagnosis(&averaged, &qube());
    println!("{:?} {:?}", names(&found), found.suspected);
    assert!(names(&found).is_empty(), "{:?}", names(&found));
    assert_eq!(found.verdict, Verdict::Unexplained);
    assert!(
        (found.notices.iter()).any(|n| n.contains("theta and alpha do not step by the counts")),
        "{:?}",
        found.notices
    );
    let mut late = qube();
    late.effects = vec![Effect::new("motor.delay", &[0.004]).expect("valid")];
    let found = diagnosis(&sweeps(&late, 0.7), &qube());
    assert_eq!(names(&found), ["motor.delay"]);
    assert!(found.notices.is_empty(), "{:?}", found.notices);
}
