//! Names beside something that no catalogue has: what only imitates it is suspected, not named.

use crate::common;

use common::{RunSetup, diagnosis, names, qube, record, sweep};
use furuta_ident::diagnose::{Diagnosis, Verdict};
use furuta_ident::recording::Recording;
use furuta_model::signals::random::normal;
use furuta_model::{Effect, Rig, State};

/// A sweep from which the arm returns to its middle.
fn swept(name: &str, rig: &Rig, amplitude: f64, phase: f64) -> Recording {
    let sweep = sweep(amplitude, phase);
    record(name, rig, RunSetup::default(), |t, x| {
        sweep(t, x) - 0.2 * x.theta
    })
}

/// Why an effect is suspected.
fn suspicion<'a>(found: &'a Diagnosis, id: &str) -> &'a str {
    let suspected = found.suspected.iter().find(|s| s.id == id);
    &suspected
        .unwrap_or_else(|| panic!("{id} in {:?}", found.suspected))
        .reason
}

/// A limit of the current was called one of the voltage; few rigs have it, and it explains everything.
#[test]
fn a_limit_of_the_current_is_called_so() {
    let mut rig = qube();
    // Of 0.020 and 0.025 N m that the motor gives at rest under these sweeps; all of the damping is back-EMF.
    rig.effects = vec![Effect::new("motor.current_limit", &[0.012, 1.0]).expect("valid")];
    let recordings = [
        swept("a.csv", &rig, 4.0, 0.0),
        swept("b.csv", &rig, 5.0, 2.0),
    ];
    let found = diagnosis(&recordings, &qube());
    assert_eq!(
        names(&found),
        ["motor.current_limit"],
        "{:?}",
        found.suspected
    );
    assert_eq!(found.verdict, Verdict::MissingEffects);
}

/// A limit of the voltage that only the highest peaks reach was called a push of the arm.
#[test]
fn a_limit_that_is_seldom_reached_is_called_so() {
    let given = swept("a.csv", &qube(), 4.0, 0.0);
    let limit = 0.95 * given.u.iter().fold(0.0, |most: f64, u| most.max(u.abs()));
    let mut rig = qube();
    rig.effects = vec![Effect::new("motor.saturation", &[limit]).expect("valid")];
    let recordings = [
        swept("a.csv", &rig, 4.0, 0.0),
        swept("b.csv", &rig, 3.0, 2.0),
    ];
    let found = diagnosis(&recordings, &qube());
    assert_eq!(names(&found), ["motor.saturation"]);
    assert_eq!(found.verdict, Verdict::MissingEffects);
    let told = &found.effects[0].parameters["limit"];
    // Half of what is cut off.
    assert!((told.value - limit).abs() < 0.025 * limit, "{told:?}");
}

/// Knocks at the table in every recording were called one push of the arm.
#[test]
fn what_comes_again_is_no_kick() {
    let knocked = |name: &str, amplitude, phase, time| {
        let mut rig = qube();
        rig.effects =
            vec![Effect::new("disturbance.arm_kick", &[0.02, time, 0.03, 0.0]).expect("valid")];
        swept(name, &rig, amplitude, phase)
    };
    let recordings = [
        knocked("a.csv", 2.0, 0.0, 3.1),
        knocked("b.csv", 3.0, 2.0, 5.7),
        knocked("c.csv", 2.5, 4.0, 4.4),
        knocked("d.csv", 3.0, 5.0, 6.9),
    ];
    let found = diagnosis(&recordings, &qube());
    assert_eq!(names(&found), [""; 0], "{:?}", found.suspected);
    assert_eq!(found.verdict, Verdict::Unexplained);
    let reason = suspicion(&found, "disturbance.arm_kick");
    assert!(reason.contains("another at"), "{reason}");
}

/// Two sweeps of an arm with a dry friction (N m) that changes with the time (s), read by encoders with some noise.
fn rubbed(friction: impl Fn(f64) -> f64) -> [Recording; 2] {
    let rig = qube();
    let run = |name: &str, amplitude, phase: f64, seed: u64| {
        let h = 2e-3;
        let sweep = sweep(amplitude, phase);
        let mut plant = rig.plant::<f64>();
        let mut s = plant.rest(State::hanging());
        let mut samples = Vec::new();
        for k in 0..5000_u32 {
            let t = f64::from(k) * h;
            let coulomb = Effect::new("arm.coulomb", &[friction(t)]).expect("valid");
            plant = furuta_model::Plant::new(&rig.params, &[coulomb]).expect("valid");
            let y = plant.measure(&s);
            let u = sweep(t, &s.x) - 0.2 * s.x.theta;
            let noise = |c: u64| 3e-4 * normal(2 * seed + c, u64::from(k));
            let [theta, alpha] = rig.sensors.quantised([y[0] + noise(0), y[1] + noise(1)]);
            samples.push([t, u, theta, alpha]);
            plant.step(&mut s, u, h);
        }
        Recording::from_samples(name, samples).expect("valid").0
    };
    [run("a.csv", 2.0, 0.0, 1), run("b.csv", 3.0, 2.0, 2)]
}

/// Friction that wears off as the rig warms up, simulated as Coulomb friction that is another in each sample.
#[test]
fn friction_that_fades_is_called_so() {
    let (torque, seconds) = (4e-3, 3.0);
    let found = diagnosis(&rubbed(|t| torque * (-t / seconds).exp()), &qube());
    assert_eq!(
        names(&found),
        ["arm.fading_friction"],
        "{:?}",
        found.suspected
    );
    assert_eq!(found.verdict, Verdict::MissingEffects);
    // Three standard deviations of the time constant, which is known to 0.06 per cent; both are within a third of that.
    let parameters = &found.effects[0].parameters;
    assert!(
        (parameters["torque"].value / torque - 1.0).abs() < 2e-3,
        "{parameters:?}"
    );
    assert!(
        (parameters["time_constant"].value / seconds - 1.0).abs() < 2e-3,
        "{parameters:?}"
    );
}

/// Friction that comes and goes is no law of the speed, nor one that fades.
#[test]
fn friction_that_comes_and_goes_is_not_called_a_law_of_the_speed() {
    let waves = |t: f64| 2e-3 * (1.0 + (std::f64::consts::TAU * t / 4.0).cos());
    let found = diagnosis(&rubbed(waves), &qube());
    assert_eq!(found.verdict, Verdict::Unexplained);
    assert_eq!(names(&found), [""; 0], "{:?}", found.suspected);
    let scattered = |s: &furuta_ident::diagnose::result::Suspected| {
        s.reason.contains("not the same everywhere")
    };
    assert!(
        found.suspected.iter().any(scattered),
        "{:?}",
        found.suspected
    );
}

/// Friction that grows with the speed fits Stribeck's law with the wrong sign, and is not called so; the repaired model
/// predicts with it all the same.
#[test]
fn friction_that_grows_with_the_speed_is_not_called_stribecks() {
    let mut rig = qube();
    rig.effects = vec![Effect::new("arm.stribeck", &[4e-3, 1e-3, 2.0]).expect("valid")];
    let recordings = [
        swept("a.csv", &rig, 2.0, 0.0),
        swept("b.csv", &rig, 3.0, 2.0),
    ];
    let found = diagnosis(&recordings, &qube());
    assert_eq!(found.verdict, Verdict::Unexplained);
    assert_eq!(names(&found), [""; 0], "{:?}", found.suspected);
    let reason = suspicion(&found, "arm.stribeck");
    assert!(reason.contains("grows with the speed"), "{reason}");
    // The plant here is the model's own: what is left is rounding.
    assert!(found.gap.augmented.theta < found.gap.noise_floor.theta);
}

/// Each recording's own zero of alpha shows the offset, whatever steps the arm's encoder makes; data kept apart do not,
/// as a zero of their own follows it.
#[test]
fn an_offset_of_alpha_is_named_beside_lost_counts() {
    let lossy = |name: &str, amplitude, phase, time| {
        let mut rig = qube();
        rig.effects = vec![
            Effect::new("sensor.theta.lost_counts", &[0.15, time, 0.0]).expect("valid"),
            Effect::new("sensor.alpha.offset", &[0.04]).expect("valid"),
        ];
        swept(name, &rig, amplitude, phase)
    };
    let recordings = [
        lossy("a.csv", 2.0, 0.0, 3.1),
        lossy("b.csv", 3.0, 2.0, 5.7),
        lossy("c.csv", 2.5, 4.0, 4.4),
    ];
    let found = diagnosis(&recordings, &qube());
    assert_eq!(found.verdict, Verdict::Unexplained);
    assert_eq!(
        names(&found),
        ["sensor.alpha.offset"],
        "{:?}",
        found.suspected
    );
    let angle = found.effects[0].parameters["angle"].value;
    assert!((angle - 0.04).abs() < 2e-3, "{angle}");
}
