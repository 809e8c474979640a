//! A balanced rig with an effect: what knowing it is worth.

use furuta_design::estimation::{compare, record};
use furuta_design::limit_cycle::{Knowing, Wandering, run, typical};
use furuta_model::{Effect, Rig};

const PERIOD: f64 = 0.002;

fn wandering(
    rig: &Rig,
    effects: &[Effect<f64>],
    known: Option<&Rig>,
    knowing: Knowing,
) -> Wandering {
    Wandering::of(&run(rig, effects, known, knowing, PERIOD, 16.0).expect("a control system"))
}

/// The sizes are multiples of what would be noticed on each rig.
#[test]
fn limit_cycles_shrink_when_the_effect_is_known_or_observed() {
    for name in Rig::VOLTAGE {
        let rig = Rig::builtin(name).expect("built in");
        for id in ["arm.coulomb", "arm.stribeck", "motor.deadzone"] {
            let effects = [typical(&rig, id, 1.0).expect("an effect")];
            let [unknown, known, observed] =
                Knowing::ALL.map(|k| wandering(&rig, &effects, None, k));
            assert!(unknown.arm > 0.15, "{name}, {id}: {unknown:?}");
            for better in [known, observed] {
                // 10 to 50 times smaller as measured; a quarter leaves room for where the runs end.
                assert!(
                    better.up == 1.0 && better.arm < 0.25 * unknown.arm,
                    "{name}, {id}: {better:?}"
                );
            }
        }
    }
}

#[test]
fn offsets_go_when_the_effect_is_known_or_observed() {
    for name in ["fong2014-emecs", "shahzad2022-srv02", "qube-servo-2"] {
        let rig = Rig::builtin(name).expect("built in");
        for id in ["motor.bias", "arm.spring", "arm.cable"] {
            let effects = [typical(&rig, id, 1.0).expect("an effect")];
            let [unknown, known, observed] =
                Knowing::ALL.map(|k| wandering(&rig, &effects, None, k));
            for better in [known, observed] {
                assert!(
                    better.offset.abs() < 0.1 * unknown.offset.abs(),
                    "{name}, {id}: {better:?}"
                );
            }
        }
    }
}

/// A delay that fells a rig whose control system does not know of it.
#[test]
fn a_delay_is_looked_over() {
    let rig = Rig::builtin("shahzad2022-srv02").expect("built in");
    let late = [Effect::new("motor.delay", &[0.04]).expect("an effect")];
    assert!(wandering(&rig, &late, None, Knowing::Nothing).up < 1.0);
    let known = wandering(&rig, &late, None, Knowing::TheEffect);
    assert!(known.up == 1.0 && known.arm < 0.02, "{known:?}");
}

/// Friction changes from day to day: a rig file that is 30 % off still helps, and does not shake.
#[test]
fn friction_need_not_be_known_exactly() {
    for name in Rig::VOLTAGE {
        let rig = Rig::builtin(name).expect("built in");
        let real = typical(&rig, "arm.coulomb", 1.0).expect("an effect");
        let unknown = wandering(&rig, &[real], None, Knowing::Nothing);
        for share in [0.7, 1.3] {
            let mut file = rig.clone();
            file.effects.extend(typical(&rig, "arm.coulomb", share));
            let known = wandering(&rig, &[real], Some(&file), Knowing::TheEffect);
            assert!(
                known.arm < 0.5 * unknown.arm && known.command < 1.2 * unknown.command,
                "{name}, {share}: {known:?}"
            );
        }
    }
}

/// With the friction in the rig file, every estimator with a model knows the arm's speed better than without, and
/// better than the derivative does.
#[test]
fn estimators_profit_from_friction_that_is_named() {
    for name in ["shahzad2022-srv02", "qube-servo-2"] {
        let rig = Rig::builtin(name).expect("built in");
        let mut named = rig.clone();
        named.effects.extend(typical(&rig, "arm.coulomb", 1.0));
        let samples = record(&rig, &named.effects, PERIOD, 8.0).expect("a control system");
        let without = compare(&rig, &samples, PERIOD).expect("estimators");
        let with = compare(&named, &samples, PERIOD).expect("estimators");
        let derivative = with.last().expect("the derivative is one").arm_speed;
        for (a, b) in without
            .iter()
            .zip(&with)
            .filter(|(a, _)| a.id != "derivative")
        {
            assert!(b.arm_speed < a.arm_speed, "{name}: {a:?} {b:?}");
            if a.id != "disturbance_observer" {
                assert!(b.arm_speed < derivative, "{name}: {b:?} {derivative}");
            }
        }
    }
}
