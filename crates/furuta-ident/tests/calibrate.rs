//! Calibration: what it finds, how sure it is, what it refuses.

use crate::common;

use common::{RunSetup, qube, record, sweep};
use furuta_ident::calibrate::result::Why;
use furuta_ident::calibrate::{CalibrateError, Calibration, Options, calibrate};
use furuta_ident::recording::Recording;
use furuta_ident::{Insufficient, Pendulum};
use furuta_model::{Effect, Rig, State};

/// The sheet that is off by these factors.
fn off(real: &Rig, factors: &[(&str, f64)]) -> Rig {
    let mut rig = real.clone();
    for (key, factor) in factors {
        let p = &mut rig.params;
        match *key {
            "arm.inertia" => p.arm.inertia *= factor,
            "arm.viscous" => p.arm.viscous *= factor,
            "arm.length" => p.arm.length *= factor,
            "pendulum.inertia" => {
                p.pendulum.inertia *= factor;
                p.pendulum.inertia_transverse *= factor;
            }
            "pendulum.viscous" => p.pendulum.viscous *= factor,
            "motor.torque_constant" => p.motor.torque_constant *= factor,
            _ => panic!("{key}"),
        }
    }
    rig
}

#[test]
fn a_sheet_that_is_twice_off_is_mended() {
    let real = qube();
    let sheet = off(
        &real,
        &[
            ("arm.inertia", 2.0),
            ("arm.viscous", 0.5),
            ("pendulum.inertia", 0.5),
            ("pendulum.viscous", 2.0),
            ("motor.torque_constant", 0.5),
        ],
    );
    let recordings = [
        record("a.csv", &real, RunSetup::default(), sweep(3.0, 0.0)),
        record(
            "b.csv",
            &real,
            RunSetup {
                seed: 1,
                ..RunSetup::default()
            },
            sweep(2.0, 1.5),
        ),
    ];
    let outcome = calibrate(&recordings, &sheet, &Options::default()).expect("good recordings");
    let c = &outcome.calibration;
    for (key, truth) in [
        ("arm.inertia", real.params.arm.inertia),
        ("pendulum.inertia", real.params.pendulum.inertia),
        ("motor.torque_constant", real.params.motor.torque_constant),
        ("pendulum.viscous", real.params.pendulum.viscous),
    ] {
        let p = &c.parameters[key];
        assert!(p.identifiable, "{key}");
        // Five of these intervals of 95 % are looked at: four standard deviations either way.
        assert!(
            (p.fitted - truth).abs() < 4.0 * p.std,
            "{key}: {} ± {} for {truth}",
            p.fitted,
            p.std
        );
        assert!(p.std < 0.05 * truth, "{key}: {} of {truth}", p.std);
    }
    assert!(c.chi < 1.1, "{}", c.chi);
    assert!(c.fit.iter().all(|f| f.fit_percent > 95.0));
}

#[test]
fn what_shows_only_together_is_said() {
    let real = qube();
    let recordings = [record("a.csv", &real, RunSetup::default(), sweep(3.0, 0.0))];
    let c = calibrate(&recordings, &real, &Options::default())
        .expect("a good recording")
        .calibration;
    // All seven ratios show, but a slender rod has no inertia about its axis, and that across follows.
    assert_eq!(c.identifiability.rank, 7, "{}", c.identifiability_text());
    assert_eq!(c.fitted.len(), 6);
    let held = |key: &str| {
        c.identifiability
            .held
            .iter()
            .find(|h| h.key == key)
            .unwrap_or_else(|| panic!("{key} is held"))
    };
    let resistance = held("motor.resistance");
    assert_eq!(resistance.why, Why::OnlyTogether);
    // The gain is k_t/R, the back-EMF's damping k_t k_b/R.
    assert_eq!(
        resistance.sentence,
        "motor.resistance and motor.torque_constant: only their ratio shows"
    );
    assert_eq!(
        held("motor.efficiency").sentence,
        "motor.efficiency and motor.torque_constant: only their product shows"
    );
    assert!(
        held("pendulum.mass")
            .sentence
            .starts_with("1 % more pendulum.mass looks like")
    );
    // The JSON is what it was.
    let again = Calibration::from_json(&c.to_json()).expect("its own JSON");
    assert_eq!(again.fitted, c.fitted);
    assert_eq!(again.to_json(), c.to_json());
}

#[test]
fn recordings_of_different_rates_hanging_and_upright() {
    let real = qube();
    let gain = [-2.5, 41.4, -1.636, 2.421];
    let balance = |t: f64, x: &State<f64>| {
        let wish = 0.3 * (2.0 * t).sin() + 0.2 * (9.0 * t).sin();
        let x = x.to_array();
        let u: f64 = (0..4).map(|i| -gain[i] * x[i]).sum();
        (u + 3.0 * wish).clamp(-10.0, 10.0)
    };
    let upright = RunSetup {
        rate: 1000.0,
        seconds: 6.0,
        start: State::new(0.0, 0.02, 0.0, 0.0),
        ..RunSetup::default()
    };
    let recordings = [
        record(
            "hanging.csv",
            &real,
            RunSetup {
                rate: 250.0,
                ..RunSetup::default()
            },
            sweep(2.0, 0.0),
        ),
        record("upright.csv", &real, upright, balance),
    ];
    assert!(
        recordings[1].alpha.iter().all(|a| a.abs() < 1.0),
        "it balances"
    );
    let sheet = off(
        &real,
        &[
            ("arm.inertia", 1.2),
            ("pendulum.inertia", 0.8),
            ("motor.torque_constant", 0.8),
        ],
    );
    let c = calibrate(&recordings, &sheet, &Options::default())
        .expect("good recordings")
        .calibration;
    for (key, truth) in [
        ("arm.inertia", real.params.arm.inertia),
        ("pendulum.inertia", real.params.pendulum.inertia),
        ("motor.torque_constant", real.params.motor.torque_constant),
    ] {
        let p = &c.parameters[key];
        assert!(
            (p.fitted - truth).abs() < 4.0 * p.std,
            "{key}: {} ± {} for {truth}",
            p.fitted,
            p.std
        );
    }
    assert_eq!(c.fit.len(), 4);
    assert!(c.chi < 1.1, "{}", c.chi);
}

#[test]
fn effects_of_the_rig_file_can_be_calibrated() {
    let mut real = qube();
    real.effects
        .push(Effect::new("arm.coulomb", &[6e-4]).expect("valid"));
    real.effects
        .push(Effect::new("motor.delay", &[0.003]).expect("valid"));
    let mut sheet = real.clone();
    sheet.effects = vec![
        Effect::new("arm.coulomb", &[9e-4]).expect("valid"),
        Effect::new("motor.delay", &[0.002]).expect("valid"),
    ];
    let recordings = [
        record("a.csv", &real, RunSetup::default(), sweep(2.0, 0.0)),
        record(
            "b.csv",
            &real,
            RunSetup {
                seed: 1,
                ..RunSetup::default()
            },
            |t, _| 1.2 * (3.0 * t).sin(),
        ),
    ];
    let outcome = calibrate(&recordings, &sheet, &Options::default()).expect("good recordings");
    let c = &outcome.calibration;
    for (key, truth) in [("arm.coulomb.torque", 6e-4), ("motor.delay.delay", 0.003)] {
        let p = &c.parameters[key];
        assert!(p.identifiable, "{key}: {}", c.summary());
        assert!(
            (p.fitted - truth).abs() < 4.0 * p.std,
            "{key}: {} ± {} for {truth}",
            p.fitted,
            p.std
        );
    }
    // The file that is written has them.
    let written = Rig::from_toml(&outcome.rig.to_toml()).expect("what is written can be read");
    let torque = written.effects[0].values()[0];
    assert!((torque - c.parameters["arm.coulomb.torque"].fitted).abs() < 1e-9);
}

#[test]
fn the_rig_stays_physical() {
    // The sheet's centre of mass is too far out: no inertia about it is small enough for a pendulum that swings so
    // fast.
    let real = qube();
    let mut sheet = real.clone();
    sheet.params.pendulum.com *= 1.5;
    let recordings = [record("a.csv", &real, RunSetup::default(), sweep(3.0, 0.0))];
    let options = Options {
        free: vec![
            "motor.torque_constant".into(),
            "arm.inertia".into(),
            "pendulum.inertia".into(),
            "arm.viscous".into(),
        ],
        ..Options::default()
    };
    let outcome = calibrate(&recordings, &sheet, &options).expect("a good recording");
    let c = &outcome.calibration;
    let inertia = &c.parameters["pendulum.inertia"];
    assert!(
        inertia.at_bound && inertia.fitted == 0.0 && inertia.std.is_nan(),
        "{}",
        c.summary()
    );
    assert!(
        c.notices
            .iter()
            .any(|n| n.contains("pendulum.inertia is at the bound")),
        "{:?}",
        c.notices
    );
    assert!(
        c.notices.iter().any(|n| n.contains("furuta diagnose")),
        "{:?}",
        c.notices
    );
    assert!(outcome.rig.params.validate().is_ok());

    // A body of 129 mm has its mass between hinge and tip.
    let options = Options {
        free: vec!["pendulum.com".into()],
        body_length: Some(0.09),
        ..Options::default()
    };
    let c = calibrate(&recordings, &sheet, &options)
        .expect("a good recording")
        .calibration;
    assert!(c.parameters["pendulum.com"].fitted <= 0.09);
}

#[test]
fn a_profile_agrees_with_the_standard_deviation_where_the_model_is_nearly_linear() {
    let real = qube();
    let run = RunSetup {
        seconds: 4.0,
        noise: 2e-3,
        ..RunSetup::default()
    };
    let recordings = [record("a.csv", &real, run, sweep(2.0, 0.0))];
    let options = Options {
        profile: vec!["arm.inertia".into(), "motor.resistance".into()],
        ..Options::default()
    };
    let c = calibrate(&recordings, &real, &options)
        .expect("a good recording")
        .calibration;
    let p = &c.parameters["arm.inertia"];
    let [Some(low), Some(high)] = c.profiles[0].interval else {
        panic!("{:?}", c.profiles[0]);
    };
    // The standard deviation trusts the noise less than the profile does, so it may be wider.
    let ratio = (high - low) / (2.0 * 1.96 * p.std);
    assert!((0.6..1.2).contains(&ratio), "{ratio}");
    assert!(
        c.profiles[0].rise.iter().all(|r| *r > -1e-3),
        "{:?}",
        c.profiles[0].rise
    );
    // Of what shows only as a ratio the profile is flat.
    assert_eq!(c.profiles[1].interval, [None, None]);
    assert!(
        c.profiles[1].rise.iter().all(|r| r.abs() < 0.5),
        "{:?}",
        c.profiles[1].rise
    );
}

#[test]
fn bad_input_is_named() {
    let real = qube();
    let short = record(
        "short.csv",
        &real,
        RunSetup {
            seconds: 1.0,
            ..RunSetup::default()
        },
        sweep(2.0, 0.0),
    );
    let still = record("still.csv", &real, RunSetup::default(), |_, _| 0.0);
    let good = record("good.csv", &real, RunSetup::default(), sweep(2.0, 0.0));
    let message = |recordings: &[Recording], options: Options| {
        calibrate(recordings, &real, &options)
            .expect_err("bad input")
            .to_string()
    };
    assert!(message(&[], Options::default()).starts_with("no recording was given"));
    assert!(
        message(std::slice::from_ref(&short), Options::default())
            .contains("1.00 s in stretches without a gap")
    );
    assert!(message(&[still], Options::default()).starts_with("nothing moves"));
    let free = |key: &str| Options {
        free: vec![key.into()],
        ..Options::default()
    };
    let unknown = message(std::slice::from_ref(&good), free("arm.mass"));
    assert!(
        unknown.starts_with(
            "`arm.mass` cannot be calibrated; of this rig these can: motor.torque_constant, \
                                 arm.inertia"
        ),
        "{unknown}"
    );
    let long = Options {
        horizon: 1e3,
        ..Options::default()
    };
    assert_eq!(
        message(std::slice::from_ref(&good), long),
        "horizon = 1000 is outside the allowed range [0.1, 60] s"
    );

    // A constant voltage turns the arm round and round: the pendulum's numbers do not show.
    let mut circling = real.clone();
    circling.params.pendulum.viscous = 1e-5;
    let constant = record(
        "constant.csv",
        &circling,
        RunSetup {
            seconds: 5.0,
            ..RunSetup::default()
        },
        |_, _| 0.0,
    );
    assert!(calibrate(&[constant], &real, &Options::default()).is_err());

    // Missing samples: stretches too short to use.
    let mut holes = good.clone();
    holes.segments = (0..100).map(|i| 50 * i..50 * i + 20).collect();
    assert!(message(&[holes], Options::default()).contains("without missing samples"));

    // An effect of a size that does not show in these.
    let mut tilted = real.clone();
    tilted
        .effects
        .push(Effect::new("pendulum.quadratic", &[1e-12]).expect("valid"));
    let nothing = calibrate(
        std::slice::from_ref(&good),
        &tilted,
        &Options {
            free: vec!["pendulum.inertia_axial".into()],
            hold: vec!["pendulum.inertia_axial".into()],
            ..Options::default()
        },
    )
    .expect_err("one wish contradicts the other")
    .to_string();
    assert!(
        nothing.starts_with("`pendulum.inertia_axial` is both to be fitted and to be held"),
        "{nothing}"
    );

    // A body that ends before its centre of mass.
    let options = Options {
        body_length: Some(0.01),
        ..Options::default()
    };
    let short = calibrate(std::slice::from_ref(&good), &real, &options).expect_err("no such body");
    assert!(
        matches!(short, CalibrateError::OutOfRange { what: "body length", min, .. } if min == real.params.pendulum.com),
        "{short}"
    );

    // One recording under two names, the arm's alone and the whole rig's.
    let options = Options {
        beside: vec![(Pendulum::Removed, good.clone())],
        ..Options::default()
    };
    let twice = calibrate(std::slice::from_ref(&good), &real, &options).expect_err("once");
    assert!(
        matches!(twice, CalibrateError::Insufficient(Insufficient::Twice(_))),
        "{twice}"
    );

    // A recording of something else.
    let mut other = good;
    for (t, a) in other.t.iter().zip(&mut other.alpha) {
        *a += 5.0 * (20.0 * t).sin();
    }
    let follows = calibrate(&[other], &real, &Options::default()).map(|o| o.calibration.chi);
    assert!(
        matches!(follows, Err(CalibrateError::DoesNotFollow { .. })),
        "{follows:?}"
    );
}
