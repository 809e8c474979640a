//! What few rigs have is named unasked where it explains what the usual effects leave, or what several of them imitate.

use furuta_ident::diagnose::Verdict;
use furuta_model::{Effect, RARE, State};

use super::diagnose::{H, qube, run, run_from, run_with};

/// What few rigs have is named unasked where it explains what the usual effects leave, alone and beside Coulomb
/// friction.
#[test]
fn what_few_rigs_have_is_named() {
    named_beside_friction("arm.relaxation", &[5e-3, 0.6]);
}

/// Bristles with dampers leave something that Dahl's do not explain, and are named in their place; without dampers they
/// are Dahl's.
#[test]
fn damped_bristles_are_named_in_the_place_of_others() {
    let named = |effects: &[(&str, &[f64])]| {
        let hidden: Vec<Effect<f64>> = (effects.iter())
            .map(|(id, values)| Effect::new(id, values).expect("valid"))
            .collect();
        let found = run(&qube(), &hidden).diagnosis;
        println!("{effects:?} {:#?} {:?}", found.effects, found.verdict);
        let mut ids: Vec<String> = found.effects.iter().map(|e| e.id.clone()).collect();
        ids.sort();
        (ids.join(" "), found.verdict)
    };
    let explained = |ids: &str| (ids.to_owned(), Verdict::MissingEffects);
    // The bristles' own frequency is 4 Hz on this arm, their damping about a half of critical.
    let damped: (&str, &[f64]) = ("arm.lugre", &[2e-3, 0.05, 2e-3]);
    assert_eq!(named(&[damped]), explained("arm.lugre"));
    assert_eq!(
        named(&[damped, ("motor.bias", &[0.2])]),
        explained("arm.lugre motor.bias")
    );
    assert_eq!(
        named(&[("arm.presliding", &[2e-3, 0.05])]),
        explained("arm.presliding")
    );
}

/// More of them. Apart, since each diagnosis with an entry on request takes long, and the test above, which runs by
/// default, is of the same kind.
#[test]
#[ignore = "a minute: make test-long"]
fn end_stops_and_eccentric_encoders_are_named() {
    named_beside_friction("arm.stop", &[0.3, 0.5, 2e-3, 0.1]);
    named_beside_friction("sensor.theta.eccentricity", &[0.06, 0.8]);
}

fn named_beside_friction(id: &str, values: &[f64]) {
    let effect = Effect::new(id, values).expect("valid");
    let found = |effects: &[Effect<f64>]| {
        let found = run(&qube(), effects).diagnosis;
        let mut ids: Vec<String> = found.effects.iter().map(|e| e.id.clone()).collect();
        ids.sort();
        (ids, found.verdict)
    };
    let alone = (vec![id.to_owned()], Verdict::MissingEffects);
    assert_eq!(found(&[effect]), alone);
    let friction = Effect::new("arm.coulomb", &[1e-3]).expect("valid");
    let mut both = vec!["arm.coulomb".to_owned(), id.to_owned()];
    both.sort();
    assert_eq!(found(&[effect, friction]), (both, Verdict::MissingEffects));
}

/// All of the damping is back-EMF: a share of one is a value, not a bound at which a fit stopped.
#[test]
fn a_winding_is_named_beside_a_push() {
    let winding = Effect::new("motor.inductance", &[0.05, 1.0]).expect("valid");
    let push = Effect::new("disturbance.arm_kick", &[2e-2, 3.0, 0.04, 0.0]).expect("valid");
    let found = run(&qube(), &[winding, push]).diagnosis;
    let mut ids: Vec<&str> = found.effects.iter().map(|e| e.id.as_str()).collect();
    ids.sort_unstable();
    assert_eq!(ids, ["disturbance.arm_kick", "motor.inductance"]);
    assert_eq!(found.verdict, Verdict::MissingEffects);
}

/// Far from the data no strength is known well by itself: neither of two that are missing, before the other is found.
#[test]
fn a_friction_that_depends_on_the_angle_is_named_beside_a_cable() {
    let friction = Effect::new("arm.angle_friction", &[3e-3, 0.9, 2.0, 0.7]).expect("valid");
    let cable = Effect::new("arm.cable", &[1e-2, -4e-3, 6e-3, 0.0]).expect("valid");
    let found = run(&qube(), &[friction, cable]).diagnosis;
    let mut ids: Vec<&str> = found.effects.iter().map(|e| e.id.as_str()).collect();
    ids.sort_unstable();
    assert_eq!(ids, ["arm.angle_friction", "arm.cable"]);
    assert_eq!(found.verdict, Verdict::MissingEffects);
}

/// A command that is rounded to levels, beside an offset: the distance of the levels is found to a thousandth of one.
#[test]
fn levels_of_the_command_are_named_beside_an_offset() {
    let levels = Effect::new("motor.resolution", &[0.8]).expect("valid");
    let bias = Effect::new("motor.bias", &[0.2]).expect("valid");
    let found = run(&qube(), &[levels, bias]).diagnosis;
    let mut ids: Vec<&str> = found.effects.iter().map(|e| e.id.as_str()).collect();
    ids.sort_unstable();
    assert_eq!(ids, ["motor.bias", "motor.resolution"]);
    assert_eq!(found.verdict, Verdict::MissingEffects);
    let found = (found.effects.iter().find(|e| e.id == "motor.resolution")).expect("named");
    let step = found.parameters["step"].value;
    assert!((step - 0.8).abs() < 8e-4, "{step}");
}

/// A pendulum's encoder that loses counts shows it in every later window, by where it comes to rest; the windows that a
/// search begins with may lack the moment itself.
#[test]
fn lost_counts_of_the_pendulum_are_named_unasked() {
    let time = 4.3015;
    let lost = Effect::new("sensor.alpha.lost_counts", &[0.05, time, 0.0]).expect("valid");
    let found = run(&qube(), &[lost]).diagnosis;
    let ids: Vec<&str> = found.effects.iter().map(|e| e.id.as_str()).collect();
    assert_eq!(ids, ["sensor.alpha.lost_counts"]);
    assert_eq!(found.verdict, Verdict::MissingEffects);
    let p = &found.effects[0].parameters;
    // Two samples; a quarter of a count.
    assert!((p["time"].value - time).abs() < 2.0 * H, "{p:?}");
    assert!((p["size"].value - 0.05).abs() < 8e-4, "{p:?}");
}

/// Each effect that few rigs have, hidden where it shows, alone and beside an offset of the voltage: the table of
/// docs/effects.md.
/// Apart, since it makes two diagnoses for each of a dozen entries.
#[test]
#[ignore = "two minutes: make test-long"]
fn the_table_of_what_few_rigs_have() {
    let spins = State::new(0.0, std::f64::consts::PI, 0.0, 40.0);
    let hangs = State::hanging();
    let hidden: &[(&str, &[f64], State<f64>)] = &[
        ("arm.load_friction", &[0.3, 0.4], hangs),
        ("arm.angle_friction", &[2e-3, 0.8, 2.0, 0.8], hangs),
        ("arm.fading_friction", &[3e-3, 2.0], hangs),
        ("arm.lugre", &[2e-3, 0.05, 2e-3], hangs),
        ("arm.relaxation", &[5e-3, 0.6], hangs),
        ("arm.stop", &[0.3, 0.5, 2e-3, 0.1], hangs),
        ("motor.resolution", &[0.8], hangs),
        ("motor.inductance", &[0.02, 1.0], hangs),
        ("motor.current_limit", &[0.007, 1.0], hangs),
        ("sensor.theta.eccentricity", &[0.06, 0.8], hangs),
        ("sensor.alpha.eccentricity", &[0.06, 0.8], spins),
        ("sensor.theta.lost_counts", &[0.05, 4.3015, 0.0], hangs),
        ("sensor.alpha.lost_counts", &[0.05, 4.3015, 0.0], hangs),
    ];
    let bias = Effect::new("motor.bias", &[0.2]).expect("valid");
    let mut wrong = Vec::new();
    for (id, values, start) in hidden {
        let effect = Effect::new(id, values).expect("valid");
        for effects in [vec![effect], vec![effect, bias]] {
            let begin = std::time::Instant::now();
            let found = run_from(*start, &qube(), &effects, &[]).diagnosis;
            let mut ids: Vec<&str> = found.effects.iter().map(|e| e.id.as_str()).collect();
            ids.sort_unstable();
            let words: Vec<String> = (found.effects.iter())
                .map(|e| format!("{} {:?} {:?}", e.id, e.parameters, e.confusable_with))
                .collect();
            println!(
                "{id} {values:?}: {:?} {words:?} {:.0} s",
                found.verdict,
                begin.elapsed().as_secs_f64()
            );
            let mut expected: Vec<&str> = effects.iter().map(|e| e.spec().id).collect();
            expected.sort_unstable();
            if (ids.as_slice(), found.verdict) != (&expected, Verdict::MissingEffects) {
                wrong.push(format!("{expected:?}: {ids:?} {:?}", found.verdict));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// All of them at once do not accuse a sound rig, nor take the place of an effect that is there.
/// Apart, since every entry on request is fitted in every round.
#[test]
#[ignore = "a minute: make test-long"]
fn effects_on_request_do_not_accuse() {
    let clean = run_with(&qube(), &[], RARE).diagnosis;
    assert!(clean.effects.is_empty(), "{:?}", clean.effects);
    assert_eq!(clean.verdict, Verdict::ParametersOnly);
    let spring = Effect::new("arm.spring", &[2e-3, 0.2]).expect("valid");
    let found = run_with(&qube(), &[spring], RARE).diagnosis;
    let ids: Vec<&str> = found.effects.iter().map(|e| e.id.as_str()).collect();
    assert_eq!(ids, ["arm.spring"]);
}
