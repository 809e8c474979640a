//! What wrong data sheets and noisy encoders must not be taken for.

use crate::common;

use common::{RunSetup, diagnosis, names, qube, record, sweep};
use furuta_ident::diagnose::Verdict;
use furuta_ident::recording::Recording;
use furuta_model::{Effect, State};

/// A level rig shows `m c` only, so a sheet may be wrong about `c` and all fits; on a tilted one the weight pulls the
/// arm by `m L_r`, and what the sheet has wrong there is no cogging.
#[test]
fn a_tilt_is_named_alone_though_the_sheet_has_the_centre_of_mass_wrong() {
    let mut rig = qube();
    rig.effects = vec![Effect::new("arm.tilt", &[0.03, 0.6, 0.0]).expect("valid")];
    let mut sheet = qube();
    sheet.params.pendulum.com *= 0.85;
    let run = |name, amplitude, phase| {
        let sweep = sweep(amplitude, phase);
        record(name, &rig, RunSetup::default(), |t, x| {
            sweep(t, x) - 0.2 * x.theta
        })
    };
    let found = diagnosis(&[run("a.csv", 2.0, 0.0), run("b.csv", 3.0, 2.0)], &sheet);
    assert_eq!(names(&found), ["arm.tilt"]);
    assert_eq!(found.verdict, Verdict::MissingEffects);
    let tilt = &found.effects[0].parameters;
    assert!((tilt["angle"].value - 0.03).abs() < 1e-3, "{tilt:?}");
    // m L_r over m c, by the sheet's c: what the sheet has too much.
    assert!((tilt["unbalance"].value + 0.15).abs() < 0.02, "{tilt:?}");
}

/// An arm that rests again and again on bent bristles, read by encoders that flicker: how far they are bent follows
/// from the way before, not from the flicker.
#[test]
fn presliding_friction_is_named_alone_though_the_encoders_flicker() {
    let mut sheet = qube();
    (
        sheet.sensors.arm_counts_per_rev,
        sheet.sensors.pendulum_counts_per_rev,
    ) = (4096.0, 4096.0);
    let mut rig = sheet.clone();
    rig.effects = vec![Effect::new("arm.presliding", &[4e-3, 0.05]).expect("valid")];
    let noise = 0.3 * rig.sensors.resolution()[0];
    // Pushes of a quarter of a second, between which the arm rests.
    let pushes = |t: f64| {
        let n = (t / 0.75).floor();
        let size = 0.8 + 0.5 * (2.7 * n).sin();
        if t % 0.75 < 0.25 {
            size * (1.9 * n).cos().signum()
        } else {
            0.15 * (3.0 * t).sin()
        }
    };
    let run = |seed, rest| {
        let run = RunSetup {
            noise,
            seed,
            ..RunSetup::default()
        };
        record("pushes.csv", &rig, run, |t, _| pushes(t + rest))
    };
    let found = diagnosis(&[run(1, 0.0), run(2, 7.5)], &sheet);
    assert_eq!(names(&found), ["arm.presliding"]);
    assert_eq!(found.verdict, Verdict::MissingEffects);
}

/// An arm that stands half a turn away while its pendulum is balanced, both where a pendulum that hangs in the wrong
/// column would be.
#[test]
fn an_arm_that_stands_half_a_turn_away_is_not_taken_for_a_pendulum() {
    let gain = [-2.5, 41.4, -1.636, 2.421];
    let away = -3.2;
    let run = RunSetup {
        start: State::new(away, 0.02, 0.0, 0.0),
        ..RunSetup::default()
    };
    let balanced = record("away.csv", &qube(), run, |t, x| {
        let wish = 0.1 * (2.0 * t).sin() + 0.1 * (9.0 * t).sin();
        let x = [x.theta - away, x.alpha, x.theta_dot, x.alpha_dot];
        let u: f64 = gain.iter().zip(x).map(|(k, x)| -k * x).sum();
        (u + 3.0 * wish).clamp(-10.0, 10.0)
    });
    assert!(balanced.alpha.iter().all(|a| a.abs() < 0.5), "it balances");
    let samples = balanced.t.iter().enumerate();
    let samples = samples.map(|(k, t)| [*t, balanced.u[k], balanced.theta[k], balanced.alpha[k]]);
    let (_, notices) = Recording::from_samples("away", samples).expect("valid");
    assert!(
        notices.iter().all(|n| !n.kind.is_suspicion()),
        "{notices:?}"
    );
}
